// Intersects shapes next to the eye. A power, which the host computes before anything is rounded, defines
// where the surface lies. For a sphere it is |center - eye|^2 - radius^2, for other shapes the constant term
// of the equation for a ray from the eye.
#ifndef EYE_POWER_H
#define EYE_POWER_H

#include "traversal/ray.h"

static inline bool has_eye_power(uint4 id)
{
    return HAS_EYE_POWERS && (id.y & HAS_POWER);
}

static inline real eye_power_of(uint4 id)
{
#if IS_DOUBLE
    return (real)(as_double(upsample(id.w, id.z)));
#else
    return (real)(as_float(id.z));
#endif
}

// Returns start + a . b, rounded about once.
static inline real power_sum(Pair start, Vector a, PairVector b)
{
    Pair xx = two_product(a.x, b.x.high), yy = two_product(a.y, b.y.high), zz = two_product(a.z, b.z.high);
    Pair one = two_sum(xx.high, start.high), two = two_sum(one.high, yy.high),
         three = two_sum(two.high, zz.high);
    real of_low = real_fma(a.x, b.x.low, real_fma(a.y, b.y.low, a.z * b.z.low));
    real low = ((one.low + two.low) + three.low) + ((xx.low + yy.low) + (zz.low + start.low));
    return three.high + (of_low + low);
}

// Returns the power of a point with respect to a sphere, the eye's plus p . (p - 2 center). In it a
// rounding of the center counts only in proportion to the point's distance from the eye.
static inline real eye_power_at(uint4 id, Vector center, Vector point)
{
    return power_sum(pair_of(eye_power_of(id)), point,
                     pair_vector_difference(point, vector_scale(center, (real)(2))));
}

#endif
