// Traces reflected and refracted rays without recursion (Whitted, An improved illumination model for shaded
// display, CACM 23(6), 1980).
#ifndef BOUNCE_H
#define BOUNCE_H

#include "shading/optics.h"
#include "shading/visible_surface.h"

// The medium of a ray: the density of the body that absorbs its light, and that of the body around that one;
// 0 in air (shading/medium.h).
typedef struct {
    Color3 density, outer;
} Medium;

// What a Bounce needs at `certified`.
typedef struct {
    // copied to the Ray's fields of the same names; start_error becomes -tmin
    real origin_error, start_error, direction_error;
    integer origin_object;
    mask leaves_outward;
    real chord_turn, chord_end_position;
    // with HAS_DECISIONS, the ray's number in its tree and the lanes in which its node is recorded
    uint number;
    mask known;
} CertainBounce;

// A ray to trace, and the weight of its color in the pixel. A weight of 0 means that there is no ray.
typedef struct {
    Vector origin, direction; // unit
    Color3 weight;
    uint depth;
    real travelled;        // distance from the eye along the path
    Sample sample;         // with HAS_AREA_LIGHTS
    Medium medium;         // with HAS_ABSORPTION
    CertainBounce certain; // at `certified`
} Bounce;

static inline mask bounce_is_active(const Bounce *bounce)
{
    return (bounce->weight.x > 0) | (bounce->weight.y > 0) | (bounce->weight.z > 0);
}

static inline Ray bounce_ray(const Bounce *bounce)
{
    Ray ray = ray_make_unit(bounce->origin, bounce->direction, bounce_is_active(bounce));
    if (HAS_IMAGES) ray.travelled = bounce->travelled;
    if (HAS_AREA_LIGHTS) ray.sample = bounce->sample;
    if (IS_CERTIFIED) {
        ray.origin_error = bounce->certain.origin_error;
        ray.tmin = -bounce->certain.start_error;
        ray.direction_error = bounce->certain.direction_error;
        ray.origin_object = bounce->certain.origin_object;
        ray.leaves_outward = bounce->certain.leaves_outward;
        if (HAS_CHORDS) {
            ray.chord_turn = bounce->certain.chord_turn;
            ray.chord_end_position = bounce->certain.chord_end_position;
        }
    }
    return ray;
}

// The rays that leave a surface where a ray hits it.
typedef struct {
    Bounce reflected, refracted;
    mask total; // total internal reflection, where the reflected ray also carries the transmission
} Bounces;

// Returns bounces that carry nothing, at a depth.
static inline Bounces bounces_none(const Ray *ray, uint depth)
{
    const Bounce none = {ray->origin, ray->direction, color_gray((real)(0)), depth};
    return (Bounces){none, none, mask_none()};
}

static inline Color3 conductor_reflectance(const Surface *surface, Vector direction)
{
    real cosine = real_clamp(-vector_dot(direction, surface->shading_normal), (real)(0), (real)(1));
    Color3 index_real = surface->conductor_real, squared = surface->conductor_imaginary_squared;
    return (Color3){conductor_channel(cosine, index_real.x, squared.x),
                    conductor_channel(cosine, index_real.y, squared.y),
                    conductor_channel(cosine, index_real.z, squared.z)};
}

// Reflects a direction at the shading normal, or at the geometric one if the former would send the ray
// through the surface.
static inline Vector surface_reflect(const Surface *surface, Vector direction)
{
    Vector reflected = vector_reflect(direction, surface->shading_normal);
    if (!HAS_SHADING_NORMALS) return reflected;
    mask inward = vector_dot(reflected, surface->normal) <= 0;
    return vector_select(inward, vector_reflect(direction, surface->normal), reflected);
}

// Refracts a direction at the shading normal, or at the geometric one if the former would keep the ray on its
// side. Returns the lanes of total internal reflection.
static inline mask surface_refract(const Surface *surface, Vector direction, Vector *refracted)
{
    mask total =
        vector_refract(direction, surface->shading_normal, surface->entering, surface->ior, refracted);
    if (!HAS_SHADING_NORMALS) return total;
    mask outward = !total & (vector_dot(*refracted, surface->normal) >= 0);
    if (!lanes_any(outward)) return total;
    Vector plain;
    mask plain_total = vector_refract(direction, surface->normal, surface->entering, surface->ior, &plain);
    vector_replace(refracted, outward, plain);
    return lanes_select(outward, plain_total, total);
}

