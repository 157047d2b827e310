// glint golden writes and checks the images of scenes at strict, which have the same bits on every device, as
// one line per scene.
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/format.h"
#include "host/cli/options.h"
#include "host/cli/progress.h"
#include "host/cli/report_json.h"
#include "host/image/image.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BOUNCES_UNSET = BOUNCES_MAX + 1 };
enum { TILE_COLUMNS = 12, TILE_ROWS = 8, TILES = TILE_COLUMNS * TILE_ROWS };

static const char file_head[] = "# glint golden 1: images at strict; glint golden check compares them. "
                                "Hashes are of the scene as the device gets it,\n"
                                "# of the layers' values, and of 12 x 8 tiles of the color.\n";

// The compared layers in the order in which an image is computed, since the first that differs explains the
// others.
static const struct {
    const char *name;
    Layer layer;
} hashed[] = {{"object", LAYER_OBJECT}, {"t", LAYER_T},       {"normal", LAYER_NORMAL},
              {"shadow", LAYER_SHADOW}, {"path", LAYER_PATH}, {"color", LAYER_COLOR}};
enum { HASHED_COUNT = COUNT_OF(hashed) };

// A line of the file.
typedef struct {
    char *scene;
    uint32_t width, height, samples, bounces;
    uint64_t scene_hash, hashes[HASHED_COUNT];
    uint16_t tiles[TILES];
} Golden;

typedef struct {
    Golden *items;
    size_t count, capacity;
    Text comments; // the user's
} GoldenList;

typedef struct {
    CommonOptions common;
    ReportOptions report;
    const char *file;
    Operands scenes;  // at first with the verb before them
    uint32_t samples; // 0 if not given
    bool writes;
} GoldenOptions;

// The comparison of a scene. `first` is the first layer that differs, or HASHED_COUNT. The rectangle contains
// all tiles that differ.
typedef struct {
    const char *scene;
    bool is_new, scene_differs;
    size_t first, tile_count;
    uint32_t left, top, right, bottom; // in pixels; right and bottom are exclusive
    char *crop;                        // the file that shows it, or NULL
} Finding;

static const Option options_own[] = {
    {"file", "FILE", "the file of hashes (default: golden.txt)", option_text, offsetof(GoldenOptions, file)},
    {"size", "WxH", "image size, for write (default: 320x180)", option_size,
     offsetof(GoldenOptions, common.size)},
    {"samples", "N", "samples per pixel, for write (default: 1)", option_count,
     offsetof(GoldenOptions, samples), NUMBERS(1, SAMPLES_MAX)}};

static const ResultTable golden_table = {
    .command = "golden",
    .rows = "scenes",
    .columns = {{"scene", "scene"},
                {"verdict", "verdict"},
                {"first difference", "first"},
                {"tiles", "tiles"},
                {"left", "left"},
                {"top", "top"},
                {"right", "right"},
                {"bottom", "bottom"},
                {"crop", "crop"}},
    .name_count = 1,
    .verdicts = {"same"},
    .failed = "false",
};

static bool options_check(void *golden_options)
{
    GoldenOptions *options = golden_options;
    const char *verb = options->scenes.count > 0 ? options->scenes.items[0] : "";
    options->writes = strcmp(verb, "write") == 0;
    if (!options->writes && strcmp(verb, "check") != 0)
        return option_usage_fault("golden", "expected write or check");
    options->scenes.items++;
    options->scenes.count--;
    if (options->writes && options->scenes.count == 0) return option_usage_fault("golden", "no scene given");
    for (size_t i = 0; i < options->scenes.count; i++)
        if (strpbrk(options->scenes.items[i], "\r\n"))
            return option_usage_fault("golden", "a scene's name has a line break");
    uint32_t *size = options->common.size, *bounces = &options->common.bounce_count;
    const bool has_any = size[0] > 0 || options->samples > 0 || *bounces != BOUNCES_UNSET;
    if (!options->writes && has_any)
        return option_usage_fault(
            "golden", "--size, --samples and --bounces are for write; check takes those of the lines");
    if (size[0] == 0) memcpy(size, (const uint32_t[2]){320, 180}, sizeof options->common.size);
    if (options->samples == 0) options->samples = 1;
    if (*bounces == BOUNCES_UNSET) *bounces = BOUNCES_DEFAULT;
    if (options->writes && (options->report.format != FORMAT_TEXT || options->report.output))
        return option_usage_fault("golden", "--format, --json and --output are for check");
    return options->writes || report_options_check(&options->report, &golden_table);
}

