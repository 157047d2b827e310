// The lines of a scene's file that objects come from.
#pragma once

#include "host/base/message.h"
#include "host/scene/scene.h"

typedef struct {
    struct {
        size_t *items; // the offset of each line after the first
        size_t count, capacity;
    } line_starts;
    size_t object_count; // of the objects that have their lines
    size_t source_length;
} Places;

Places places_open(const Source *source);
void places_close(Places *places);
// Sets the line of an offset, or 0 if it is beyond the source, in all objects that were added since the last
// call. Offsets may come in any order, because an alias leads back to its target.
void places_note(Places *places, Scene *scene, size_t offset);
