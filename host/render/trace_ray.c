// Checks and scales explicit rays, and scales their hits back.
#include "host/render/trace.h"

#include <float.h>
#include <math.h>

// Returns value * 2^exponent, rounded once. ldexp takes several times as long as the product.
static double scale_by_power(double value, int exponent, double power)
{
    return isnormal(power) ? value * power : ldexp(value, exponent);
}

static double farthest_of(Precision precision)
{
    return precision < PRECISION_DOUBLE ? (double)FLT_MAX : DBL_MAX;
}

const char *trace_ray_why_not(const TraceRay *ray, Precision precision)
{
    if (!vector_is_within(ray->origin, DBL_MAX)) return "the origin is not finite";
    if (!vector_is_within(ray->origin, farthest_of(precision)))
        return "the origin is beyond the range of float; use precision double or certified";
    if (!vector_is_within(ray->direction, DBL_MAX)) return "the direction is not finite";
    if (!isfinite(ray->tmin)) return "tmin is not finite";
    if (isnan(ray->tmax)) return "tmax is not a number";
    if (vector_is_zero(ray->direction)) return "a ray's direction cannot be 0 0 0";
    return precision == PRECISION_CERTIFIED && ray->tmin != 0 ? "at certified, tmin must be 0" : NULL;
}

TraceRay trace_ray_scaled(TraceRay ray, Precision precision, int *exponent)
{
    frexp(vector_largest(ray.direction), exponent);
    const double power = ldexp(1, *exponent), inverse = ldexp(1, -*exponent);
    ray.direction = (Vector3){scale_by_power(ray.direction.x, -*exponent, inverse),
                              scale_by_power(ray.direction.y, -*exponent, inverse),
                              scale_by_power(ray.direction.z, -*exponent, inverse)};
    ray.tmin = scale_by_power(ray.tmin, *exponent, power);
    ray.tmax = fmin(scale_by_power(ray.tmax, *exponent, power), farthest_of(precision));
    return ray;
}

void trace_hit_unscale(TraceHit *hit, int exponent)
{
    const double power = ldexp(1, -exponent), inverse = ldexp(1, exponent);
    const double low = hit->low, high = hit->high;
    hit->t = scale_by_power(hit->t, -exponent, power);
    hit->low = scale_by_power(low, -exponent, power);
    hit->high = scale_by_power(high, -exponent, power);
    // where scaling is not exact, bounds are rounded outwards
    if (scale_by_power(hit->low, exponent, inverse) != low) hit->low = nextafter(hit->low, -INFINITY);
    if (scale_by_power(hit->high, exponent, inverse) != high) hit->high = nextafter(hit->high, INFINITY);
}
