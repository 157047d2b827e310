// Roots of a t^2 + 2 b t + c = 0 where the discriminant d = b^2 - a c is known by a better formula.
#ifndef QUADRATIC_H
#define QUADRATIC_H

#include "ray.h"

typedef struct {
    real near, far; // near <= far
} Roots;

// Without cancellation: q = -(b + sign(b) sqrt d), roots c / q and q / a (Press et al., Numerical
// Recipes, 5.6; here with half of b). For a > 0; d < 0 counts as 0.
static inline Roots quadratic_roots(real a, real b, real c, real d)
{
    real root = real_sqrt(real_max(d, (real)(0)));
    mask ahead = b < (real)(0);
    real q = lanes_select(ahead, root - b, -(root + b));
    mask zero = q == (real)(0); // b = d = 0: both roots are 0
    real c_over_q = lanes_select(zero, (real)(0), real_divide(c, lanes_select(zero, (real)(1), q)));
    real q_over_a = real_divide(q, a);
    return (Roots){lanes_select(ahead, c_over_q, q_over_a), lanes_select(ahead, q_over_a, c_over_q)};
}

#endif