static const CommandLine command_line = {
    .command = "golden",
    .usage = "usage: glint golden write SCENE... [OPTIONS]\n"
             "       glint golden check [SCENE...] [OPTIONS]\n\n"
             "Renders scenes at strict, whose bits are the same on every device, and writes a line of hashes "
             "per scene, or compares\n"
             "them with their lines: all of the file without a SCENE. Where an image differs it names the "
             "layer that differs first\n"
             "and the pixels, and writes these as SCENE-golden.png here. Exit status: 0 same, 3 different.\n",
    .groups = {OPTIONS(options_own), OPTION_WITHIN(ray_options[RAY_BOUNCES], GoldenOptions, common),
               OPTIONS_WITHIN(device_option, GoldenOptions, common),
               OPTIONS_WITHIN(common_options, GoldenOptions, common),
               OPTIONS_WITHIN(max_pixels_option, GoldenOptions, common.input_pixels_max),
               OPTIONS_WITHIN(driver_options, GoldenOptions, common),
               OPTIONS_WITHIN(report_options, GoldenOptions, report)},
    OPERANDS(ANY, GoldenOptions, scenes),
    .check = options_check};

static void golden_list_free(GoldenList *list)
{
    for (size_t i = 0; i < list->count; i++)
        free(list->items[i].scene);
    free(list->items);
    text_free(&list->comments);
    *list = (GoldenList){0};
}

static Golden *golden_find(const GoldenList *list, const char *scene)
{
    for (size_t i = 0; i < list->count; i++)
        if (strcmp(list->items[i].scene, scene) == 0) return &list->items[i];
    return NULL;
}

static void golden_append(Text *text, const Golden *golden)
{
    text_appendf(text, "size=%ux%u samples=%u bounces=%u scene=%016" PRIx64, golden->width, golden->height,
                 golden->samples, golden->bounces, golden->scene_hash);
    for (size_t i = 0; i < HASHED_COUNT; i++)
        text_appendf(text, " %s=%016" PRIx64, hashed[i].name, golden->hashes[i]);
    text_appendf(text, " tiles=");
    for (size_t i = 0; i < TILES; i++)
        text_appendf(text, "%04x", golden->tiles[i]);
    text_appendf(text, " %s\n", golden->scene);
}

// Reads hexadecimal digits. Returns the position after them, or NULL if there are fewer.
static const char *hex_read(const char *at, size_t digits, uint64_t *value)
{
    *value = 0;
    for (size_t i = 0; i < digits; i++, at++) {
        const char *all = "0123456789abcdef", *digit = *at ? strchr(all, *at) : NULL;
        if (!digit) return NULL;
        *value = *value << 4 | (uint64_t)(digit - all);
    }
    return at;
}

// Reads " NAME=" and 16 digits. Returns the position after them, or NULL if they are missing.
static const char *hash_read(const char *at, const char *name, uint64_t *hash)
{
    const size_t length = strlen(name);
    if (!at || *at != ' ' || strncmp(at + 1, name, length) != 0 || at[1 + length] != '=') return NULL;
    return hex_read(at + 2 + length, 16, hash);
}

// Reads a prefix and a number of up to nine digits. Returns the position after them, or NULL if absent.
static const char *line_count_read(const char *at, const char *prefix, uint32_t *value)
{
    const size_t length = strlen(prefix);
    if (!at || strncmp(at, prefix, length) != 0) return NULL;
    at += length;
    const size_t digits = strspn(at, "0123456789");
    if (digits == 0 || digits > 9) return NULL;
    *value = (uint32_t)strtoul(at, NULL, 10);
    return at + digits;
}

