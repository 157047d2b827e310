// glint golden writes and checks the images of scenes at strict, which have the same bits on every device, as
// one line per scene.
#include "host/base/array.h"
#include "host/base/exit_status.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/format.h"
#include "host/cli/golden_file.h"
#include "host/cli/interrupts.h"
#include "host/cli/open_device.h"
#include "host/cli/report_json.h"
#include "host/image/image.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BOUNCES_UNSET = BOUNCES_MAX + 1 };

typedef struct {
    CommonOptions common;
    const char *file;
    CommandOperands scenes; // at first with the verb before them
    uint32_t samples;       // 0 if not given
    bool writes;
} GoldenOptions;

typedef struct {
    uint32_t left, top, right, bottom; // in pixels; right and bottom are exclusive
} PixelBox;

// The comparison of a scene with its line.
typedef struct {
    const char *scene;
    bool has_failed, is_new, scene_differs; // has_failed: it could not be rendered, and only `scene` is set
    size_t first;                           // the index of the first layer that differs, or HASHED_COUNT
    size_t tile_count;                      // tiles that differ
    PixelBox box;                           // contains all tiles that differ
    char *crop;                             // the file that shows the box, or NULL
} GoldenCheck;

static const Option command_options[] = {
    {"file", "FILE", "the file of hashes (default: golden.txt)", option_text, offsetof(GoldenOptions, file)},
    {"size", "WxH", "image size, for write (default: 320x180)", option_size,
     offsetof(GoldenOptions, common.size)},
    {"samples", "N", "samples per pixel, for write (default: 1)", option_count,
     offsetof(GoldenOptions, samples), NUMBERS(1, SAMPLES_MAX)}};

static const ResultTable golden_table = {
    .command = "golden",
    .rows = "scenes",
    .names = {"scene"},
    .values = {"verdict", "first difference=first", "tiles", "left", "top", "right", "bottom", "crop"},
    .verdicts = {"same"},
    .failed = "false",
};

static const char *options_check(void *golden_options)
{
    GoldenOptions *options = golden_options;
    const char *verb = options->scenes.count > 0 ? options->scenes.items[0] : "";
    options->writes = strcmp(verb, "write") == 0;
    if (!options->writes && strcmp(verb, "check") != 0) return "expected write or check";
    options->scenes.items++;
    options->scenes.count--;
    if (options->writes && options->scenes.count == 0) return "no scene given";
    for (size_t i = 0; i < options->scenes.count; i++)
        if (strpbrk(options->scenes.items[i], "\r\n")) return "a scene's name has a line break";
    uint32_t *size = options->common.size, *bounces = &options->common.settings.bounce_count;
    const bool has_any = size[0] > 0 || options->samples > 0 || *bounces != BOUNCES_UNSET;
    if (!options->writes && has_any)
        return "--size, --samples and --bounces apply to write; check uses the values in the file";
    if (size[0] == 0) memcpy(size, (const uint32_t[2]){320, 180}, sizeof options->common.size);
    if (options->samples == 0) options->samples = 1;
    if (*bounces == BOUNCES_UNSET) *bounces = BOUNCES_DEFAULT;
    if (options->writes && (options->common.report.format != FORMAT_TEXT || options->common.report.output))
        return "--format, --json and --output are for check";
    return NULL;
}

static const CommandLine command_line = {
    .command = "golden",
    .usage = "usage: glint golden write SCENE... [OPTIONS]\n"
             "       glint golden check [SCENE...] [OPTIONS]\n\n"
             "Renders scenes at strict, whose bits are the same on every device. Writes a line of hashes per "
             "scene, or\n"
             "compares the scenes with their lines, by default all scenes of the file. If an image differs, "
             "prints the first\n"
             "layer that differs and the pixels, and writes these pixels to SCENE-golden.png in the current "
             "folder. Exit\n"
             "status: 0 same, 3 different.\n",
    .groups = {OPTIONS(command_options), OPTION(ray_options[RAY_BOUNCES]), OPTIONS(device_option),
               OPTIONS(common_options), OPTIONS(max_pixels_option), OPTIONS(driver_options), REPORT_OPTIONS},
    OPERANDS(ANY, GoldenOptions, scenes),
    .check = options_check};

