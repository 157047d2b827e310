#pragma once

#include "host/scene/bounds.h"
#include "host/scene/scene.h"

// Returns the bounds of all bounded objects; *unbounded_count counts the rest (planes, infinite cylinders and
// cones).
Bounds scene_bounds(const Scene *scene, size_t *unbounded_count);

// The largest side of the smallest bounded object's box, a mesh being one; 0 if none has any size.
double scene_smallest_size(const Scene *scene);
