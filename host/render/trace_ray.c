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

const char *trace_ray_fault(const TraceRay *ray, Precision precision)
{
    bool is_within = isfinite(ray->tmin) && !isnan(ray->tmax), has_direction = false;
    for (int axis = 0; axis < 3; axis++) {
        is_within &= fabs(ray->origin[axis]) <= farthest_of(precision) && isfinite(ray->direction[axis]);
        has_direction |= ray->direction[axis] != 0;
    }
    if (!is_within)
        return "a number is not finite or beyond the precision's range; only tmax may be infinite";
    if (!has_direction) return "a ray's direction cannot be 0 0 0";
    return precision == PRECISION_CERTIFIED && ray->tmin != 0 ? "at certified, tmin must be 0" : NULL;
}

TraceRay trace_ray_scaled(TraceRay ray, Precision precision, int *exponent)
{
    double *d = ray.direction;
    frexp(fmax(fmax(fabs(d[0]), fabs(d[1])), fabs(d[2])), exponent);
    const double power = ldexp(1, *exponent), inverse = ldexp(1, -*exponent);
    for (int axis = 0; axis < 3; axis++)
        d[axis] = scale_by_power(d[axis], -*exponent, inverse);
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