static uint64_t layer_hash(const Film *film, Layer layer)
{
    const size_t size = film_layer_size(film, layer);
    if (layer_types[layer] == LAYER_TYPE_INTEGER) return hash_bytes(HASH_START, film->layers[layer], size);
    const double *values = film->layers[layer];
    uint64_t hash = HASH_START;
    for (size_t i = 0; i < size / sizeof *values; i++) {
        const float value = (float)values[i]; // exact, since strict computes in float
        hash = hash_bytes(hash, &value, sizeof value);
    }
    return hash;
}

static uint32_t tile_edge(uint32_t side, uint32_t index, uint32_t count)
{
    return (uint32_t)((uint64_t)side * index / count);
}

static PixelBox tile_box(const Film *film, uint32_t tile)
{
    const uint32_t row = tile / TILE_COLUMNS, column = tile % TILE_COLUMNS;
    return (PixelBox){.left = tile_edge(film->width, column, TILE_COLUMNS),
                      .top = tile_edge(film->height, row, TILE_ROWS),
                      .right = tile_edge(film->width, column + 1, TILE_COLUMNS),
                      .bottom = tile_edge(film->height, row + 1, TILE_ROWS)};
}

static uint16_t tile_hash(const Film *film, PixelBox box)
{
    uint64_t hash = HASH_START;
    for (size_t y = box.top; y < box.bottom; y++)
        for (size_t i = 3 * (y * film->width + box.left); i < 3 * (y * film->width + box.right); i++) {
            const float value = (float)film->color[i];
            hash = hash_bytes(hash, &value, sizeof value);
        }
    return (uint16_t)(hash ^ hash >> 16 ^ hash >> 32 ^ hash >> 48);
}

// Writes the box of the image as SCENE-golden.png. Returns NULL with a message if that fails.
static char *crop_write(const Film *film, const char *scene, Transfer transfer, PixelBox box)
{
    const uint32_t width = box.right - box.left, height = box.bottom - box.top;
    const size_t row_values = 3 * (size_t)width;
    OWNED char *path = text_format("%s-golden.png", scene + strspn(scene, "./"));
    for (char *at = path; *at; at++)
        if (*at == '/') *at = '-'; // scenes in several folders may have the same name
    OWNED float *pixels = memory_allocate(memory_product(row_values, height), sizeof *pixels);
    for (size_t i = 0; i < row_values * height; i++) {
        const size_t y = box.top + i / row_values;
        pixels[i] = (float)film->color[3 * (y * film->width + box.left) + i % row_values];
    }
    const ImageHeader header = {.format = IMAGE_PNG,
                                .width = width,
                                .height = height,
                                .channels = 3,
                                .bits = 8,
                                .transfer = transfer,
                                .npy_type = 'f'};
    PrintedMessages messages = {0};
    return image_write(path, &header, pixels, &messages) ? memory_release(&path) : NULL;
}

static void lines_compare(GoldenCheck *check, const GoldenLine *golden, const GoldenLine *now,
                          const Film *film)
{
    check->scene_differs = golden->scene_hash != now->scene_hash;
    while (check->first < HASHED_COUNT && golden->hashes[check->first] == now->hashes[check->first])
        check->first++;
    if (check->first == HASHED_COUNT) return;
    check->box = (PixelBox){film->width, film->height, 0, 0};
    for (uint32_t i = 0; i < TILES; i++) {
        if (golden->tiles[i] == now->tiles[i]) continue;
        const PixelBox tile = tile_box(film, i);
        check->tile_count++;
        if (tile.left < check->box.left) check->box.left = tile.left;
        if (tile.top < check->box.top) check->box.top = tile.top;
        if (tile.right > check->box.right) check->box.right = tile.right;
        if (tile.bottom > check->box.bottom) check->box.bottom = tile.bottom;
    }
    if (check->tile_count > 0) check->crop = crop_write(film, check->scene, now->transfer, check->box);
}