// Reads a line, which ends with a NUL. Returns false if it is not a line of the file's format.
static bool golden_read(Golden *golden, const char *line)
{
    const char *at = line_count_read(line, "size=", &golden->width);
    at = line_count_read(at, "x", &golden->height);
    at = line_count_read(at, " samples=", &golden->samples);
    at = line_count_read(at, " bounces=", &golden->bounces);
    at = hash_read(at, "scene", &golden->scene_hash);
    for (size_t i = 0; i < HASHED_COUNT; i++)
        at = hash_read(at, hashed[i].name, &golden->hashes[i]);
    if (!at || strncmp(at, " tiles=", 7) != 0) return false;
    at += 7;
    for (size_t i = 0; at && i < TILES; i++) {
        uint64_t tile;
        at = hex_read(at, 4, &tile);
        golden->tiles[i] = (uint16_t)tile;
    }
    const bool is_sound = at && *at == ' ' && at[1] != '\0' && golden->width > 0 &&
                          golden->width <= IMAGE_SIDE_MAX && golden->height > 0 &&
                          golden->height <= IMAGE_SIDE_MAX && golden->samples > 0 &&
                          golden->samples <= SAMPLES_MAX && golden->bounces <= BOUNCES_MAX;
    if (is_sound) golden->scene = memory_copy_text(at + 1);
    return is_sound;
}

// Reads the file. Returns false with messages if it cannot be read.
static bool golden_list_read(GoldenList *list, const char *path, MessageList *messages)
{
    Text text = {0};
    if (!text_read_file(&text, path, messages)) return false;
    const Source source = {path, text_c(&text), text.count};
    bool is_sound = true;
    for (size_t start = 0, end; start < text.count; start = end + 1) {
        const char *newline = memchr(text.items + start, '\n', text.count - start);
        end = newline ? (size_t)(newline - text.items) : text.count;
        char *line = text_format("%.*s", (int)(end - start), text.items + start);
        Golden golden = {0};
        if (end > start && text.items[end - 1] == '\r') line[end - start - 1] = '\0';
        if (golden_read(&golden, line) && golden_find(list, golden.scene)) {
            message_add_at(messages, MESSAGE_ERROR, &source, start, "a second line for \"%s\"", golden.scene);
            is_sound = false;
            free(golden.scene);
        } else if (golden.scene) {
            array_push(*list, golden);
        } else if (*line == '#') {
            if (!strstr(file_head, line)) text_appendf(&list->comments, "%s\n", line);
        } else if (*line != '\0') {
            message_add_at(messages, MESSAGE_ERROR, &source, start, "expected a line of glint golden write");
            is_sound = false;
        }
        free(line);
    }
    text_free(&text);
    return is_sound;
}

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

static void tiles_hash(const Film *film, uint16_t tiles[TILES])
{
    for (uint32_t row = 0; row < TILE_ROWS; row++)
        for (uint32_t column = 0; column < TILE_COLUMNS; column++) {
            uint64_t hash = HASH_START;
            const uint32_t left = tile_edge(film->width, column, TILE_COLUMNS),
                           right = tile_edge(film->width, column + 1, TILE_COLUMNS);
            for (uint32_t y = tile_edge(film->height, row, TILE_ROWS);
                 y < tile_edge(film->height, row + 1, TILE_ROWS); y++)
                for (size_t i = 3 * ((size_t)y * film->width + left);
                     i < 3 * ((size_t)y * film->width + right); i++) {
                    const float value = (float)film->color[i];
                    hash = hash_bytes(hash, &value, sizeof value);
                }
            tiles[row * TILE_COLUMNS + column] = (uint16_t)(hash ^ hash >> 16 ^ hash >> 32 ^ hash >> 48);
        }
}

// Writes the rectangle of the image as SCENE-golden.png. Returns NULL with a message if that fails.
static char *crop_write(const Film *film, const Finding *finding)
{
    const uint32_t width = finding->right - finding->left, height = finding->bottom - finding->top;
    char *path = text_format("%s-golden.png", finding->scene + strspn(finding->scene, "./"));
    for (char *at = path; *at; at++)
        if (*at == '/') *at = '-'; // scenes in several folders may have the same name
    float *pixels = memory_allocate(memory_product(3 * (size_t)width, height), sizeof *pixels);
    for (size_t i = 0; i < 3 * (size_t)width * height; i++) {
        const size_t y = finding->top + i / (3 * (size_t)width), in_row = i % (3 * (size_t)width);
        pixels[i] = (float)film->color[3 * (y * film->width + finding->left) + in_row];
    }
    const ImageHeader header = {
        .format = IMAGE_PNG, .width = width, .height = height, .channels = 3, .bits = 8, .npy_type = 'f'};
    MessageList messages = {0};
    const bool is_written = image_write(path, &header, pixels, &messages);
    messages_print(&messages, NULL);
    free(pixels);
    if (is_written) return path;
    free(path);
    return NULL;
}

