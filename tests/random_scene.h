// Random scenes of every shape, light and kind of material.
#pragma once

#include "host/compile/random_shape.h"

// The same for the same seed. At least 32 objects: the first are one of each form (shape_forms), and none is
// so large that it hides the rest. The materials are plain, mirror, glass and checkered.
Scene random_scene(uint64_t seed, size_t object_count);

// A point at a distance of least .. most from the origin, in a random direction.
Vector3 random_point(Random *random, double least, double most);
