// Finds where a ray is inside the side of a cylinder, with bounds. Seen along the axis, the side is a circle
// and the ray a line.
#ifndef CERTAIN_CYLINDER_H
#define CERTAIN_CYLINDER_H

#include "shapes/certain_round.h"

// A ray seen along the axis, as closest + q (t - middle), and its errors.
typedef struct {
    Vector q;
    real squared_q;
    mask slanted;        // q is well above its error; in other lanes `middle` is 0
    real inverse_length; // 1 / |q| within 12 u, or 0
    Vector closest;      // the ray's point closest to the axis, seen from there
    real squared_distance, middle;
    real middle_error; // bounds the error of that point, which grows by round->error_per_t per t
} CylinderLine;

// Computes the closest point from a point next to it, so that it is off by u of their coordinates and q is
// across it within 6 u |q| |closest|.
static inline CylinderLine cylinder_line(const Round *round, const Ray *ray)
{
    CylinderLine line;
    // twice, since the axis' length, which is off by 14 u, leaves a part of the height
    line.q = round_across(round, round_across(round, ray->direction));
    line.squared_q = vector_dot(line.q, line.q);
    line.slanted =
        line.squared_q > real_fma(64 * round->error_per_t, round->error_per_t, (real)(SMALLEST_RATIO));
    const real inverse = real_divide((real)(1), lanes_select(line.slanted, line.squared_q, (real)(1))),
               inverse_squared = lanes_select(line.slanted, inverse, (real)(0));
    line.inverse_length = real_sqrt(inverse_squared);
    const real first = -vector_dot(round_across(round, round->start), line.q) * inverse_squared;
    const Vector x = vector_fma(ray->direction, first, round->start),
                 near = round_across(round, round_across(round, x));
    const real step = -vector_dot(near, line.q) * inverse_squared;
    line.closest = vector_fma(line.q, step, near);
    line.squared_distance = vector_dot(line.closest, line.closest);
    line.middle = first + step;
    const real terms =
        real_fma(round->direction_norm1, fabs(first), round->start_norm1) + round->radius + round->radius;
    const real in_u = real_fma((real)(3), terms, ROUND_ERROR * vector_norm1(x));
    line.middle_error =
        BOUND_SLACK * (ray_position_error(ray, ray->length * fabs(line.middle)) + round->shape_error) +
        UNIT_ROUNDOFF * in_u;
    return line;
}

// Returns half the chord of a circle around the axis, in t, or 0.
static inline real cylinder_half_chord(const CylinderLine *line, real radius)
{
    const real squared = real_fma(radius, radius, -line->squared_distance);
    return real_sqrt(real_max(squared, (real)(0))) * line->inverse_length;
}

// Bounds the error of the line's points up to this t from the middle.
static inline real cylinder_position_error(const Round *round, const CylinderLine *line, real span)
{
    return BOUND_SLACK * real_fma(round->error_per_t, span, line->middle_error);
}

// Returns the interval where the exact ray is inside the side. Only `part` matters. The line is inside the
// circle shrunk by all errors there, and outside it enlarged by them.
static inline CertainInterval cylinder_interval(const Round *round, const Ray *ray, mask lanes, Interval part)
{
    const real zero = (real)(0), u = (real)(UNIT_ROUNDOFF), radius = round->radius, end = ray_end_above(ray);
    const real more = (real)(1 + 32 * UNIT_ROUNDOFF), less = (real)(1 - 32 * UNIT_ROUNDOFF);
    const CylinderLine line = cylinder_line(round, ray);
    const real from = real_max(part.near, ray->tmin), to = real_min(part.far, end);
    const real reach = real_max(fabs(from), fabs(to)) + fabs(line.middle);
    // Beyond this span a slanted line is farther from the axis than 8/5 of the radius and its error.
    real span = 2 * (radius + line.middle_error) * line.inverse_length * more;
    span = cylinder_half_chord(&line, radius + cylinder_position_error(round, &line, real_min(span, reach))) *
           more;
    const real position_error =
        cylinder_position_error(round, &line, lanes_select(line.slanted, real_min(span, reach), reach));
    const real outer = radius + position_error, inner = real_max(radius - position_error, zero),
               squared = line.squared_distance;
    CertainInterval interval;
    interval.perhaps = lanes & !(line.slanted & (outer * outer < squared));
    interval.certain = interval.perhaps & line.slanted & (inner * inner > squared);
    const real along = u * real_fma(6 * outer, line.inverse_length * more, 3 * fabs(line.middle));
    const real outer_half = real_fma(more, cylinder_half_chord(&line, outer), along),
               inner_half = real_fma(less, cylinder_half_chord(&line, inner), -along),
               root_half = cylinder_half_chord(&line, radius);
    interval.outer = (Interval){line.middle - outer_half, line.middle + outer_half};
    interval.inner = (Interval){line.middle - inner_half, line.middle + inner_half};
    interval.roots = (Interval){line.middle - root_half, line.middle + root_half};
    const mask parallel = lanes & !line.slanted;
    if (RARELY(lanes_any(parallel))) { // the distance from the axis hardly changes
        const real distance = real_sqrt(squared), change = real_sqrt(line.squared_q) * reach * more;
        const mask stays_in = inner > distance * more + change;
        const mask stays_out = distance * less - change > outer;
        interval.perhaps = interval.perhaps & !(parallel & stays_out);
        interval.certain = interval.certain | (parallel & stays_in);
        const real largest = (real)(LARGEST);
        real_replace(&interval.outer.near, parallel, -largest);
        real_replace(&interval.outer.far, parallel, largest);
        real_replace(&interval.inner.near, parallel, part.near);
        real_replace(&interval.inner.far, parallel, part.far);
        real_replace(&interval.roots.near, parallel, -largest);
        real_replace(&interval.roots.far, parallel, largest);
    }
    // The bounds hold only between `from` and `to`. Where numbers overflow, nothing is known.
    interval.certain =
        interval.certain & (interval.inner.near < interval.inner.far) & (interval.inner.near <= to);
    interval.perhaps = interval.perhaps & !((interval.outer.far < from) | (interval.outer.near > to));
    return interval;
}

#endif
