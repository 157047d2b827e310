// Solves a t^2 + 2 b t + c = 0, whose discriminant d = b^2 - a c is known by a better formula.
#ifndef QUADRATIC_H
#define QUADRATIC_H

#include "shapes/interval.h"
#include "traversal/ray.h"

// Returns q = -(b + sign(b) sqrt d), without cancellation, by which the roots are c / q and q / a (Press et
// al., Numerical Recipes, 5.6; here with half of b). d < 0 counts as 0.
static inline real quadratic_q(real b, real d)
{
    const real root = real_sqrt(real_max(d, (real)(0)));
    return lanes_select(b < 0, root - b, -(root + b));
}

// Returns, for a = ray->squared, the first root beyond the ray's start, or the far one if only_far. From
// outside the first root is c / q, and q / a is computed only if a lane needs it.
static inline real quadratic_first_root(const Ray *ray, real b, real c, real d, bool only_far)
{
    const real q = quadratic_q(b, d);
    mask ahead = b < 0, zero = q == 0; // zero: b = d = 0, so both roots are 0
    real t = lanes_select(zero, (real)(0), real_divide(c, lanes_select(zero, (real)(1), q)));
    // c / q is the nearer root if ahead, else the farther one
    mask other = lanes_select(ahead, !(t > ray->tmin), ray->tmin < 0);
    if (only_far) other = ahead;
    if (lanes_any(other)) {
        real q_over_a = IS_COMPENSATED ? real_divide(q, ray->squared) : q * ray->inverse_squared;
        t = lanes_select(other & (ahead | (q_over_a > ray->tmin)), q_over_a, t);
    }
    return t;
}

typedef struct {
    real c_over_q, q_over_a;
} QuadraticRoots;

// Returns both roots. q / a beyond the range of numbers, as for a = 0, is infinite with its sign. With q = 0
// both roots are q / a. A huge c / q stays a root, because q / a may be far from it.
static inline QuadraticRoots quadratic_roots(real a, real b, real c, real d)
{
    const real q = quadratic_q(b, d);
    const mask zero = q == 0, positive = (q > 0) == (a >= 0);
    const real q_over_a = divide_or(q, a, lanes_select(positive, (real)(LARGEST), (real)(-LARGEST)));
    const real c_over_q = real_divide(c, lanes_select(zero, (real)(1), q));
    return (QuadraticRoots){lanes_select(zero, q_over_a, c_over_q), q_over_a};
}

static inline Interval quadratic_interval(QuadraticRoots roots)
{
    return (Interval){real_min(roots.c_over_q, roots.q_over_a), real_max(roots.c_over_q, roots.q_over_a)};
}

// Returns where a ray is inside the nappe of a cone of which the quadratic is the side, or inside another
// round side, between the roots. With a < 0 the ray enters or leaves the nappe once, by the sign of the
// `growth` of its radius along the ray. The other root belongs to the other nappe.
static inline Interval quadratic_inside(QuadraticRoots roots, real a, real growth)
{
    const Interval side = quadratic_interval(roots);
    const mask enters = growth > 0, once = a < 0;
    return (Interval){lanes_select(once, lanes_select(enters, side.far, (real)(-LARGEST)), side.near),
                      lanes_select(once, lanes_select(enters, (real)(LARGEST), side.near), side.far)};
}

#endif
