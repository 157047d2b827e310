// Textbook: the roots of a t^2 + 2 b t + c = 0 by the school's formula.
#ifndef QUADRATIC_H
#define QUADRATIC_H

#include "surface_point.h"

// Secondary rays of a point of this size start 0.0001 off the surface, the books' constant.
#define TEXTBOOK_SIZE ((real)(1e-4f / (32 * UNIT_ROUNDOFF)))

typedef struct {
    real near, far; // near <= far for a > 0
} Roots;

static inline Roots quadratic_roots(real inverse_a, real b, real discriminant)
{
    real root = sqrt(discriminant);
    return (Roots){(-b - root) * inverse_a, (-b + root) * inverse_a};
}

#endif
