// Solves a t^2 + 2 b t + c = 0, whose discriminant d = b^2 - a c is known by a better formula.
#ifndef QUADRATIC_H
#define QUADRATIC_H

#include "shapes/surface_point.h"

// Returns, for a = ray->squared, the first root beyond the ray's start, or the far one if only_far. It avoids
// cancellation: with q = -(b + sign(b) sqrt d) the roots are c / q and q / a (Press et al., Numerical
// Recipes, 5.6; here with half of b). d < 0 counts as 0. From outside the first root is c / q, and q / a is
// computed only if a lane needs it.
static inline real quadratic_first_root(const Ray *ray, real b, real c, real d, bool only_far)
{
    real root = real_sqrt(real_max(d, (real)(0)));
    mask ahead = b < (real)(0);
    real q = lanes_select(ahead, root - b, -(root + b));
    mask zero = q == (real)(0); // b = d = 0, so both roots are 0
    real t = lanes_select(zero, (real)(0), real_divide(c, lanes_select(zero, (real)(1), q)));
    // c / q is the nearer root if ahead, else the farther one
    mask other = lanes_select(ahead, !(t > ray->tmin), ray->tmin < (real)(0));
    if (only_far) other = ahead;
    if (lanes_any(other)) {
        real q_over_a = IS_COMPENSATED ? real_divide(q, ray->squared) : q * ray->inverse_squared;
        t = lanes_select(other & (ahead | (q_over_a > ray->tmin)), q_over_a, t);
    }
    return t;
}

#endif
