// Makes random rays at random objects.
#pragma once

#include "host/verify/random_shape.h"

typedef struct {
    Vector3 origin, direction;
} RandomRay;

// Returns a point of the cube from -half to half.
Vector3 random_cube_point(Random *random, double half);

// Returns a scene of these objects, all of one material, which is set. There is nothing to free.
Scene scene_of_shapes(Object *objects, size_t count, Material *material);

// Returns a ray that is aimed at the shape or slightly past it from 1.001 to 10^4 times its radius, from
// inside, along the world's axes with zeros of either sign, along the shape's axis, or at its outline. At a
// torus it may also start inside its tube, within its hole or where a spindle torus' tube overlaps itself, or
// lie in the plane of its circle.
RandomRay random_ray(const RandomShape *shape, Random *random);
