// Transforms of objects.
#pragma once

#include "host/scene/affine.h"
#include "host/scene/scene.h"

// Transforms an object of the scene and, unless it is an instance, its mesh, which no other object may share.
// A box whose sides no longer lie along the axes becomes a mesh of 12 triangles, and a round shape becomes an
// oval if the result is no longer of its type. The transform must have an inverse. Returns NULL or, if the
// transform does not suit the shape, a clause whose subject is the shape; the object must then not be used.
//
// Checkers, and images on planes and discs, keep their places in the world. Images on spheres keep their
// poles along y.
const char *object_transform(Scene *scene, Object *object, const Affine *affine);
