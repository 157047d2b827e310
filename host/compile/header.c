#include "host/compile/camera_basis.h"
#include "host/compile/instances.h"
#include "host/compile/stages.h"
#include <float.h>
#include <string.h>

// Clamps to finite floats, because kernels built with -cl-finite-math-only need not know infinities.
static scalar4 scalar4_within_floats(Vector3 v)
{
    return scalar4_of(vector_max(vector_min(v, vector_all(FLT_MAX)), vector_all(-FLT_MAX)), 0);
}

// Returns the center and, in w, the largest distance from it to a point inside, summed over the axes.
static scalar4 center_and_half_extent(const Bounds *bounds)
{
    Vector3 half_low = vector_scale(bounds->min, 0.5), half_high = vector_scale(bounds->max, 0.5);
    Vector3 half_extents = vector_subtract(half_high, half_low);
    return scalar4_of(vector_add(half_low, half_high), half_extents.x + half_extents.y + half_extents.z);
}

// Returns the largest scalar, negated if an error bound may underflow or overflow.
static double first_rival(const CompiledScene *compiled, const CompileSettings *settings)
{
    const double largest = settings->precision == PRECISION_DOUBLE ? DBL_MAX : FLT_MAX;
    return settings->certifies && !bounds_hold(compiled, settings) ? -largest : largest;
}

static void sky_set(SceneHeader *header, const CompiledScene *compiled, const Scene *scene)
{
    const bool has_sky = !vector_is_zero(scene->sky.up);
    const Color above = has_sky ? vector_subtract(scene->sky.zenith, scene->background) : vector_all(0),
                below = has_sky ? vector_subtract(scene->sky.nadir, scene->background) : vector_all(0);
    const Vector3 up = vector_normalize(scene->sky.up), forward = vector_normalize(scene->sky.forward);
    header->sky_up =
        scalar4_of(has_sky ? up : scene->sky.up, fmax(vector_largest(above), vector_largest(below)));
    header->sky_above = scalar4_of(above, 0);
    header->sky_below = scalar4_of(below, 0);
    header->sky_forward = scalar4_of(forward, scene->sky.intensity);
    header->sky_right = scalar4_of(vector_cross(forward, up), 0);
    if (scene->sky.texture == 0) return;
    const CompiledTexture *texture = &compiled->textures[scene->sky.texture - 1];
    header->sky_texture =
        (uint4){1 + texture->first_level, texture->level_count, WRAP_REPEATED, WRAP_CLAMPED};
}

void header_write(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings)
{
    const CameraBasis basis = camera_basis(&scene->camera, settings->width, settings->height);
    const double focal_distance = camera_focal_distance(&scene->camera),
                 lens_radius = focal_distance > 0 ? scene->camera.lens.radius : 0;
    const bool is_equirectangular = scene->camera.projection == PROJECTION_EQUIRECTANGULAR,
               is_orthographic = scene->camera.projection == PROJECTION_ORTHOGRAPHIC;
    const Vector3 right = is_equirectangular ? vector_normalize(basis.right) : basis.right,
                  up = is_equirectangular ? vector_normalize(basis.up) : basis.up;
    double half_pixel_squared = vector_dot(basis.right, basis.right);
    if (is_equirectangular) half_pixel_squared = fmax(half_pixel_squared, vector_dot(basis.up, basis.up));
    const double sample_width = 2 * sqrt(half_pixel_squared / settings->sample_count);
    const Vector3 eye =
        is_orthographic ? vector_add(compiled->eye_offset, basis.shift) : compiled->eye_offset;
    SceneHeader header = {
        .background = scalar4_of(scene->background, 0),
        .ambient = scalar4_of(scene->ambient, 0),
        .eye = scalar4_of(eye, 0),
        .forward = scalar4_of(basis.middle, camera_direction_error(&basis)),
        .right = scalar4_of(right, is_equirectangular ? 0.5 / settings->width : 0),
        .up = scalar4_of(up, is_equirectangular ? 0.25 / settings->height : 0),
        .lens_right = scalar4_of(vector_scale(vector_normalize(basis.right), lens_radius),
                                 focal_distance > 0 ? 1 / focal_distance : 0),
        .lens_up = scalar4_of(vector_scale(vector_normalize(basis.up), lens_radius),
                              is_equirectangular ? CAMERA_EQUIRECTANGULAR
                              : is_orthographic  ? CAMERA_ORTHOGRAPHIC
                                                 : 0),
        .bounds = center_and_half_extent(&compiled->bvh_bounds),
        .bounds_low = scalar4_of(compiled->bvh_bounds.min, instance_slack(compiled, settings)),
        .bounds_high = scalar4_of(compiled->bvh_bounds.max, 0),
        .contact_low = scalar4_within_floats(compiled->contact.min),
        .contact_high = scalar4_within_floats(compiled->contact.max),
        .sample = {sample_width, first_rival(compiled, settings), is_orthographic ? sample_width : 0,
                   settings->min_contribution},
        .image = {settings->width, settings->height, settings->sample_count, (uint32_t)scene->lights.count},
        .bounces.x = settings->bounce_count,
        .cull_spheres.x = compiled->cull_sphere_count,
    };
    sky_set(&header, compiled, scene);
    uint32_t counts[TYPE_COUNT];
    for (size_t type = 0; type < TYPE_COUNT; type++)
        counts[type] = (uint32_t)compiled->arrays[FLAT_FIRST_SHAPE + type].count;
    memcpy(header.counts, counts, sizeof counts);
    memcpy(header.bvh_counts, compiled->bvh_counts, sizeof compiled->bvh_counts);
    flat_array_renew(compiled, FLAT_HEADER, 1);
    *(SceneHeader *)compiled->arrays[FLAT_HEADER].items = header;
}