static void findings_compare(Finding *finding, const Golden *golden, const Golden *now, const Film *film)
{
    finding->scene_differs = golden->scene_hash != now->scene_hash;
    while (finding->first < HASHED_COUNT && golden->hashes[finding->first] == now->hashes[finding->first])
        finding->first++;
    if (finding->first == HASHED_COUNT) return;
    finding->left = film->width;
    finding->top = film->height;
    for (uint32_t i = 0; i < TILES; i++) {
        if (golden->tiles[i] == now->tiles[i]) continue;
        const uint32_t row = i / TILE_COLUMNS, column = i % TILE_COLUMNS;
        const uint32_t left = tile_edge(film->width, column, TILE_COLUMNS),
                       right = tile_edge(film->width, column + 1, TILE_COLUMNS),
                       top = tile_edge(film->height, row, TILE_ROWS),
                       bottom = tile_edge(film->height, row + 1, TILE_ROWS);
        finding->tile_count++;
        if (left < finding->left) finding->left = left;
        if (top < finding->top) finding->top = top;
        if (right > finding->right) finding->right = right;
        if (bottom > finding->bottom) finding->bottom = bottom;
    }
    if (finding->tile_count > 0) finding->crop = crop_write(film, finding);
}

// Renders a scene with the settings of `golden`, and sets its hashes. Returns EXIT_DONE or the exit status of
// the failure.
static int golden_render(Golden *golden, Film *film, const GoldenOptions *options, Compute *compute)
{
    Scene scene = {0};
    if (!scene_open(&scene, golden->scene, &options->common)) return EXIT_USER;
    RenderSettings settings = settings_whole(&options->common, golden->width, golden->height);
    settings.precision = PRECISION_STRICT;
    settings.sample_count = golden->samples;
    settings.bounce_count = golden->bounces;
    settings.shift_to_eye = true;
    settings.hashes_scene = true;
    settings.stop = progress_stops;
    unsigned aovs = 0;
    for (size_t i = 0; i < HASHED_COUNT; i++)
        if (hashed[i].layer != LAYER_COLOR) aovs |= 1U << hashed[i].layer;
    MessageList messages = {0};
    Renderer *renderer = renderer_open(compute, &scene, &settings, &messages);
    messages_print(&messages, golden->scene);
    int status = renderer ? EXIT_DONE : EXIT_USER;
    if (renderer && !renderer_render_film(renderer, aovs, film))
        status = progress_interrupted() ? EXIT_INTERRUPTED : EXIT_MACHINE;
    if (status == EXIT_DONE) {
        golden->scene_hash = renderer_scene_hash(renderer);
        for (size_t i = 0; i < HASHED_COUNT; i++)
            golden->hashes[i] = layer_hash(film, hashed[i].layer);
        tiles_hash(film, golden->tiles);
    }
    renderer_close(renderer);
    scene_free(&scene);
    return status;
}

static Json *findings_json(const Device *device, const Finding *findings, size_t count)
{
    Json *json = report_json_open(1, device);
    json_begin_array(json, "scenes");
    for (size_t i = 0; i < count; i++) {
        const Finding *finding = &findings[i];
        const bool same = finding->first == HASHED_COUNT;
        json_begin_object(json, NULL);
        json_text(json, "scene", finding->scene);
        json_bool(json, "same", same);
        json_text(json, "verdict",
                  finding->is_new          ? "no line"
                  : same                   ? "same"
                  : finding->scene_differs ? "another scene"
                                           : "different");
        json_text(json, "first", same ? NULL : hashed[finding->first].name);
        json_count(json, "tiles", finding->tile_count);
        if (finding->tile_count > 0) {
            json_int64(json, "left", finding->left);
            json_int64(json, "top", finding->top);
            json_int64(json, "right", finding->right);
            json_int64(json, "bottom", finding->bottom);
        }
        json_text(json, "crop", finding->crop);
        json_end(json);
    }
    json_end(json);
    return json;
}

static void finding_print(const Finding *finding)
{
    if (finding->is_new) {
        printf("%s: no line; glint golden write makes it\n", finding->scene);
        return;
    }
    if (finding->first == HASHED_COUNT) {
        printf("%s: same\n", finding->scene);
        return;
    }
    printf("%s: different, first in %s", finding->scene, hashed[finding->first].name);
    if (finding->scene_differs) fputs("; the scene has changed", stdout);
    if (finding->tile_count > 0)
        printf("; %zu of %d tiles, within pixels %u to %u, %u to %u", finding->tile_count, TILES,
               finding->left, finding->right - 1, finding->top, finding->bottom - 1);
    printf("%s%s\n", finding->crop ? ": " : "", finding->crop ? finding->crop : "");
}

