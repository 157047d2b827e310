// Transforms of objects.
#pragma once

#include "host/scene/affine.h"
#include "host/scene/scene.h"

// Transforms an object of the scene and, unless it is an instance, its mesh, which no other object may have.
// A box whose sides no longer lie along the axes becomes a mesh of 12 triangles, and a round shape that would
// no longer be one of its type an oval. The transform has an inverse. Returns NULL, or a clause whose subject
// is the shape if the transform does not suit it; the object is then not to be used.
//
// Checkers, and images on planes and discs, keep their places in the world. Images on spheres keep their
// poles along y.
const char *object_transform(Scene *scene, Object *object, const Affine *affine);
