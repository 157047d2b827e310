// Bounds a scene's objects.
#pragma once

#include "host/scene/bounds.h"
#include "host/scene/scene.h"

// Returns the bounds of all bounded objects. Sets *unbounded_count to the number of the others.
Bounds scene_bounds(const Scene *scene, size_t *unbounded_count);
