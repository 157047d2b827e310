// Bounds the errors of reflected and refracted rays, at `certified` (docs/numerics.md).
#ifndef CERTAIN_BOUNCE_H
#define CERTAIN_BOUNCE_H

#include "shading/bounce.h"

// The largest error of a bounced ray's direction with which the ray is still traced. With a larger one its
// hit is seldom certain. With a BVH the few rays of a packet that get this far take as long as a full packet,
// which costs more than re-rendering pixels without need.
#define BOUNCE_ERROR_MAX ((real)(HAS_BVH && !IS_DOUBLE ? 0x1p-9f : 0x1p-6f))
// A vector that is off by e of its length is off by at most e / (1 - e) as a unit vector, which for e up to
// 2^-6 is below this times e.
#define UNIT_VECTOR_ERROR ((real)(1.02f))
// The relative rounding error of a bounced ray's direction and of its terms.
#define BOUNCE_ROUNDING ((real)(32 * UNIT_ROUNDOFF))

static inline void bounce_set_chord(Bounce *bounce, const Chord *chord, mask inside)
{
    bounce->certain.chord_turn = lanes_select(inside, chord->turn, NEVER);
    bounce->certain.chord_end_position = lanes_select(inside, chord->end_position, NEVER);
    real error = real_min(bounce->certain.direction_error, chord->direction_error);
    real_replace(&bounce->certain.direction_error, inside, error);
}

// The incidence of a ray on a surface.
typedef struct {
    mask found;
    real turn;                // the error of its direction
    real cosine, angle_error; // the cosine of the angle of incidence, and the angle's error
} Incidence;

static inline Incidence surface_incidence(const Surface *surface, const Ray *ray)
{
    real turn = ray->direction_error + BOUNCE_ROUNDING, normal_error = surface->normal_error;
    return (Incidence){surface_found(surface) & ray->active, turn,
                       fabs(vector_dot(ray->direction, surface->shading_normal)),
                       real_fma(turn, normal_error, turn + normal_error)};
}

// Sets the error of a reflected ray. d - 2 (d . N) N is off by the error of d and twice that of N. Returns
// the uncertain lanes.
static inline mask reflected_set_error(const Surface *surface, const Ray *ray, const Incidence *incidence,
                                       Bounce *reflected)
{
    const real normal_error = surface->normal_error;
    real error = real_fma((real)(2), normal_error, incidence->turn);
    reflected->certain.direction_error = error;
    if (HAS_CHORDS) {
        const ChordEnd *end = &surface->chord_end;
        Chord chord = chord_start(end, surface->position_error, incidence->cosine,
                                  real_fma((real)(3), end->normal, BOUNCE_ROUNDING),
                                  incidence->angle_error + end->normal + BOUNCE_ROUNDING);
        bounce_set_chord(reflected, &chord, !surface->entering);
    }
    mask reflects = incidence->found & bounce_is_active(reflected);
    mask uncertain = reflects & !(reflected->certain.direction_error <= BOUNCE_ERROR_MAX);
    if (!HAS_TRIANGLES) return uncertain;
    // the shading normal's reflection may run through the surface
    Vector by_shading = vector_reflect(ray->direction, surface->shading_normal);
    real outward = fabs(vector_dot(by_shading, surface->normal));
    return uncertain | (reflects & (outward <= error + normal_error));
}

// The terms of vector_refract: n d + N (s - sqrt(s^2 - k)) with s = n cos. On entering, n counts as 1 and k
// as -k.
typedef struct {
    real scale; // n
    real s, s_error;
    real root, least_root; // the square root, 0 in total reflection; a lower bound of the exact one, or 1
    real squares;          // bounds s^2 and k
    mask uncertain;        // where total reflection is uncertain
} Snell;

static inline Snell surface_snell(const Surface *surface, const Incidence *incidence, real angle_error)
{
    const real zero = (real)(0), one = (real)(1);
    Snell snell;
    snell.scale = lanes_select(surface->entering, one, surface->ior);
    snell.s = snell.scale * incidence->cosine;
    real sine =
        real_sqrt(real_max(real_fma(-incidence->cosine, incidence->cosine, one), zero) + BOUNCE_ROUNDING);
    snell.s_error = snell.scale * (angle_error * (sine + angle_error) + BOUNCE_ROUNDING);
    real k = lanes_select(surface->entering, one - surface->ior, surface->ior - one) * (surface->ior + one);
    snell.squares = real_fma(snell.s, snell.s, surface->ior * surface->ior);
    real error = snell.s_error * (snell.s + snell.s + snell.s_error) + BOUNCE_ROUNDING * snell.squares;
    real squared = real_fma(snell.s, snell.s, -k), least_squared = squared - error;
    snell.root = real_sqrt(real_max(squared, zero));
    snell.least_root = real_sqrt(lanes_select(least_squared > zero, least_squared, one));
    snell.uncertain = !(fabs(squared) > error);
    return snell;
}