static bool golden_list_write(const GoldenList *list, const char *path)
{
    Text text = {0};
    text_appendf(&text, "%s%s", file_head, text_c(&list->comments));
    for (size_t i = 0; i < list->count; i++)
        golden_append(&text, &list->items[i]);
    MessageList messages = {0};
    const bool is_written = output_write_file(path, text.items, text.count, &messages);
    messages_print(&messages, NULL);
    text_free(&text);
    return is_written;
}

// Adds the scenes to the lines, or replaces the lines that exist. Returns the exit status.
static int scenes_write(GoldenList *list, const GoldenOptions *options, Compute *compute)
{
    for (size_t i = 0; i < options->scenes.count; i++) {
        Golden *golden = golden_find(list, options->scenes.items[i]);
        if (!golden) {
            array_push(*list, (Golden){.scene = memory_copy_text(options->scenes.items[i])});
            golden = &list->items[list->count - 1];
        }
        golden->width = options->common.size[0];
        golden->height = options->common.size[1];
        golden->samples = options->samples;
        golden->bounces = options->common.bounce_count;
        Film film = {0};
        const int status = golden_render(golden, &film, options, compute);
        film_free(&film);
        if (status != EXIT_DONE) return status;
    }
    return golden_list_write(list, options->file) ? EXIT_DONE : EXIT_USER;
}

static int scene_check(Finding *finding, const GoldenList *list, const GoldenOptions *options,
                       Compute *compute)
{
    const Golden *golden = golden_find(list, finding->scene);
    finding->is_new = !golden;
    if (!golden) return EXIT_DONE;
    Golden now = *golden;
    Film film = {0};
    const int status = golden_render(&now, &film, options, compute);
    if (status == EXIT_DONE) findings_compare(finding, golden, &now, &film);
    film_free(&film);
    return status;
}

static int scenes_check(const GoldenList *list, const GoldenOptions *options, Compute *compute)
{
    const size_t checked = options->scenes.count > 0 ? options->scenes.count : list->count;
    if (checked == 0) {
        fprintf(stderr, "glint golden: '%s' has no lines\n", options->file);
        return EXIT_USER;
    }
    Finding *findings = memory_allocate_zeroed(checked + 1, sizeof *findings);
    int status = EXIT_DONE, differing = 0;
    for (size_t i = 0; i < checked && status == EXIT_DONE; i++) {
        findings[i].scene = options->scenes.count > 0 ? options->scenes.items[i] : list->items[i].scene;
        status = scene_check(&findings[i], list, options, compute);
        differing += findings[i].is_new || findings[i].first < HASHED_COUNT;
        if (status == EXIT_DONE && report_has_text(&options->report)) finding_print(&findings[i]);
    }
    if (status == EXIT_DONE && options->report.format != FORMAT_TEXT &&
        !report_write(findings_json(compute->device, findings, checked), &golden_table, &options->report))
        status = EXIT_USER;
    for (size_t i = 0; i < checked; i++)
        free(findings[i].crop);
    free(findings);
    return status == EXIT_DONE && differing > 0 ? EXIT_CHECK : status;
}

int command_golden(int argument_count, char **arguments)
{
    GoldenOptions options = {
        .common.precision = PRECISION_STRICT, .common.bounce_count = BOUNCES_UNSET, .file = "golden.txt"};
    int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    GoldenList list = {0};
    MessageList messages = {0};
    const bool is_new = options.writes && access(options.file, F_OK) != 0;
    const bool is_read = is_new || golden_list_read(&list, options.file, &messages);
    messages_print(&messages, NULL);
    OpenDevice open;
    status = EXIT_USER;
    if (is_read && device_open(&open, &options.common)) {
        Progress progress;
        progress_open(&progress, true); // so that signals only set the flag
        status = options.writes ? scenes_write(&list, &options, &open.compute)
                                : scenes_check(&list, &options, &open.compute);
        progress_close(&progress);
        status = device_close(&open, status);
    }
    golden_list_free(&list);
    return status;
}
