// Traces reflected and refracted rays without recursion (Whitted, An improved illumination model for shaded
// display, CACM 23(6), 1980).
#ifndef BOUNCE_H
#define BOUNCE_H

#include "shading/visible_surface.h"

// The medium of a ray: the density of the body that absorbs its light, and that of the body around that one;
// 0 in air (shading/medium.h).
typedef struct {
    Color3 density, outer;
} Medium;

// A ray to trace, and the weight of its color in the pixel. A weight of 0 means that there is no ray.
typedef struct {
    Vector origin, direction; // unit
    Color3 weight;
    uint depth;
    real travelled; // distance from the eye along the path
    Sample sample;  // with HAS_AREA_LIGHTS
    Medium medium;  // with HAS_ABSORPTION
    // At `certified`, copied to the Ray's fields of the same names; start_error becomes -tmin:
    real origin_error, start_error, direction_error;
    integer origin_object;
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
    if (HAS_IMAGES) ray.travelled = bounce->travelled;
    if (HAS_AREA_LIGHTS) ray.sample = bounce->sample;
    if (IS_CERTIFIED) {
        ray.origin_error = bounce->origin_error;
        ray.tmin = -bounce->start_error;
        ray.direction_error = bounce->direction_error;
        ray.origin_object = bounce->origin_object;
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

// Returns the square under the root of vector_refract, which is c^2 + k for s = c on entering a body of
// index n, and s^2 - k for s = n c on leaving it. It is negative in total internal reflection.
static inline real refraction_squared(real s, mask entering, real ior)
{
    real above_one = lanes_select(entering, (real)(1) - ior, ior - (real)(1));
    return difference_of_products(s, s, above_one, ior + (real)(1));
}

// Returns (a - b) / (a + b) for a and b >= 0, and 0 where both are 0.
static inline real relative_difference(real a, real b)
{
    return real_divide(a - b, real_max(a + b, (real)(SMALLEST_RATIO)));
}

// Returns the fraction of unpolarized light that a body of index n reflects, from outside or inside, by
// Fresnel's equations (Born, Wolf, Principles of Optics, 1999, section 1.5.2); 1 in total internal
// reflection. With the s of refraction_squared and the root r the amplitudes are (s - r) / (s + r) and
// (n^2 s - r) / (n^2 s + r) on entering, (s - n^2 r) / (s + n^2 r) on leaving.
static inline real fresnel_reflectance(Vector direction, Vector normal, mask entering, real ior)
{
    const real one = (real)(1), zero = (real)(0);
    real cosine = real_max(-vector_dot(direction, normal), zero);
    real s = lanes_select(entering, cosine, ior * cosine), squared = refraction_squared(s, entering, ior);
    real root = real_sqrt(real_max(squared, zero));
    real across = relative_difference(s, root);
    real along = relative_difference(s * lanes_select(entering, ior * ior, one),
                                     root * lanes_select(entering, one, ior * ior));
    real reflectance = (real)(0.5f) * real_fma(across, across, along * along);
    return lanes_select(squared < zero, one, reflectance);
}

// Returns the fraction of unpolarized light that a conductor reflects, for the cosine c and the sine s of
// the angle. With (a + i b)^2 = (n + i k)^2 - s^2 the fraction of light across the plane of incidence is
// (a^2 + b^2 - 2 a c + c^2) / (a^2 + b^2 + 2 a c + c^2), and along it that times
// (c^2 (a^2 + b^2) - 2 a c s^2 + s^4) / (c^2 (a^2 + b^2) + 2 a c s^2 + s^4) (Born, Wolf, section 14.2). The
// smaller of a^2 and b^2 is computed from their product, which does not cancel.
static inline real conductor_channel(real cosine, real cosine_squared, real sine_squared, real index_real,
                                     real index_imaginary_squared)
{
    const real zero = (real)(0), one_half = (real)(0.5f);
    real difference = index_real - sine_squared;                                     // a^2 - b^2
    real sum = real_sqrt(real_fma(difference, difference, index_imaginary_squared)); // a^2 + b^2
    real larger = one_half * (sum + fabs(difference));
    real smaller =
        real_divide((real)(0.25f) * index_imaginary_squared, real_max(larger, (real)(SMALLEST_RATIO)));
    real twice_a_c = (cosine + cosine) * real_sqrt(lanes_select(difference < zero, smaller, larger));
    real across = real_max(relative_difference(sum + cosine_squared, twice_a_c), zero);
    real rest = relative_difference(real_fma(cosine_squared, sum, sine_squared * sine_squared),
                                    twice_a_c * sine_squared);
    return one_half * across * ((real)(1) + real_max(rest, zero));
}

static inline Color3 conductor_reflectance(const Surface *surface, Vector direction)
{
    const real one = (real)(1), zero = (real)(0);
    real cosine = real_min(real_max(-vector_dot(direction, surface->shading_normal), zero), one);
    real cosine_squared = cosine * cosine, sine_squared = one - cosine_squared;
    Color3 index_real = surface->conductor_real, squared = surface->conductor_imaginary_squared;
    return (Color3){conductor_channel(cosine, cosine_squared, sine_squared, index_real.x, squared.x),
                    conductor_channel(cosine, cosine_squared, sine_squared, index_real.y, squared.y),
                    conductor_channel(cosine, cosine_squared, sine_squared, index_real.z, squared.z)};
}

// Refracts a unit direction by Snell's law at a unit normal that faces it. Returns the lanes of total
// internal reflection. With k = (n - 1)(n + 1) and the cosine c, the ray into a body of index n runs along d
// + N (c - sqrt(c^2 + k)), and the ray out of it along n d + N (n c - sqrt((n c)^2 - k)). In this form
// grazing rays survive if n is near 1, and n = 1 bends nothing however inexact a device's division is.
static inline mask vector_refract(Vector direction, Vector normal, mask entering, real ior, Vector *refracted)
{
    real scale = lanes_select(entering, (real)(1), ior);
    real scaled = scale * -vector_dot(direction, normal);
    real squared = refraction_squared(scaled, entering, ior);
    mask total = squared < (real)(0);
    real cosine = real_sqrt(real_max(squared, (real)(0)));
    *refracted = vector_normalize(vector_fma(normal, scaled - cosine, vector_scale(direction, scale)));
    return total;
}

// Reflects a direction at the shading normal, or at the geometric one if the former would send the ray
// through the surface.
static inline Vector surface_reflect(const Surface *surface, Vector direction)
{
    Vector reflected = vector_reflect(direction, surface->shading_normal);
    if (!HAS_SHADING_NORMALS) return reflected;
    mask inward = vector_dot(reflected, surface->normal) <= (real)(0);
    return vector_select(inward, vector_reflect(direction, surface->normal), reflected);
}

// Refracts a direction at the shading normal, or at the geometric one if the former would keep the ray on its
// side. Returns the lanes of total internal reflection.
static inline mask surface_refract(const Surface *surface, Vector direction, Vector *refracted)
{
    mask total =
        vector_refract(direction, surface->shading_normal, surface->entering, surface->ior, refracted);
    if (!HAS_SHADING_NORMALS) return total;
    mask outward = !total & (vector_dot(*refracted, surface->normal) >= (real)(0));
    if (!lanes_any(outward)) return total;
    Vector plain;
    mask plain_total = vector_refract(direction, surface->normal, surface->entering, surface->ior, &plain);
    *refracted = vector_select(outward, plain, *refracted);
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

// Returns a fraction of a weight. Without tints its channels are equal.
static inline Color3 weight_part(Color3 weight, real part)
{
    if (HAS_TINTS)
        return (Color3){channel_part(weight.x, part), channel_part(weight.y, part),
                        channel_part(weight.z, part)};
    const real scaled = channel_part(weight.x, part);
    return (Color3){scaled, scaled, scaled};
}

// Returns the product of a weight and a color, no channel of which rounds to 0.
static inline Color3 weight_tinted(Color3 weight, Color3 parts)
{
    return (Color3){channel_part(weight.x, parts.x), channel_part(weight.y, parts.y),
                    channel_part(weight.z, parts.z)};
}

// Returns a bound on all channels.
static inline real weight_largest(Color3 weight)
{
    return HAS_TINTS ? real_max(real_max(weight.x, weight.y), weight.z) : weight.x;
}

// The relative rounding error of a weight, each of up to 255 bounces having 4 roundings.
#define WEIGHT_ROUNDING ((real)(1024 * UNIT_ROUNDOFF))

// Returns the weight, or 0 if all its channels, and so their share of the pixel, are below `least`. At
// `certified` adds the lanes where rounding may decide to *uncertain.
static inline Color3 weight_cut(Color3 weight, real least, mask *uncertain)
{
    const Color3 none = {(real)(0), (real)(0), (real)(0)};
    real largest = weight_largest(weight);
    if (IS_CERTIFIED)
        *uncertain =
            *uncertain | ((largest > (real)(0)) & (fabs(largest - least) <= WEIGHT_ROUNDING * least));
    return vector_select(largest < least, none, weight);
}

// Computes the reflected and the refracted ray of a surface, for a unit `direction`. Returns the lanes of
// total internal reflection, whose reflected ray also carries the transmission. By Fresnel's equations a
// reflected ray carries a fraction of it. Neither share is tinted. Unless `all`, a ray that no lane carries
// is not set.
static inline mask surface_bounce(const Surface *surface, Vector direction, Color3 weight, bool all,
                                  Bounce *reflected, Bounce *refracted)
{
    real reflection = HAS_REFLECTION ? surface->reflection : (real)(0), kept = (real)(0);
    mask total = mask_none();
    mask transparent = HAS_TRANSMISSION ? surface->transmission > (real)(0) : mask_none();
    if (HAS_FRESNEL && lanes_any(surface->fresnel)) {
        // an opaque body has no inside
        real part = fresnel_reflectance(direction, surface->shading_normal, surface->entering | !transparent,
                                        surface->ior);
        kept = lanes_select(surface->fresnel & transparent, part * surface->transmission, kept);
        reflection = lanes_select(surface->fresnel & !transparent, part * reflection, reflection);
    }
    if (HAS_TRANSMISSION && (all || lanes_any(transparent))) {
        total = surface_refract(surface, direction, &refracted->direction);
        kept = lanes_select(total, surface->transmission, kept);
        real transmission = lanes_select(total, (real)(0), surface->transmission - kept);
        refracted->origin = secondary_ray_origin(surface, true);
        refracted->weight =
            HAS_FILTERS ? weight_tinted(weight, vector_scale(surface->transmission_tint, transmission))
                        : weight_part(weight, transmission);
        total = total & transparent;
    }
    if (all || lanes_any(reflection + kept > (real)(0))) {
        reflected->direction = surface_reflect(surface, direction);
        reflected->origin = secondary_ray_origin(surface, false);
        if (HAS_TINTS) {
            Color3 tint = surface->reflection_tint;
            if (HAS_CONDUCTORS && lanes_any(surface->conductor))
                tint = vector_select(surface->conductor,
                                     color_multiply(tint, conductor_reflectance(surface, direction)), tint);
            reflected->weight =
                weight_tinted(weight, vector_fma(tint, reflection, (Color3){kept, kept, kept}));
        } else {
            reflected->weight = weight_part(weight, reflection + kept);
        }
    }
    if (HAS_IMAGES) reflected->travelled = refracted->travelled = surface->travelled;
    if (HAS_AREA_LIGHTS) {
        reflected->sample = sample_after_bounce(surface->sample, false);
        refracted->sample = sample_after_bounce(surface->sample, true);
    }
    return total;
}

#endif
