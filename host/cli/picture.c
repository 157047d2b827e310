#include "host/cli/picture.h"

#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/base/text.h"
#include "host/cli/options.h"
#include "host/cli/version.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

const char *const picture_aov_names[PICTURE_AOV_COUNT] = {"t",      "normal", "position", "object",
                                                          "shadow", "ray",    "path",     "color"};

enum { AOV_COLOR = 1 << 7, NOTE_COUNT_LARGEST = 16 };

typedef struct {
    void *items;
    size_t capacity;
} Scratch;

struct Picture {
    const PictureOptions *options;
    const char *scene_path;
    const Scene *scene;
    const RenderSettings *settings;
    const Renderer *renderer;
    const Device *device;
    bool opened;
    ImageWriter *color, *aovs[PICTURE_AOV_COUNT];
    Scratch converted; // a band's values in another type

    // A band is written by a thread of its own while the next is rendered; until it has ended, all from here
    // on is that thread's, and so are the writers and messages.
    pthread_t thread;
    bool writing, failed;
    MessageList *messages;
    Band band;
    Scratch parts[PICTURE_AOV_COUNT]; // that it points to
    double seconds;
};

char *picture_default_path(const char *scene_path)
{
    const char *slash = strrchr(scene_path, '/');
    const char *name = slash ? slash + 1 : scene_path;
    const char *dot = strrchr(name, '.');
    Text path = {0};
    text_append(&path, name, dot && dot > name ? (size_t)(dot - name) : strlen(name));
    text_appendf(&path, ".png");
    return path.items;
}

bool picture_path_known(const char *path)
{
    if (image_format_of(path) != IMAGE_UNKNOWN) return true;
    fprintf(stderr, "glint: %s: the name must end in .png, .ppm, .exr or .npy\n", path);
    return false;
}

unsigned picture_renderer_aovs(const PictureOptions *options)
{
    return options->aovs & ~(unsigned)AOV_COLOR;
}

Picture *picture_open(const PictureOptions *options, const char *scene_path, const Scene *scene,
                      const RenderSettings *settings, const Renderer *renderer, const Device *device)
{
    Picture *picture = memory_allocate_zeroed(1, sizeof *picture);
    *picture = (Picture){.options = options,
                         .scene_path = scene_path,
                         .scene = scene,
                         .settings = settings,
                         .renderer = renderer,
                         .device = device};
    return picture;
}

typedef struct {
    Text text;
    size_t starts[NOTE_COUNT_LARGEST][2];
    size_t count;
} Notes;

static void notes_add(Notes *notes, const char *key, const char *value)
{
    notes->starts[notes->count][0] = notes->text.count;
    text_append(&notes->text, key, strlen(key) + 1);
    notes->starts[notes->count++][1] = notes->text.count;
    text_append(&notes->text, value, strlen(value) + 1);
}

// The settings that made the picture: enough to make it again.
static void notes_write(Notes *notes, const Picture *picture)
{
    const RenderSettings *settings = picture->settings;
    const RenderReport *report = renderer_report(picture->renderer);
    const char *slash = strrchr(picture->scene_path, '/');
    Text value = {0};
#define NOTE(key, ...)                                                                                       \
    (text_free(&value), text_appendf(&value, __VA_ARGS__), notes_add(notes, key, text_c(&value)))
    NOTE("Software", "glint %s", glint_version());
    NOTE("Scene", "%s", slash ? slash + 1 : picture->scene_path);
    NOTE("Device", "%s", picture->device->name);
    NOTE("Driver", "%s, %s", picture->device->platform_name, picture->device->driver);
    NOTE("Precision", "%s", precision_names[settings->precision]);
    NOTE("Lanes", "%u", report->lanes);
    NOTE("Samples", "%u", settings->sample_count);
    NOTE("Bounces", "%u", settings->bounce_count);
    NOTE("Size", "%ux%u", settings->width, settings->height);
    NOTE("Region", "%u,%u,%u,%u", settings->region_x, settings->region_y, settings->region_width,
         settings->region_height);
    NOTE("Transfer", "%s", picture->options->transfer == TRANSFER_SRGB ? "srgb" : "none");
    NOTE("Kernel", "%016llx", (unsigned long long)report->kernel_hash);
#undef NOTE
    text_free(&value);
}

