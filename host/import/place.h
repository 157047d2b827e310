// Finds the files of a scene and the lines that define its objects.
#pragma once

#include "host/base/array.h"
#include "host/base/message.h"
#include "host/scene/scene.h"

typedef ARRAY_OF(size_t) Offsets; // ascending

typedef struct {
    Offsets line_starts;
    Offsets file_starts, file_lines; // the start of each file, and the index of its first line
    size_t end;                      // past the last file
    size_t object_count;             // of the objects whose lines are stored
} Places;

// Finds the lines of a source and of the sources after it, up to `end`, which may be NULL.
Places places_open(const Source *source, const Source *end);
void places_close(Places *places);
// Stores the file and line of an offset in all objects added since the last call. The line is 0 if the
// offset is beyond the sources. Offsets may decrease, because an alias leads back to its target.
void places_record(Places *places, Scene *scene, size_t offset);
