// Reflected and refracted rays (Whitted, An improved illumination model for shaded display,
// CACM 23(6), 1980), without recursion.
#ifndef BOUNCE_H
#define BOUNCE_H

#include "shading/surface.h"

// A ray to trace, and the weight of its color in the pixel. A weight of 0 is no ray.
typedef struct {
    Vector origin, direction; // unit
    Color3 weight;
    uint depth;
    real travelled; // distance from the eye along the path
    // at `certified`: as of a Ray
    real origin_error, direction_error;
    integer left;
    mask leaves_outward;
    real chord_turn, chord_end_place;
} Bounce;

static inline mask bounce_is_active(const Bounce *bounce)
{
    return (bounce->weight.x > (real)(0)) | (bounce->weight.y > (real)(0)) | (bounce->weight.z > (real)(0));
}

static inline Ray bounce_ray(const Bounce *bounce)
{
    Ray ray = ray_make_unit(bounce->origin, bounce->direction, bounce_is_active(bounce));
    ray.travelled = bounce->travelled;
    if (IS_CERTIFIED) {
        ray.origin_error = bounce->origin_error;
        ray.direction_error = bounce->direction_error;
        ray.left = bounce->left;
        ray.leaves_outward = bounce->leaves_outward;
        if (HAS_CHORDS) {
            ray.chord_turn = bounce->chord_turn;
            ray.chord_end_place = bounce->chord_end_place;
        }
    }
    return ray;
}

static inline Vector vector_reflect(Vector direction, Vector normal)
{
    real away = vector_dot(direction, normal);
    return vector_renormalize(vector_fma(normal, (real)(-2) * away, direction));
}

// Snell's law for a unit direction and a unit normal that faces it; returns the lanes of total internal
// reflection. With k = (n - 1)(n + 1) and the cosine c the ray into a body of index n runs along
// d + N (c - sqrt(c^2 + k)), the ray out of it along n d + N (n c - sqrt((n c)^2 - k)). In this form grazing
// rays survive where n is near 1, and n = 1 bends nothing however inexact a device's division is.
static inline mask vector_refract(Vector direction, Vector normal, mask entering, real ior, Vector *refracted)
{
    real scale = lanes_select(entering, (real)(1), ior);
    real above_one = lanes_select(entering, (real)(1) - ior, ior - (real)(1));
    real scaled = scale * -vector_dot(direction, normal);
    real squared = difference_of_products(scaled, scaled, above_one, ior + (real)(1));
    mask total = squared < (real)(0);
    real cosine = real_sqrt(real_max(squared, (real)(0)));
    *refracted = vector_normalize(vector_fma(normal, scaled - cosine, vector_scale(direction, scale)));
    return total;
}

// By the shading normal, or by the geometric one where that would send the ray through the surface.
static inline Vector surface_reflect(const Surface *surface, Vector direction)
{
    Vector reflected = vector_reflect(direction, surface->shading_normal);
    if (!HAS_TRIANGLES) return reflected;
    mask inward = vector_dot(reflected, surface->normal) <= (real)(0);
    return vector_select(inward, vector_reflect(direction, surface->normal), reflected);
}

// Likewise; returns the lanes of total internal reflection.
static inline mask surface_refract(const Surface *surface, Vector direction, Vector *refracted)
{
    mask total =
        vector_refract(direction, surface->shading_normal, surface->entering, surface->ior, refracted);
    if (!HAS_TRIANGLES) return total;
    mask outward = !total & (vector_dot(*refracted, surface->normal) >= (real)(0));
    if (!lanes_any(outward)) return total;
    Vector plain;
    mask plain_total = vector_refract(direction, surface->normal, surface->entering, surface->ior, &plain);
    *refracted = vector_select(outward, plain, *refracted);
    return lanes_select(outward, plain_total, total);
}

// The largest error of a bounced ray's direction that is still traced.
#define BOUNCE_ERROR_MAX ((real)(0x1p-6f))

static inline void bounce_set_chord(Bounce *bounce, const Chord *chord, mask inside)
{
    bounce->chord_turn = lanes_select(inside, chord->turn, NEVER);
    bounce->chord_end_place = lanes_select(inside, chord->end_place, NEVER);
    real error = real_min(bounce->direction_error, chord->direction_error);
    bounce->direction_error = lanes_select(inside, error, bounce->direction_error);
}

