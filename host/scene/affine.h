// Affine transforms of points, directions and normals.
#pragma once

#include "host/scene/vector.h"
#include <stdbool.h>

// The first three rows of a 4x4 matrix, whose last column is the translation.
typedef struct {
    double rows[3][4];
} Affine;

extern const Affine affine_identity;

// Returns the transform that applies `b`, then `a`.
Affine affine_multiply(const Affine *a, const Affine *b);
// Scales, then rotates about x, y and z in this order by degrees, then translates.
Affine affine_of_steps(Vector3 scale, Vector3 rotate, Vector3 translate);
// Rotates by degrees, counterclockwise if the axis points to the viewer. The axis must not be zero.
Affine affine_about(Vector3 axis, double degrees);
Vector3 affine_point(const Affine *affine, Vector3 p);
Vector3 affine_direction(const Affine *affine, Vector3 v);
double affine_determinant(const Affine *affine);
// Transforms a triangle's vertices and its normals. The normals become unit vectors, or stay zero if they are
// zero. If the transform mirrors, exchanges the corners b and c to keep the outer side.
void affine_triangle(const Affine *affine, Vector3 vertices[3], Vector3 normals[3]);
// Returns the transform for normals, which is the transposed inverse times |determinant|.
Affine affine_for_normals(const Affine *affine);
// Transforms a normal by the result of affine_for_normals. Returns a unit vector, or zero if the normal is
// zero.
Vector3 affine_normal(const Affine *for_normals, Vector3 normal);

// The scale of a transform across an axis, and the vector that the unit axis becomes.
typedef struct {
    double across;
    Vector3 along;
} AxisScale;

// Returns true if a circle about the axis stays a circle, within a millionth of its radius, and false
// otherwise. With `is_straight` the axis must also stay perpendicular to the circle. Sets *scale in
// either case.
bool affine_keeps_circles(const Affine *affine, Vector3 axis, bool is_straight, AxisScale *scale);
// Returns true if all lengths change by the same factor, within a millionth. Sets *scale, for the y
// axis, in either case.
bool affine_keeps_balls(const Affine *affine, AxisScale *scale);
