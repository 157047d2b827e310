// The files of a scene and the lines there that objects come from.
#pragma once

#include "host/base/message.h"
#include "host/scene/scene.h"

typedef struct {
    size_t *items; // ascending
    size_t count, capacity;
} Offsets;

typedef struct {
    Offsets line_starts;
    Offsets file_starts, file_lines; // and the index of each file's first line
    size_t end;                      // behind the last file
    size_t object_count;             // of the objects that have their lines
} Places;

// Finds the lines of a source and of those that follow it, up to `end`, which may be NULL.
Places places_open(const Source *source, const Source *end);
void places_close(Places *places);
// Sets the file and line of an offset, or the line 0 if it is beyond the sources, in all objects that were
// added since the last call. Offsets may come in any order, because an alias leads back to its target.
void places_note(Places *places, Scene *scene, size_t offset);