// The bounds of a surface's reflected and refracted ray. d - 2 (d . N) N is off by the error of d and twice
// that of N; the refracted ray's, n d + N (s - sqrt(s^2 - k)), by those of d and N and by what the difference
// changes with s. Lanes in doubt are not traced further.
static inline void bounces_set_errors(const Surface *surface, const Ray *ray, mask total, Bounce *reflected,
                                      Bounce *refracted, mask *doubt)
{
    const real zero = (real)(0), one = (real)(1), rounding = (real)(32 * UNIT_ROUNDOFF);
    const ChordEnd *end = &surface->chord_end;
    real normal_error = surface->normal_error, turn = ray->direction_error + rounding;
    // of the angle of incidence
    real angle_error = real_fma(turn, normal_error, turn + normal_error);
    real cosine = fabs(vector_dot(ray->direction, surface->shading_normal));
    mask found = surface->found & ray->active, open = mask_none();
    real reflected_error = real_fma((real)(2), normal_error, turn);
    reflected->origin_error = refracted->origin_error = surface->place_error;
    reflected->left = refracted->left = surface->object;
    reflected->direction_error = reflected_error;
    reflected->leaves_outward = surface->entering;
    refracted->leaves_outward = !surface->entering;
    if (HAS_CHORDS) {
        Chord chord =
            chord_start(end, surface->place_error, cosine, real_fma((real)(3), end->normal, rounding),
                        angle_error + end->normal + rounding);
        bounce_set_chord(reflected, &chord, !surface->entering);
        angle_error = real_min(angle_error, end->turn + end->normal + rounding);
    }
    mask reflects = found & bounce_is_active(reflected);
    open = reflects & !(reflected->direction_error <= BOUNCE_ERROR_MAX);
    if (HAS_TRIANGLES) {
        // the shading normal's reflection may run through the surface
        Vector by_shading = vector_reflect(ray->direction, surface->shading_normal);
        real outward = fabs(vector_dot(by_shading, surface->normal));
        open = open | (reflects & (outward <= reflected_error + normal_error));
    }
    if (HAS_TRANSMISSION) {
        mask transparent = found & (surface->transmission > zero);
        real scale = lanes_select(surface->entering, one, surface->ior), scaled = scale * cosine;
        real sine = real_sqrt(real_max(real_fma(-cosine, cosine, one), zero) + rounding);
        real scaled_error = scale * (angle_error * (sine + angle_error) + rounding);
        real k =
            lanes_select(surface->entering, one - surface->ior, surface->ior - one) * (surface->ior + one);
        real squares = real_fma(scaled, scaled, surface->ior * surface->ior);
        real squared_error = scaled_error * (scaled + scaled + scaled_error) + rounding * squares;
        real squared = real_fma(scaled, scaled, -k), least_squared = squared - squared_error;
        open = open | (transparent & !(fabs(squared) > squared_error));
        // s - sqrt(s^2 - k) changes most where s is least
        real least = real_max(scaled - scaled_error, zero), root = real_sqrt(real_max(squared, zero)),
             least_root = real_sqrt(lanes_select(least_squared > zero, least_squared, one));
        real change = real_divide(real_max(fabs(least - least_root), root - least), least_root);
        // over the length before it is made unit: the index on entering, 1 on leaving
        real inverse_length = real_divide((real)(1.02f), lanes_select(surface->entering, surface->ior, one));
        real computed = real_fma(rounding * (scale + scaled + root + real_divide(squares, least_root)),
                                 inverse_length, rounding);
        real error = scale * turn + fabs(scaled - root) * normal_error + change * scaled_error;
        refracted->direction_error = real_fma(error, inverse_length, computed);
        if (HAS_CHORDS) {
            real inner_cosine = real_divide(root, surface->ior);
            Chord chord =
                chord_start(end, surface->place_error, inner_cosine, NEVER,
                            real_fma(angle_error, real_divide(one, surface->ior), computed + end->normal));
            bounce_set_chord(refracted, &chord, surface->entering & (surface->ior >= one));
            // in the plane of incidence; across it n, which is more where n < 1
            real steepest = real_max(real_divide(scaled + scaled_error, least_root), scale);
            real leaving =
                computed + (real)(1.01f) * (divide_or(end->place, end->radius, NEVER) +
                                            real_fma(steepest, end->turn + end->normal, end->normal));
            refracted->direction_error = lanes_select(surface->entering, refracted->direction_error,
                                                      real_min(leaving, refracted->direction_error));
        }
        mask refracts = transparent & !total;
        open = open | (refracts & !(refracted->direction_error <= BOUNCE_ERROR_MAX));
        if (HAS_TRIANGLES)
            open = open | (refracts & (fabs(vector_dot(refracted->direction, surface->normal)) <=
                                       refracted->direction_error + normal_error));
    } else {
        refracted->direction_error = zero;
    }
    *doubt = *doubt | open;
    const Color3 none = {zero, zero, zero};
    reflected->weight = vector_select(*doubt, none, reflected->weight);
    refracted->weight = vector_select(*doubt, none, refracted->weight);
}

// The reflected and the refracted ray of a surface, for a unit `direction`. Returns the lanes of total
// internal reflection, whose reflected ray carries the transmission as well. Unless `all`, a ray that no lane
// carries is not set.
static inline mask surface_bounce(const Surface *surface, Vector direction, Color3 weight, bool all,
                                  Bounce *reflected, Bounce *refracted)
{
    real reflection = HAS_REFLECTION ? surface->reflection : (real)(0);
    mask total = mask_none();
    mask transparent = HAS_TRANSMISSION ? surface->transmission > (real)(0) : mask_none();
    if (HAS_TRANSMISSION && (all || lanes_any(transparent))) {
        total = surface_refract(surface, direction, &refracted->direction);
        real transmission = lanes_select(total, (real)(0), surface->transmission);
        reflection = reflection + lanes_select(total, surface->transmission, (real)(0));
        refracted->origin = secondary_ray_origin(surface, true);
        refracted->weight = vector_scale(weight, transmission);
        total = total & transparent;
    }
    if (all || lanes_any(reflection > (real)(0))) {
        reflected->direction = surface_reflect(surface, direction);
        reflected->origin = secondary_ray_origin(surface, false);
        reflected->weight = vector_scale(weight, reflection);
    }
    if (HAS_IMAGES) reflected->travelled = refracted->travelled = surface->travelled;
    return total;
}

#endif
