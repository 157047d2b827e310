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
} Places;

Places places_open(const Source *source);
void places_close(Places *places);
// Gives the line of an offset to all objects that were added since the last call. The offsets may be in any
// order: an alias leads back to where its target stands.
void places_note(Places *places, Scene *scene, size_t offset);