// Returns a fraction of a weight's channel. The product never rounds to 0, since paths must end only where
// nothing reflects or transmits.
static inline real channel_part(real channel, real part)
{
    const real zero = (real)(0);
    real least = lanes_select((part > zero) & (channel > zero), (real)(SMALLEST_RATIO), zero);
    return real_max(channel * part, least);
}

// Returns the product of a weight and a color, no channel of which rounds to 0.
static inline Color3 weight_tinted(Color3 weight, Color3 parts)
{
    return (Color3){channel_part(weight.x, parts.x), channel_part(weight.y, parts.y),
                    channel_part(weight.z, parts.z)};
}

// Returns a fraction of a weight. Without tints its channels are equal.
static inline Color3 weight_part(Color3 weight, real part)
{
    if (HAS_TINTS) return weight_tinted(weight, color_gray(part));
    return color_gray(channel_part(weight.x, part));
}

// Returns a bound on all channels.
static inline real weight_largest(Color3 weight)
{
    return HAS_TINTS ? color_largest(weight) : weight.x;
}

// The relative rounding error of a weight, each of up to 255 bounces having 4 roundings.
#define WEIGHT_ROUNDING ((real)(1024 * UNIT_ROUNDOFF))

// Returns the weight, or 0 if all its channels, and so their share of the pixel, are below `least`. At
// `certified` adds the lanes where rounding may decide to *uncertain.
static inline Color3 weight_cut(Color3 weight, real least, mask *uncertain)
{
    real largest = weight_largest(weight);
    if (IS_CERTIFIED)
        *uncertain = *uncertain | ((largest > 0) & (fabs(largest - least) <= WEIGHT_ROUNDING * least));
    return vector_select(largest < least, color_gray((real)(0)), weight);
}

// Returns the weight of a reflected ray of which the part `kept` is not tinted.
static inline Color3 reflected_weight(const Surface *surface, Vector direction, Color3 weight,
                                      real reflection, real kept)
{
    if (!HAS_TINTS) return weight_part(weight, reflection + kept);
    Color3 tint = surface->reflection_tint;
    if (HAS_CONDUCTORS && lanes_any(surface->conductor))
        tint = vector_select(surface->conductor,
                             color_multiply(tint, conductor_reflectance(surface, direction)), tint);
    return weight_tinted(weight, vector_fma(tint, reflection, color_gray(kept)));
}

// Sets the reflected and the refracted ray of a surface, for a unit `direction` and the weight of the ray
// that hits it. By Fresnel's equations and in total internal reflection, the reflected ray keeps a part of
// the transmission, which is not tinted. Unless `all`, a ray that no lane carries is not set.
static inline void surface_set_bounces(const Surface *surface, Vector direction, Color3 weight, bool all,
                                       Bounces *bounces)
{
    Bounce *reflected = &bounces->reflected, *refracted = &bounces->refracted;
    real reflection = HAS_REFLECTION ? surface->reflection : (real)(0), kept = (real)(0);
    mask transparent = surface_is_transparent(surface);
    if (HAS_FRESNEL && lanes_any(surface->fresnel)) {
        // an opaque body has no inside
        real part = fresnel_reflectance(direction, surface->shading_normal, surface->entering | !transparent,
                                        surface->ior);
        kept = lanes_select(surface->fresnel & transparent, part * surface->transmission, kept);
        reflection = lanes_select(surface->fresnel & !transparent, part * reflection, reflection);
    }
    if (HAS_TRANSMISSION && (all || lanes_any(transparent))) {
        mask total = surface_refract(surface, direction, &refracted->direction);
        kept = lanes_select(total, surface->transmission, kept);
        real transmission = lanes_select(total, (real)(0), surface->transmission - kept);
        refracted->origin = secondary_ray_origin(surface, true);
        refracted->weight =
            HAS_FILTERS ? weight_tinted(weight, vector_scale(surface->transmission_tint, transmission))
                        : weight_part(weight, transmission);
        bounces->total = total & transparent;
    }
    if (all || lanes_any(reflection + kept > 0)) {
        reflected->direction = surface_reflect(surface, direction);
        reflected->origin = secondary_ray_origin(surface, false);
        reflected->weight = reflected_weight(surface, direction, weight, reflection, kept);
    }
    if (HAS_IMAGES) reflected->travelled = refracted->travelled = surface->travelled;
    if (HAS_AREA_LIGHTS) {
        reflected->sample = sample_after_bounce(surface->sample, false);
        refracted->sample = sample_after_bounce(surface->sample, true);
    }
}

#endif