// Renders a scene with the settings of `golden`, and sets its hashes. Returns EXIT_DONE or the exit status of
// the failure.
static int golden_render(GoldenLine *golden, Film *film, const GoldenOptions *options, Compute *compute)
{
    OwnedScene scene = {0};
    if (!scene_open(&scene, golden->scene, &options->common)) return EXIT_USER;
    RenderSettings settings = settings_whole(&options->common, golden->width, golden->height);
    settings.sample_count = golden->samples;
    settings.bounce_count = golden->bounces;
    settings.shift_to_eye = true;
    settings.hashes_scene = true;
    settings.stop = interrupts_stop;
    unsigned aovs = 0;
    for (size_t i = 0; i < HASHED_COUNT; i++)
        if (hashed_layers[i] != LAYER_COLOR) aovs |= 1U << hashed_layers[i];
    MessageList messages = {0};
    Renderer *renderer = renderer_open(compute, &scene, &settings, &messages);
    messages_print(&messages, golden->scene);
    int status = renderer ? EXIT_DONE : compute_check_reference(compute) ? EXIT_USER : EXIT_MACHINE;
    if (renderer && !renderer_render_film(renderer, aovs, film))
        status = is_interrupted() ? EXIT_INTERRUPTED : EXIT_MACHINE;
    if (status == EXIT_DONE) {
        golden->scene_hash = renderer_scene_hash(renderer);
        golden->transfer = scene.color_meaning == COLORS_DISPLAY ? TRANSFER_NONE : TRANSFER_SRGB;
        for (size_t i = 0; i < HASHED_COUNT; i++)
            golden->hashes[i] = layer_hash(film, hashed_layers[i]);
        for (uint32_t i = 0; i < TILES; i++)
            golden->tiles[i] = tile_hash(film, tile_box(film, i));
    }
    renderer_close(renderer);
    return status;
}

static const char *verdict_of(const GoldenCheck *check)
{
    if (check->has_failed) return "not rendered";
    if (check->is_new) return "no line";
    if (check->first == HASHED_COUNT) return "same";
    return check->scene_differs ? "another scene" : "different";
}

static Json *checks_json(const Device *device, const GoldenCheck *checks, size_t count)
{
    Json *json = report_json_open(1, device);
    json_begin_array(json, "scenes");
    for (size_t i = 0; i < count; i++) {
        const GoldenCheck *check = &checks[i];
        const bool same = check->first == HASHED_COUNT, is_compared = !check->has_failed && !check->is_new;
        json_begin_object(json, NULL);
        json_addf(json, "scene %s same %d verdict %s", check->scene, same, verdict_of(check));
        json_text(json, "first", same || !is_compared ? NULL : layer_names[hashed_layers[check->first]]);
        json_count(json, "tiles", check->tile_count);
        if (check->tile_count > 0)
            json_addf(json, "left %u top %u right %u bottom %u", check->box.left, check->box.top,
                      check->box.right, check->box.bottom);
        json_text(json, "crop", check->crop);
        json_end(json);
    }
    json_end(json);
    return json;
}

static void check_print(const GoldenCheck *check, const char *file)
{
    if (check->is_new) {
        printf("%s: %s has no line for this scene; glint golden write adds it\n", check->scene, file);
        return;
    }
    if (check->first == HASHED_COUNT) {
        printf("%s: same\n", check->scene);
        return;
    }
    printf("%s: %sthe image differs, first in %s", check->scene,
           check->scene_differs ? "the scene has changed, and " : "",
           layer_names[hashed_layers[check->first]]);
    if (check->tile_count > 0)
        printf("; its color in %zu of %d tiles, at x %u to %u and y %u to %u", check->tile_count, TILES,
               check->box.left, check->box.right - 1, check->box.top, check->box.bottom - 1);
    if (check->crop) printf(", written to %s", check->crop);
    printf("\n");
}

