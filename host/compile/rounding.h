// The scene's numbers in the kernel's precision and relative to the eye.
#pragma once

#include "host/compile/compiled_scene.h"

typedef struct {
    Vector3 eye;
    bool is_double; // the kernel's precision is double: numbers stay
} Rounding;

double rounded(const Rounding *rounding, double value);
Vector3 vector_rounded(const Rounding *rounding, Vector3 v);
Vector3 point_from_eye(const Rounding *rounding, Vector3 point);

// The same direction, scaled by a power of two so that its largest component lies in 1/2..1: exact.
Vector3 axis_scaled(Vector3 axis);
// A plane's normal, not unit, and in w one over its length.
scalar4 normal_and_inverse_length(const Rounding *rounding, Vector3 normal);
