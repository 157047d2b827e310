// Defines the surface at a hit: its position, normals and material.
#ifndef SURFACE_H
#define SURFACE_H

#include "shading/chords.h"
#include "shading/lane_points.h"
#include "traversal/traversal.h"

// Members that only reflection, transmission or images need are set only with them. For an explicit ray,
// whose direction may have any length, colors and `travelled` are not used.
typedef struct {
    integer object; // its id; -1 if nothing is hit
    Vector position;
    Vector normal;         // geometric, unit, facing the ray; with HAS_SHADING_NORMALS: surface_normal
    Vector shading_normal; // unit, on the same side
    Vector to_eye;         // unit, back along the ray
    Vector lift;           // with HAS_SMOOTH_NORMALS, from the position to where rays to lights start
    real error;            // bound on the position's distance from the true surface
    real refracted_offset; // distance behind the surface at which a refracted ray starts
    Color3 ambient;        // the ambient light that it reflects, and its emission
    Color3 diffuse;        // the factor by which it reflects a light that it faces
    real specular, shininess;
    real reflection, transmission, ior;
    Color3 reflection_tint, specular_tint; // with HAS_TINTS
    mask fresnel;                          // with HAS_FRESNEL
    Sample sample;                         // with HAS_AREA_LIGHTS
    mask conductor;                        // with HAS_CONDUCTORS, like the next two (types.h)
    Color3 conductor_real, conductor_imaginary_squared;
    Color3 transmission_tint; // with HAS_FILTERS
    Color3 absorption;        // with HAS_ABSORPTION: the density within
    mask entering;            // the ray runs into the solid, against its outward normal
    real travelled;           // distance from the eye along the path
    // At `certified`, bounds on the distances from the exact ones of the position, of the shading normal,
    // with HAS_TRIANGLES of the geometric normal, and of to_eye; and the uncertain lanes.
    real position_error, normal_error, geometric_error, eye_error;
    real lift_error;              // with HAS_SMOOTH_NORMALS, bounds the error of `lift`, 0 where none lifts
    real line_error, start_error; // a reflected ray's origin_error and -tmin
    mask uncertain;
    ChordEnd chord_end; // with HAS_CHORDS
} Surface;

static inline mask surface_found(const Surface *surface)
{
    return surface->object >= (integer)(0);
}

static inline mask surface_is_transparent(const Surface *surface)
{
    return HAS_TRANSMISSION ? surface->transmission > 0 : mask_none();
}

// Returns the geometric normal, facing the ray.
static inline Vector surface_normal(const Surface *surface)
{
    return HAS_SHADING_NORMALS ? surface->normal : surface->shading_normal;
}

// Sets the material in some lanes. `color` is the object's.
static inline void surface_set_material(Surface *surface, const Scene *scene, mask lanes,
                                        const FlatMaterial *material, Color3 color)
{
    const scalar4 bounces = material->reflection_transmission_ior;
    Color3 ambient =
        color_multiply(vector_scale(vector_of(scene->header->ambient), (real)(material->color.w)), color);
    if (HAS_EMISSION) ambient = vector_add(ambient, vector_of(material->emission));
    vector_replace(&surface->ambient, lanes, ambient);
    vector_replace(&surface->diffuse, lanes, color_multiply(vector_of(material->diffuse), color));
    real_replace(&surface->specular, lanes, (real)(material->diffuse.w));
    real_replace(&surface->shininess, lanes, (real)(material->other_color.w));
    if (HAS_REFLECTION) real_replace(&surface->reflection, lanes, (real)(bounces.x));
    if (HAS_TINTS) {
        vector_replace(&surface->reflection_tint, lanes, vector_of(material->reflection_tint));
        vector_replace(&surface->specular_tint, lanes, vector_of(material->specular_tint));
    }
    if (HAS_CONDUCTORS) {
        surface->conductor = surface->conductor | (lanes & ((real)(material->conductor_real.w) > 0));
        vector_replace(&surface->conductor_real, lanes, vector_of(material->conductor_real));
        vector_replace(&surface->conductor_imaginary_squared, lanes,
                       vector_of(material->conductor_imaginary_squared));
    }
    if (HAS_FRESNEL)
        surface->fresnel = surface->fresnel | (lanes & ((real)(material->reflection_tint.w) > 0));
    if (!HAS_TRANSMISSION) return;
    real_replace(&surface->transmission, lanes, (real)(bounces.y));
    real_replace(&surface->ior, lanes, (real)(bounces.z));
    if (HAS_FILTERS)
        vector_replace(&surface->transmission_tint, lanes, vector_of(material->transmission_tint));
    if (HAS_ABSORPTION) vector_replace(&surface->absorption, lanes, vector_of(material->absorption));
}

#endif