// Adds the scenes to the lines, or replaces the lines that exist. Returns the exit status.
static int scenes_write(GoldenFile *file, const GoldenOptions *options, Compute *compute)
{
    for (size_t i = 0; i < options->scenes.count; i++) {
        GoldenLine *golden = golden_file_find(file, options->scenes.items[i]);
        if (!golden) {
            array_push(*file, (GoldenLine){.scene = memory_copy_text(options->scenes.items[i])});
            golden = &file->items[file->count - 1];
        }
        golden->width = options->common.size[0];
        golden->height = options->common.size[1];
        golden->samples = options->samples;
        golden->bounces = options->common.settings.bounce_count;
        OwnedFilm film = {0};
        const int status = golden_render(golden, &film, options, compute);
        if (status != EXIT_DONE) return status;
    }
    PrintedMessages messages = {0};
    return golden_file_write(file, options->file, &messages) ? EXIT_DONE : EXIT_USER;
}

// Returns EXIT_DONE if the scene is the same as its line, EXIT_CHECK if not, or the status of the failure.
static int scene_check(GoldenCheck *check, const GoldenFile *file, const GoldenOptions *options,
                       Compute *compute)
{
    const GoldenLine *golden = golden_file_find(file, check->scene);
    check->has_failed = !golden && access(check->scene, F_OK) != 0;
    if (check->has_failed) {
        stderr_print("cannot read '%s': %s", check->scene, strerror(errno));
        return EXIT_USER;
    }
    check->is_new = !golden;
    if (!golden) return EXIT_CHECK;
    GoldenLine now = *golden;
    OwnedFilm film = {0};
    const int status = golden_render(&now, &film, options, compute);
    check->has_failed = status != EXIT_DONE;
    if (check->has_failed) return status;
    lines_compare(check, golden, &now, &film);
    return check->first < HASHED_COUNT ? EXIT_CHECK : EXIT_DONE;
}

static int scenes_check(const GoldenFile *file, const GoldenOptions *options, Compute *compute)
{
    const size_t checked = options->scenes.count > 0 ? options->scenes.count : file->count;
    if (checked == 0) {
        stderr_print("'%s' has no lines", options->file);
        return EXIT_USER;
    }
    OWNED GoldenCheck *checks = memory_allocate_zeroed(checked, sizeof *checks);
    const ReportOptions *report = &options->common.report;
    bool continues = true;
    int status = EXIT_DONE;
    for (size_t i = 0; i < checked && continues; i++) {
        GoldenCheck *check = &checks[i];
        check->scene = options->scenes.count > 0 ? options->scenes.items[i] : file->items[i].scene;
        const int result = scene_check(check, file, options, compute);
        continues = result != EXIT_MACHINE && result != EXIT_INTERRUPTED;
        if (check->has_failed || status == EXIT_DONE) status = result;
        if (!check->has_failed && report_has_text(report)) check_print(check, options->file);
    }
    if (continues && report_has_document(report) &&
        !report_write(checks_json(compute->device, checks, checked), report))
        status = EXIT_USER;
    for (size_t i = 0; i < checked; i++)
        free(checks[i].crop);
    return status;
}

int command_golden(int argument_count, char **arguments)
{
    GoldenOptions options = {
        .common = {.settings = {.precision = PRECISION_STRICT, .bounce_count = BOUNCES_UNSET},
                   .report.table = &golden_table},
        .file = "golden.txt"};
    int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    GoldenFile file = {0};
    MessageList messages = {0};
    const bool is_new = options.writes && access(options.file, F_OK) != 0;
    const bool is_read = is_new || golden_file_read(&file, options.file, &messages);
    messages_print(&messages, NULL);
    OpenDevice open;
    status = EXIT_USER;
    if (is_read && device_open(&open, &options.common)) {
        interrupts_flag();
        status = options.writes ? scenes_write(&file, &options, &open.compute)
                                : scenes_check(&file, &options, &open.compute);
        status = device_close(&open, status);
    }
    golden_file_free(&file);
    return status;
}
