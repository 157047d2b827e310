// What the host knows of each shape: one row per shape, in one file of shapes/.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/compile/flatten.h"
#include "host/compile/random_shape.h"

typedef struct {
    Vector3 center;
    double radius; // infinite around what is unbounded
} BoundingSphere;

enum { SHAPE_OPS_FORMS = 4 };

// An Object is the scene's, in double and in world coordinates; a primitive is the flat struct of
// kernels/types.h, relative to the eye. A mesh is an object alone: its primitives are triangles.
typedef struct {
    int type; // TYPE_… of its primitives
    // Offsets in Object, up to the first 0: of positions and other vectors (axes, normals); of lengths.
    size_t vectors[7], lengths[3];
    // Restores what transforms of its vectors break; NULL: nothing.
    void (*restore)(Object *object);
    // False where it is unbounded, and *bounds stays.
    bool (*bounds)(const Scene *scene, const Object *object, Bounds *bounds);
    // Adds the primitive that `part` says (host/compile/flatten.h).
    void (*flatten)(Flattening *flattening, const Object *object);

    // What a random one can be, up to the first NULL.
    const char *forms[SHAPE_OPS_FORMS];
    // Sets made->object's shape to a random one of a form, of about made->radius around made->center, along
    // made->axis if it has an axis or normal; and the radius and the axis where it has others.
    void (*randomize)(RandomShape *made, unsigned form, Random *random);

    // As `bounds`; NULL: always unbounded.
    bool (*primitive_bounds)(const void *primitive, Bounds *bounds);
    // NULL: the bounding sphere of primitive_bounds.
    BoundingSphere (*bounding_sphere)(const void *primitive);
    // A point and the normal, not unit, of a flat primitive; NULL: not flat.
    void (*plane)(const void *primitive, Vector3 *point, Vector3 *normal);
    // The largest magnitude of an unbounded primitive's numbers, as distances from the origin.
    double (*largest_coordinate)(const void *primitive);
} ShapeOps;

// By ShapeType, whose values but SHAPE_MESH are those of TYPE_….
extern const ShapeOps *const shape_ops[SHAPE_COUNT];

// The bounds of a primitive; false where it is unbounded.
bool primitive_bounds(size_t type, const void *primitive, Bounds *bounds);
BoundingSphere primitive_bounding_sphere(size_t type, const void *primitive);

// The sphere around a box, larger by a bound on the rounding errors here and in the box far from the eye.
BoundingSphere box_bounding_sphere(const Bounds *box);
