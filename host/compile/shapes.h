// The host's operations on each shape: one row per shape, in one file of shapes/.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/compile/flatten.h"

typedef struct {
    Vector3 center;
    double radius; // infinite for an unbounded one
} BoundingSphere;

// An Object is the scene's, in double and in world coordinates; a primitive is the flat struct of
// kernels/types.h, relative to the eye. A mesh is an object alone: its primitives are triangles.
typedef struct {
    // Returns the bounds of an object other than a mesh. NULL means always unbounded.
    Bounds (*bounds)(const Object *object);
    // Adds the primitive that flattening->part selects (host/compile/flatten.h).
    void (*flatten)(Flattening *flattening, const Object *object);

    // Returns the bounds of a primitive. NULL means those of bounding_sphere or, without one, always
    // unbounded.
    Bounds (*primitive_bounds)(const void *primitive);
    // Returns the bounding sphere. NULL means that of primitive_bounds.
    BoundingSphere (*bounding_sphere)(const void *primitive);
    // Sets a point and a normal of any length of a flat primitive. NULL means not flat.
    void (*plane)(const void *primitive, Vector3 *point, Vector3 *normal);
    // Returns the largest magnitude of an unbounded primitive's numbers, as distances from the origin.
    double (*largest_coordinate)(const void *primitive);
    // Returns the condition of a primitive, by which the kernel's rounding_scale grows beyond the sum of
    // seven of its coordinates (host/compile/contact.c). NULL means not beyond.
    double (*condition)(const void *primitive);
    // Returns the largest factor by which a map of the kernel stretches lengths, to coordinates in which the
    // shape has a size near 1 (host/compile/certified_range.c). NULL means that it maps nothing.
    double (*stretch)(const void *primitive);
} ShapeOps;

// Indexed by ShapeType, whose values except SHAPE_MESH are those of TYPE_….
extern const ShapeOps *const shape_ops[SHAPE_COUNT];

// Returns the TYPE_… of a shape's primitives.
static inline unsigned shape_primitive_type(ShapeType type)
{
    return type == SHAPE_MESH ? TYPE_TRIANGLES : (unsigned)type;
}

// Return the bounds of an object and of a primitive, bounds_everywhere() if it is unbounded.
Bounds object_bounds(const Scene *scene, const Object *object);
Bounds primitive_bounds(size_t type, const void *primitive);
BoundingSphere primitive_bounding_sphere(size_t type, const void *primitive);

// Returns the largest magnitude of a primitive's coordinates.
double primitive_reach(size_t type, const void *primitive);

// Returns the sphere around a box, enlarged by a bound on roundings here and in the box far from the eye.
BoundingSphere box_bounding_sphere(const Bounds *box);
