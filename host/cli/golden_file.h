// Reads and writes the file of glint golden, which has one line of hashes per scene.
#pragma once

#include "host/base/array.h"
#include "host/base/text.h"
#include "host/image/image.h"
#include "host/render/film.h"

enum { TILE_COLUMNS = 12, TILE_ROWS = 8, TILES = TILE_COLUMNS * TILE_ROWS };
enum { HASHED_COUNT = 6 };

// The hashed layers in the order in which an image is computed. The first layer that differs explains the
// others.
extern const Layer hashed_layers[HASHED_COUNT];

typedef struct {
    char *scene;
    uint32_t width, height, samples, bounces;
    uint64_t scene_hash, hashes[HASHED_COUNT];
    uint16_t tiles[TILES];
    Transfer transfer; // of the colors of a scene that was rendered; it is not in the file
} GoldenLine;

typedef struct {
    ARRAY_OF(GoldenLine);
    Text comments; // written by the user
} GoldenFile;

// Reads a file into a zeroed GoldenFile. Returns false with messages if it cannot be read or a line is
// invalid. golden_file_free frees what was read in either case.
bool golden_file_read(GoldenFile *file, const char *path, MessageList *messages);
// Returns false with a message if the file cannot be written.
bool golden_file_write(const GoldenFile *file, const char *path, MessageList *messages);
// Returns the scene's line, or NULL if there is none.
GoldenLine *golden_file_find(const GoldenFile *file, const char *scene);
void golden_file_free(GoldenFile *file);