static ImageHeader header_of(const Picture *picture, uint32_t channels, char npy_type, const ImageNote *notes)
{
    return (ImageHeader){
        .format = IMAGE_NPY,
        .width = picture->settings->region_width,
        .height = picture->settings->region_height,
        .channels = channels,
        .transfer = picture->options->transfer,
        .bits = picture->options->bits,
        .npy_type = npy_type,
        .notes = notes,
    };
}

// picture.png -> picture.NAME.npy
static char *aov_path(const PictureOptions *options, const char *name)
{
    Text path = {0};
    const char *dot = strrchr(options->path, '.');
    text_append(&path, options->path, (size_t)(dot - options->path));
    text_appendf(&path, ".%s.npy", name);
    return path.items;
}

bool picture_spares_scene(const PictureOptions *options, const Scene *scene, const char *scene_path)
{
    bool spares = output_spares_scene(options->path, scene, scene_path);
    for (size_t i = 0; i < PICTURE_AOV_COUNT && spares; i++) {
        if (!(options->aovs >> i & 1)) continue;
        char *path = aov_path(options, picture_aov_names[i]);
        spares = output_spares_scene(path, scene, scene_path);
        free(path);
    }
    return spares;
}

static bool files_open(Picture *picture, MessageList *messages)
{
    Notes notes = {0};
    notes_write(&notes, picture);
    ImageNote list[NOTE_COUNT_LARGEST + 1] = {0};
    for (size_t i = 0; i < notes.count; i++)
        list[i] = (ImageNote){notes.text.items + notes.starts[i][0], notes.text.items + notes.starts[i][1]};

    char real_type = renderer_report(picture->renderer)->wide ? 'd' : 'f';
    ImageHeader header = header_of(picture, 3, real_type, list);
    header.format = image_format_of(picture->options->path);
    if (header.format != IMAGE_NPY) header.npy_type = 'f';
    picture->color = image_writer_open(picture->options->path, &header, messages);
    bool opened = picture->color != NULL;

    const ImageHeader aov_headers[PICTURE_AOV_COUNT] = {
        header_of(picture, 1, real_type, NULL),
        header_of(picture, 3, real_type, NULL),
        header_of(picture, 3, 'd', NULL),
        header_of(picture, 1, 'u', NULL),
        header_of(picture, (uint32_t)picture->scene->lights.count, 'u', NULL),
        header_of(picture, 3, real_type, NULL),
        header_of(picture, 1, 'u', NULL),
        header_of(picture, 3, real_type, NULL),
    };
    for (size_t i = 0; i < PICTURE_AOV_COUNT && opened; i++) {
        if (!(picture->options->aovs >> i & 1)) continue;
        if (aov_headers[i].channels == 0) {
            message_add(messages, MESSAGE_WARNING, "no shadow masks are written: the scene has no lights");
            continue;
        }
        char *path = aov_path(picture->options, picture_aov_names[i]);
        picture->aovs[i] = image_writer_open(path, &aov_headers[i], messages);
        opened = picture->aovs[i] != NULL;
        free(path);
    }
    text_free(&notes.text);
    return opened;
}

static void *scratch_reserve(Scratch *scratch, size_t size)
{
    if (scratch->capacity < size) {
        scratch->items = memory_resize(scratch->items, size, 1);
        scratch->capacity = size;
    }
    return scratch->items;
}

static const float *narrowed(Picture *picture, const double *values, size_t count)
{
    float *narrow = scratch_reserve(&picture->converted, count * sizeof *narrow);
    numbers_narrow(narrow, values, count);
    return narrow;
}

// Positions come relative to the eye; the file has them in the world, in double so that no bit is lost.
static const double *positions_in_world(Picture *picture, const Band *band, size_t pixels)
{
    double *world = scratch_reserve(&picture->converted, 3 * pixels * sizeof *world);
    numbers_widen(world, band->position, 3 * pixels, renderer_report(picture->renderer)->wide);
    Vector3 eye = picture->scene->camera.position;
    const double axes[3] = {eye.x, eye.y, eye.z};
    for (size_t i = 0; i < 3 * pixels; i++)
        world[i] += axes[i % 3];
    return world;
}

