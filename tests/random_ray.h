// Random rays at random objects.
#pragma once

#include "host/compile/random_shape.h"

typedef struct {
    Vector3 origin, direction;
} RandomRay;

// A point of the cube from -half to half.
Vector3 random_cube_point(Random *random, double half);

// A scene of these objects, all of one material, which is set. Nothing to free.
Scene scene_of_shapes(Object *objects, size_t count, Material *material);

// Aimed at the shape and slightly past it from 1.001 to 10^4 times its radius; from inside; along the world's
// axes with zeros of either sign; along its own axis; at its outline. At a torus also from inside its tube,
// from within its hole, or where a spindle torus' tube overlaps itself, and in the plane of its circle.
RandomRay random_ray(const RandomShape *shape, Random *random);
