// Bounds rays inside a sphere, at `certified`. A ray that is reflected there runs along chords of one great
// circle, all with the same angle of incidence, so that errors grow by addition. Bounds of position and
// direction alone, which are correlated, would multiply with every chord. docs/numerics.md has the
// derivation.
//
// Rotate the computed path about the center so that it starts at the exact path's point. That moves no point
// by more than `position`. The remainder is an angle of at most `turn` between the first chords. It moves the
// points at their ends by at most twice the radius times the angle.
#ifndef CHORDS_H
#define CHORDS_H

#include "shapes/sphere.h"

// The bounds at a point of a sphere.
typedef struct {
    real radius; // 0 if there is no sphere, or the ray is too near to its tangent
    real off;    // divided by the cosine of incidence, the largest distance to the sphere along the ray
    real normal; // error of the normal, for the point where the computed ray hits the sphere
    real position, turn; // bounds of the chord that ends there; NEVER if none does
} ChordEnd;

// The bounds of the chord that a ray starts, or NEVER if it does not start one.
typedef struct {
    real turn, end_position; // end_position bounds the point where it ends, except for errors computed there
    real direction_error;
} Chord;

static inline ChordEnd chord_end_none(void)
{
    return (ChordEnd){(real)(0), (real)(0), (real)(0), NEVER, NEVER};
}

// Above this share of the radius times the cosine of incidence a ray is too near to the sphere's tangent.
#define CHORD_MOVE_MAX ((real)(0x1p-4f))
// With c the cosine of incidence, a point whose distance from a sphere of radius r is e has the sphere at s
// along the ray, with s (2 c r - s) <= e (2 r + e). With s <= c r / 16, hence e <= r / 16, s is at most e / c
// times (1 + 1/32) / (1 - 1/32), and its angle at the center is s / r times 1 + 1/32. The product of the
// factors is 1.1, and a cosine that decides is within 2 %.
#define CHORD_OFF_FACTOR ((real)(1.125f))
// The largest error of a chord's direction to which the bounds apply. There an angle exceeds its sine by less
// than 0.0001 of it, and the sine's square moves by no more.
#define CHORD_TURN_MAX ((real)(0x1p-6f))

// Returns the bounds where rays hit a sphere at `point`, in `lanes`.
static inline ChordEnd chord_end(const Sphere *sphere, const Ray *ray, const Hit *hit, Vector point,
                                 mask lanes)
{
    Vector center = vector_of(sphere->center_radius), f = vector_subtract(point, center);
    real radius = (real)(sphere->center_radius.w), distance = vector_norm(f), center1 = vector_norm1(center);
    real inverse = real_divide((real)(1), radius);
    real rounding = vector_norm1(ray->origin) + vector_norm1(ray->direction) * fabs(hit->t);
    ChordEnd end = chord_end_none();
    end.off = CHORD_OFF_FACTOR * (fabs(radius - distance) +
                                  UNIT_ROUNDOFF * (12 * distance + 4 * radius + 2 * center1 + 6 * rounding));
    real cosine = fabs(vector_dot(f, ray->direction)) * inverse * ray_inverse_length(ray);
    real moved = divide_or(end.off, cosine, NEVER);
    end.normal = inverse * (moved + UNIT_ROUNDOFF * (4 * center1 + 2 * rounding)) + DIRECTION_ROUNDING;
    mask usable = lanes & (moved <= CHORD_MOVE_MAX * cosine * radius);
    end.radius = lanes_select(usable, radius, (real)(0));
    mask continues = usable & (hit->object == ray->origin_object) & (ray->chord_turn < NEVER);
    end.position = lanes_select(continues, ray->chord_end_position + moved, NEVER);
    end.turn = lanes_select(continues, ray->chord_turn, NEVER);
    return end;
}

static inline ChordEnd chord_end_select(mask condition, ChordEnd yes, ChordEnd no)
{
    return (ChordEnd){
        lanes_select(condition, yes.radius, no.radius), lanes_select(condition, yes.off, no.off),
        lanes_select(condition, yes.normal, no.normal), lanes_select(condition, yes.position, no.position),
        lanes_select(condition, yes.turn, no.turn)};
}

// asin(s) / s, to which an angle across the plane of incidence is unrolled, is convex in s squared, from 1 to
// pi / 2. So it is at most ARC_LEAST + ARC_RISE s^2, the latter being pi / 2 - 1, rounded up, and the former
// making up for CHORD_TURN_MAX.
#define ARC_LEAST ((real)(1.0001f))
#define ARC_RISE  ((real)(0.571f))

// Returns the chord that starts at `end`, for the cosine of the inner angle of incidence. Its direction is
// off, seen from the normal, by the end's turn and by `turned`, or by `turned_first` if no chord ended
// there.
static inline Chord chord_start(const ChordEnd *end, real position_error, real cosine, real turned,
                                real turned_first)
{
    real moved = divide_or(end->off, cosine, NEVER);
    mask continues = end->turn < NEVER;
    real sine_squared = real_min(1 + CHORD_TURN_MAX - cosine * cosine, (real)(1));
    real unrolled = real_fma(ARC_RISE, sine_squared, ARC_LEAST);
    real inverse = real_divide((real)(1), lanes_select(end->radius > 0, end->radius, (real)(1)));
    real added = unrolled * (lanes_select(continues, turned, turned_first) + moved * inverse);
    real turn = lanes_select(continues, end->turn, (real)(0)) + added,
         position = lanes_select(continues, end->position, position_error) + moved;
    // roundings of these sums are below u of the radius; the ends' own bounds have more slack
    real end_position = real_fma(2 * end->radius, turn, position);
    mask usable =
        (end->radius > 0) & (moved <= CHORD_MOVE_MAX * cosine * end->radius) & (turn <= CHORD_TURN_MAX);
    return (Chord){lanes_select(usable, turn, NEVER), lanes_select(usable, end_position, NEVER),
                   lanes_select(usable, real_fma(position, inverse, turn), NEVER)};
}

#endif