static bool band_write(Picture *picture)
{
    const Band *band = &picture->band;
    MessageList *messages = picture->messages;
    size_t pixels = (size_t)picture->settings->region_width * band->row_count;
    const void *colors = band->colors;
    if (colors && renderer_report(picture->renderer)->wide &&
        image_format_of(picture->options->path) != IMAGE_NPY)
        colors = narrowed(picture, colors, 3 * pixels);
    if (!image_writer_rows(picture->color, colors, band->row_count, messages)) return false;

    const void *values[PICTURE_AOV_COUNT] = {band->t,      band->normal, NULL,       band->object,
                                             band->shadow, band->ray,    band->path, band->colors};
    if (band->position) values[2] = positions_in_world(picture, band, pixels);
    for (size_t i = 0; i < PICTURE_AOV_COUNT; i++)
        if (picture->aovs[i] && !image_writer_rows(picture->aovs[i], values[i], band->row_count, messages))
            return false;
    return true;
}

static void *band_thread(void *argument)
{
    Picture *picture = argument;
    double start = clock_seconds();
    if (!band_write(picture)) picture->failed = true;
    picture->seconds += clock_seconds() - start;
    return NULL;
}

// False: a band could not be written.
static bool band_written(Picture *picture)
{
    if (picture->writing) pthread_join(picture->thread, NULL);
    picture->writing = false;
    return !picture->failed;
}

static const void *part_keep(Scratch *part, const void *values, size_t size)
{
    return values ? memcpy(scratch_reserve(part, size), values, size) : NULL;
}

// The renderer's own memory is for its next band.
static void band_keep(Picture *picture, const Band *band)
{
    size_t pixels = (size_t)picture->settings->region_width * band->row_count;
    size_t reals = pixels * (renderer_report(picture->renderer)->wide ? sizeof(double) : sizeof(float));
    size_t integers = pixels * sizeof(uint32_t);
    Scratch *parts = picture->parts;
    picture->band = (Band){
        .first_row = band->first_row,
        .row_count = band->row_count,
        .colors = part_keep(&parts[0], band->colors, 3 * reals),
        .t = part_keep(&parts[1], band->t, reals),
        .normal = part_keep(&parts[2], band->normal, 3 * reals),
        .position = part_keep(&parts[3], band->position, 3 * reals),
        .object = part_keep(&parts[4], band->object, integers),
        .shadow = part_keep(&parts[5], band->shadow, picture->scene->lights.count * integers),
        .ray = part_keep(&parts[6], band->ray, 3 * reals),
        .path = part_keep(&parts[7], band->path, integers),
    };
}

bool picture_write(Picture *picture, const Band *band, MessageList *messages)
{
    if (!picture->opened && !files_open(picture, messages)) return false;
    picture->opened = true;
    if (!band_written(picture)) return false;
    picture->messages = messages;
    band_keep(picture, band);
    picture->writing =
        !picture->options->apart && pthread_create(&picture->thread, NULL, band_thread, picture) == 0;
    if (picture->writing) return true; // or told with the next band
    band_thread(picture);
    return !picture->failed;
}

static void picture_free(Picture *picture)
{
    free(picture->converted.items);
    for (size_t i = 0; i < PICTURE_AOV_COUNT; i++)
        free(picture->parts[i].items);
    free(picture);
}

bool picture_commit(Picture *picture, MessageList *messages, double *seconds)
{
    if (!band_written(picture)) {
        picture_abandon(picture);
        return false;
    }
    double start = clock_seconds();
    bool whole = image_writer_settle(picture->color, messages);
    for (size_t i = 0; i < PICTURE_AOV_COUNT && whole; i++)
        if (picture->aovs[i]) whole = image_writer_settle(picture->aovs[i], messages);
    if (!whole) {
        picture_abandon(picture);
        return false;
    }
    whole = image_writer_commit(picture->color, messages);
    for (size_t i = 0; i < PICTURE_AOV_COUNT; i++) {
        if (!picture->aovs[i]) continue;
        if (whole)
            whole = image_writer_commit(picture->aovs[i], messages);
        else
            image_writer_abandon(picture->aovs[i]);
    }
    *seconds = picture->seconds + (clock_seconds() - start);
    picture_free(picture);
    return whole;
}

void picture_abandon(Picture *picture)
{
    band_written(picture);
    for (size_t i = 0; i < PICTURE_AOV_COUNT; i++)
        if (picture->aovs[i]) image_writer_abandon(picture->aovs[i]);
    if (picture->color) image_writer_abandon(picture->color);
    picture_free(picture);
}
