#include "host/cli/golden_file.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include "host/image/image.h"
#include "host/render/renderer.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const file_head[] = {"# glint golden 1: images at strict; glint golden check compares "
                                        "them. Hashes are of the scene as the device "
                                        "gets it,",
                                        "# of the layers' values, and of 12 x 8 tiles of the color."};

const Layer hashed_layers[] = {LAYER_OBJECT, LAYER_T, LAYER_NORMAL, LAYER_SHADOW, LAYER_PATH, LAYER_COLOR};

void golden_file_free(GoldenFile *file)
{
    for (size_t i = 0; i < file->count; i++)
        free(file->items[i].scene);
    free(file->items);
    text_free(&file->comments);
    *file = (GoldenFile){0};
}

GoldenLine *golden_file_find(const GoldenFile *file, const char *scene)
{
    for (size_t i = 0; i < file->count; i++)
        if (strcmp(file->items[i].scene, scene) == 0) return &file->items[i];
    return NULL;
}

static void golden_append(Text *text, const GoldenLine *golden)
{
    text_appendf(text, "size=%ux%u samples=%u bounces=%u scene=%016" PRIx64, golden->width, golden->height,
                 golden->samples, golden->bounces, golden->scene_hash);
    for (size_t i = 0; i < HASHED_COUNT; i++)
        text_appendf(text, " %s=%016" PRIx64, layer_names[hashed_layers[i]], golden->hashes[i]);
    text_appendf(text, " tiles=");
    for (size_t i = 0; i < TILES; i++)
        text_appendf(text, "%04x", golden->tiles[i]);
    text_appendf(text, " %s", golden->scene);
}

// Reads a line, which ends with a NUL. Returns false if it is not exactly as golden_append writes it.
static bool golden_read(GoldenLine *golden, const char *line)
{
    static const char tiles[] = " tiles=";
    int end = 0;
    // NOLINTBEGIN(cert-err34-c): the comparison with the written line finds what sscanf misreads
    if (sscanf(line, "size=%9ux%9u samples=%9u bounces=%9u scene=%16" SCNx64 "%n", &golden->width,
               &golden->height, &golden->samples, &golden->bounces, &golden->scene_hash, &end) < 5)
        return false;
    const char *at = line + end;
    for (size_t i = 0; i < HASHED_COUNT; i++, at += end)
        if (sscanf(at, " %*[a-z]=%16" SCNx64 "%n", &golden->hashes[i], &end) < 1) return false;
    if (strncmp(at, tiles, strlen(tiles)) != 0) return false;
    at += strlen(tiles);
    for (size_t i = 0; i < TILES; i++, at += end)
        if (sscanf(at, "%4" SCNx16 "%n", &golden->tiles[i], &end) < 1) return false;
    // NOLINTEND(cert-err34-c)
    OwnedText written = {0};
    golden->scene = memory_copy_text(*at == ' ' ? at + 1 : "");
    golden_append(&written, golden);
    const bool is_sound = golden->scene[0] != '\0' && strcmp(text_c(&written), line) == 0 &&
                          golden->width > 0 && golden->width <= IMAGE_SIDE_MAX && golden->height > 0 &&
                          golden->height <= IMAGE_SIDE_MAX && golden->samples > 0 &&
                          golden->samples <= SAMPLES_MAX && golden->bounces <= BOUNCES_MAX;
    if (is_sound) return true;
    free(golden->scene);
    golden->scene = NULL;
    return false;
}

// Adds a line of the file, which ends with a NUL. Returns what is wrong with it, or NULL. The caller frees
// the text.
static char *line_add(GoldenFile *file, const char *line)
{
    GoldenLine golden = {0};
    if (*line == '#') {
        if (strcmp(line, file_head[0]) != 0 && strcmp(line, file_head[1]) != 0)
            text_appendf(&file->comments, "%s\n", line);
    } else if (golden_read(&golden, line) && golden_file_find(file, golden.scene)) {
        char *fault = text_format("a second line for \"%s\"", golden.scene);
        free(golden.scene);
        return fault;
    } else if (golden.scene) {
        array_push(*file, golden);
    } else if (*line != '\0') {
        return text_format("expected a line of glint golden write");
    }
    return NULL;
}

bool golden_file_read(GoldenFile *file, const char *path, MessageList *messages)
{
    OwnedText text = {0};
    if (!text_read_file(&text, path, messages)) return false;
    const Source source = {path, text_c(&text), text.count};
    bool is_sound = true;
    for (size_t start = 0, end; start < text.count; start = end + 1) {
        const char *newline = memchr(text.items + start, '\n', text.count - start);
        end = newline ? (size_t)(newline - text.items) : text.count;
        const size_t length = end - start - (end > start && text.items[end - 1] == '\r');
        OWNED char *line = memory_copy_part(text.items + start, length);
        OWNED char *fault =
            strlen(line) < length ? text_format("the line has a NUL character") : line_add(file, line);
        if (fault) message_add_at(messages, MESSAGE_ERROR, &source, start, "%s", fault);
        is_sound = is_sound && !fault;
    }
    return is_sound;
}

bool golden_file_write(const GoldenFile *file, const char *path, MessageList *messages)
{
    OwnedText text = {0};
    text_appendf(&text, "%s\n%s\n%s", file_head[0], file_head[1], text_c(&file->comments));
    for (size_t i = 0; i < file->count; i++) {
        golden_append(&text, &file->items[i]);
        text_append(&text, "\n", 1);
    }
    return output_write_file(path, text.items, text.count, messages);
}
