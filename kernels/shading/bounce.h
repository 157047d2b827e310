// Traces reflected and refracted rays without recursion (Whitted, An improved illumination model for shaded
// display, CACM 23(6), 1980).
#ifndef BOUNCE_H
#define BOUNCE_H

#include "shading/surface.h"

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

// The largest error of a bounced ray's direction with which it is still traced.
#define BOUNCE_ERROR_MAX ((real)(0x1p-6f))
// The relative rounding error of a bounced ray's direction and of its terms.
#define BOUNCE_ROUNDING ((real)(32 * UNIT_ROUNDOFF))

static inline void bounce_set_chord(Bounce *bounce, const Chord *chord, mask inside)
{
    bounce->chord_turn = lanes_select(inside, chord->turn, NEVER);
    bounce->chord_end_place = lanes_select(inside, chord->end_place, NEVER);
    real error = real_min(bounce->direction_error, chord->direction_error);
    bounce->direction_error = lanes_select(inside, error, bounce->direction_error);
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
    reflected->direction_error = error;
    if (HAS_CHORDS) {
        const ChordEnd *end = &surface->chord_end;
        Chord chord = chord_start(end, surface->place_error, incidence->cosine,
                                  real_fma((real)(3), end->normal, BOUNCE_ROUNDING),
                                  incidence->angle_error + end->normal + BOUNCE_ROUNDING);
        bounce_set_chord(reflected, &chord, !surface->entering);
    }
    mask reflects = incidence->found & bounce_is_active(reflected);
    mask uncertain = reflects & !(reflected->direction_error <= BOUNCE_ERROR_MAX);
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
    Chord chord = chord_start(end, surface->place_error, snell->root * inverse_ior, NEVER,
                              real_fma(angle_error, inverse_ior, computed + end->normal));
    bounce_set_chord(refracted, &chord, surface->entering & (surface->ior >= (real)(1)));
    // the steepness in the plane of incidence; across it this is n, which is more where n < 1
    real steepest = real_max(real_divide(snell->s + snell->s_error, snell->least_root), snell->scale);
    real turned = real_fma(steepest, end->turn + end->normal, end->normal);
    real leaving = computed + (divide_or(end->place, end->radius, NEVER) + turned);
    refracted->direction_error = lanes_select(surface->entering, refracted->direction_error,
                                              real_min(leaving, refracted->direction_error));
}

// Sets the error of a refracted ray. n d + N (s - sqrt(s^2 - k)) is off by the errors of d and N and by the
// change of the difference with s. Returns the uncertain lanes.
static inline mask refracted_set_error(const Surface *surface, const Incidence *incidence, mask total,
                                       Bounce *refracted)
{
    const real one = (real)(1), normal_error = surface->normal_error;
    mask transparent = incidence->found & (surface->transmission > (real)(0)),
         refracts = transparent & !total;
    real angle_error = incidence->angle_error;
    if (HAS_CHORDS)
        angle_error =
            real_min(angle_error, surface->chord_end.turn + surface->chord_end.normal + BOUNCE_ROUNDING);
    const Snell snell = surface_snell(surface, incidence, angle_error);
    // s - sqrt(s^2 - k) changes most where s is least
    real least = real_max(snell.s - snell.s_error, (real)(0));
    real change = real_divide(real_max(fabs(least - snell.least_root), snell.root - least), snell.least_root);
    // Relative to the length before it is made a unit vector: n on entering, 1 on leaving. A vector that is
    // off by e of its length is off by at most e / (1 - e) as a unit vector, with e at most 2^-6 unless it is
    // uncertain.
    real inverse_length = real_divide((real)(1.02f), lanes_select(surface->entering, surface->ior, one));
    real roundings = snell.scale + snell.s + snell.root + real_divide(snell.squares, snell.least_root);
    real computed = real_fma(BOUNCE_ROUNDING * roundings, inverse_length, BOUNCE_ROUNDING);
    real error =
        snell.scale * incidence->turn + fabs(snell.s - snell.root) * normal_error + change * snell.s_error;
    refracted->direction_error = real_fma(error, inverse_length, computed);
    if (HAS_CHORDS) refracted_set_chord(surface, &snell, angle_error, computed, refracted);
    mask uncertain = transparent & snell.uncertain;
    uncertain = uncertain | (refracts & !(refracted->direction_error <= BOUNCE_ERROR_MAX));
    if (!HAS_TRIANGLES) return uncertain;
    real inward = fabs(vector_dot(refracted->direction, surface->normal));
    return uncertain | (refracts & (inward <= refracted->direction_error + normal_error));
}

// Sets the bounds of a surface's reflected and refracted ray. Uncertain lanes are not traced further.
static inline void bounces_set_errors(const Surface *surface, const Ray *ray, mask total, Bounce *reflected,
                                      Bounce *refracted, mask *uncertain)
{
    const Color3 none = {(real)(0), (real)(0), (real)(0)};
    const Incidence incidence = surface_incidence(surface, ray);
    reflected->origin_error = surface->line_error;
    reflected->start_error = surface->start_error;
    refracted->origin_error = surface->place_error;
    refracted->start_error = (real)(0);
    reflected->origin_object = refracted->origin_object = surface->object;
    reflected->leaves_outward = surface->entering;
    refracted->leaves_outward = !surface->entering;
    refracted->direction_error = (real)(0);
    *uncertain = *uncertain | reflected_set_error(surface, ray, &incidence, reflected);
    if (HAS_TRANSMISSION)
        *uncertain = *uncertain | refracted_set_error(surface, &incidence, total, refracted);
    reflected->weight = vector_select(*uncertain, none, reflected->weight);
    refracted->weight = vector_select(*uncertain, none, refracted->weight);
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
