// Makes random scenes of every shape, light and type of material.
#pragma once

#include "host/verify/random_shape.h"

// Returns a scene, the same for the same seed, of at least 32 objects. The first are one of each form
// (shape_forms), and none is so large that it hides the rest. The materials are plain, mirror, glass and
// checkered.
Scene random_scene(uint64_t seed, size_t object_count);

// Returns a point at a distance of least .. most from the origin, in a random direction.
Vector3 random_point(Random *random, double least, double most);