// Sets the errors of a refracted ray that runs along a chord, or leaves a sphere after one. `computed` is the
// error of computing it.
static inline void refracted_set_chord(const Surface *surface, const Snell *snell, real angle_error,
                                       real computed, Bounce *refracted)
{
    const ChordEnd *end = &surface->chord_end;
    real inverse_ior = real_divide((real)(1), surface->ior);
    Chord chord = chord_start(end, surface->position_error, snell->root * inverse_ior, NEVER,
                              real_fma(angle_error, inverse_ior, computed + end->normal));
    bounce_set_chord(refracted, &chord, surface->entering & (surface->ior >= 1));
    // the steepness in the plane of incidence; across it this is n, which is more where n < 1
    real steepest = real_max(real_divide(snell->s + snell->s_error, snell->least_root), snell->scale);
    real turned = real_fma(steepest, end->turn + end->normal, end->normal);
    real leaving = computed + (divide_or(end->position, end->radius, NEVER) + turned);
    refracted->certain.direction_error = lanes_select(surface->entering, refracted->certain.direction_error,
                                                      real_min(leaving, refracted->certain.direction_error));
}

// Sets the error of a refracted ray. n d + N (s - sqrt(s^2 - k)) is off by the errors of d and N and by the
// change of the difference with s. Returns the uncertain lanes.
static inline mask refracted_set_error(const Surface *surface, const Incidence *incidence, mask total,
                                       Bounce *refracted)
{
    const real one = (real)(1), normal_error = surface->normal_error;
    mask transparent = incidence->found & surface_is_transparent(surface), refracts = transparent & !total;
    real angle_error = incidence->angle_error;
    if (HAS_CHORDS)
        angle_error =
            real_min(angle_error, surface->chord_end.turn + surface->chord_end.normal + BOUNCE_ROUNDING);
    const Snell snell = surface_snell(surface, incidence, angle_error);
    // s - sqrt(s^2 - k) changes most where s is least
    real least = real_max(snell.s - snell.s_error, (real)(0));
    real change = real_divide(real_max(fabs(least - snell.least_root), snell.root - least), snell.least_root);
    // the vector's length is n on entering, 1 on leaving
    real inverse_length = real_divide(UNIT_VECTOR_ERROR, lanes_select(surface->entering, surface->ior, one));
    real roundings = snell.scale + snell.s + snell.root + real_divide(snell.squares, snell.least_root);
    real computed = real_fma(BOUNCE_ROUNDING * roundings, inverse_length, BOUNCE_ROUNDING);
    real error =
        snell.scale * incidence->turn + fabs(snell.s - snell.root) * normal_error + change * snell.s_error;
    refracted->certain.direction_error = real_fma(error, inverse_length, computed);
    if (HAS_CHORDS) refracted_set_chord(surface, &snell, angle_error, computed, refracted);
    mask uncertain = transparent & snell.uncertain;
    uncertain = uncertain | (refracts & !(refracted->certain.direction_error <= BOUNCE_ERROR_MAX));
    if (!HAS_TRIANGLES) return uncertain;
    real inward = fabs(vector_dot(refracted->direction, surface->normal));
    return uncertain | (refracts & (inward <= refracted->certain.direction_error + normal_error));
}

// Sets the bounds of a surface's bounces. Uncertain lanes are not traced further.
static inline void bounces_set_errors(const Surface *surface, const Ray *ray, Bounces *bounces,
                                      mask *uncertain)
{
    Bounce *reflected = &bounces->reflected, *refracted = &bounces->refracted;
    const Color3 none = color_gray((real)(0));
    const Incidence incidence = surface_incidence(surface, ray);
    reflected->certain.origin_error = surface->line_error;
    reflected->certain.start_error = surface->start_error;
    refracted->certain.origin_error = surface->position_error;
    refracted->certain.start_error = (real)(0);
    reflected->certain.origin_object = refracted->certain.origin_object = surface->object;
    reflected->certain.leaves_outward = surface->entering;
    refracted->certain.leaves_outward = !surface->entering;
    refracted->certain.direction_error = (real)(0);
    *uncertain = *uncertain | reflected_set_error(surface, ray, &incidence, reflected);
    if (HAS_TRANSMISSION)
        *uncertain = *uncertain | refracted_set_error(surface, &incidence, bounces->total, refracted);
    vector_replace(&reflected->weight, *uncertain, none);
    vector_replace(&refracted->weight, *uncertain, none);
}

#endif
