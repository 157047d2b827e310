#pragma once

#include "host/scene/bounds.h"
#include "host/scene/scene.h"

// Returns the bounds of all bounded objects; *unbounded_count counts the rest (planes, infinite cylinders and
// cones).
Bounds scene_bounds(const Scene *scene, size_t *unbounded_count);
