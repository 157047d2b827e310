// Traces the ray tree of a camera ray and computes its color, or the tree's signature if COMPUTE_SIGNATURE,
// which is defined as 0 or 1 before this file is included.
#ifndef PATH_H
#define PATH_H

#include "shading/certain_bounce.h"
#include "shading/medium.h"
#include "shading/phong.h"

// The hits of a packet of rays, shaded.
typedef struct {
    Surface surface; // if no lane hits one, only its object is set
    Color3 color;    // without reflection and refraction; the background's where nothing was hit
    real t;          // with HAS_ABSORPTION
    // at `certified`: the lanes where any of this is uncertain; a bound on the error of any channel
    mask uncertain;
    real color_error;
} ShadedHit;

// Sets the surface that a packet's rays hit and the ambient light that it reflects. Returns whether any lane
// hit one.
static inline bool hit_shade(const Scene *scene, const Ray *ray, Traversal *traversal, ShadedHit *hit)
{
    if (IS_CERTIFIED) traversal_classify(traversal);
    hit->surface.object = traversal->hit.object;
    hit->color = background_color(scene, ray->direction, RAY_ACTIVE(ray) & !surface_found(&hit->surface));
    if (HAS_ABSORPTION) hit->t = traversal->hit.t;
    if (IS_CERTIFIED) {
        hit->uncertain = traversal->hit.uncertain;
        hit->color_error = (real)(0);
        if (HAS_SKY) {
            real error =
                (real)(scene->header->sky_up.w) * (ray->direction_error + (real)(16 * UNIT_ROUNDOFF));
            hit->color_error = lanes_select(surface_found(&hit->surface), (real)(0), error);
        }
    }
    mask found = surface_found(&hit->surface);
    if (!lanes_any(found)) return false;
    hit->surface = visible_surface(scene, ray, &traversal->hit);
    if (IS_CERTIFIED) hit->uncertain = hit->uncertain | (found & hit->surface.uncertain);
    hit->color = vector_select(found, hit->surface.ambient, hit->color);
    return true;
}

// Adds the contribution of a light to which a packet's shadow rays have been traced.
static inline void hit_add_light(const Scene *scene, uint index, LightVisibility *light, Traversal *traversal,
                                 ShadedHit *hit)
{
    if (IS_CERTIFIED) {
        traversal_classify(traversal);
        mask glossy = hit->surface.specular > (real)(0);
        light_add_uncertainty(light, &traversal->hit);
        mask matters = glossy | !light->facing_uncertain;
        hit->uncertain = hit->uncertain | (light->uncertain & matters) | (light->facing_uncertain & glossy);
    }
    Color3 fractions;
    if (HAS_FILTERS) fractions = vector_scale(traversal_filter(traversal), light->fraction);
    light_occlude(light, traversal_transmittance(traversal));
    if (IS_CERTIFIED)
        hit->color_error = hit->color_error +
                           lanes_select(light->lit | light->facing_uncertain, light->color_error, (real)(0));
    const Color3 black = {(real)(0), (real)(0), (real)(0)};
    Color3 arriving = vector_of(scene->lights[index].color);
    arriving = HAS_FILTERS ? color_multiply(arriving, fractions) : vector_scale(arriving, light->fraction);
    Color3 reflected = vector_select(light->lit, color_multiply(light->reflected, arriving), black);
    hit->color = vector_add(hit->color, reflected);
}

// Traces `count` packets of rays and shades their hits, without lights if COMPUTE_SIGNATURE.
static OUT_OF_LINE void rays_shade(const Scene *scene, Ray *rays, uint count, ShadedHit *hits)
{
    Traversal traversals[PACKETS];
    Ray shadow_rays[PACKETS];
    LightVisibility lights[PACKETS];
    const uint light_count = COMPUTE_SIGNATURE ? 0 : scene->header->image.w;
    uint packets = 0, found = 0; // as bits: those that traverse the BVH, and those that hit anything
    uint near = packets_near(scene, rays, (1u << count) - 1);
    for (uint i = 0; i < count; i++)
        if (traversal_begin(&traversals[i], scene, &rays[i], CLOSEST_HIT, near)) packets |= 1u << i;
    if (HAS_BVH) packets_traverse_bvh(traversals, scene, rays, packets);
    for (uint i = 0; i < count; i++)
        if (hit_shade(scene, &rays[i], &traversals[i], &hits[i])) found |= 1u << i;
    for (uint light = 0; found != 0 && light < light_count; light++) {
        packets = 0;
        for (uint i = 0; i < count; i++)
            if (found >> i & 1) lights[i] = light_reach(scene, &hits[i].surface, light, &shadow_rays[i]);
        near = packets_near(scene, shadow_rays, found);
        for (uint i = 0; i < count; i++)
            if (found >> i & 1 && traversal_begin(&traversals[i], scene, &shadow_rays[i], OCCLUSION, near))
                packets |= 1u << i;
        if (HAS_BVH) packets_traverse_bvh(traversals, scene, shadow_rays, packets);
        for (uint i = 0; i < count; i++)
            if (found >> i & 1) hit_add_light(scene, light, &lights[i], &traversals[i], &hits[i]);
    }
}

// Adds a ray's hit and its bounces to the signature.
static inline unsigned_integer path_signature_add(unsigned_integer path, const Ray *ray, integer object,
                                                  mask reflected, mask refracted, mask total)
{
    const integer none = (integer)(0);
    integer events = lanes_select(reflected, (integer)(PATH_REFLECTED), none) |
                     lanes_select(refracted, (integer)(PATH_REFRACTED), none) |
                     lanes_select(reflected & total, (integer)(PATH_TOTAL_REFLECTION), none);
    unsigned_integer word = unsigned_from_integer((object + (integer)(1)) * (integer)(PATH_EVENTS) + events);
    unsigned_integer longer =
        ((path ^ word) * (unsigned_integer)(PATH_FACTOR)) & (unsigned_integer)(0xffffffffu);
    return lanes_select(ray->active, longer, path);
}

// Returns the lanes whose color may be off by more than CERTIFIED_COLOR_ERROR, of which a 16th is reserved
// for the roundings of the sum.
static inline mask color_is_uncertain(Color3 color, real error)
{
    real largest = real_max(real_max(color.x, color.y), real_max(color.z, (real)(1)));
    return !(error <= (real)((1 - 0x1p-4f) * CERTIFIED_COLOR_ERROR) * largest);
}

// Traces a ray tree depth first, reflected before refracted, and returns its color. *shaded, an element of
// an array, holds the hit of the current ray. With `is_shaded` it holds the camera ray's at first, which
// rays_shade has traced with other packets. If COMPUTE_SIGNATURE, sets *path to the tree's signature
// (types.h), which in each lane is independent of the other lanes, and the color is undefined. At
// `certified` sets *uncertain to the lanes with any uncertain decision.
static inline Color3 ray_tree_color(const Scene *scene, Ray ray, bool is_shaded, ShadedHit *shaded,
                                    unsigned_integer *path, mask *uncertain)
{
    *uncertain = mask_none();
    *path = (unsigned_integer)(PATH_START);
    real color_error = (real)(0);
    const Color3 black = {(real)(0), (real)(0), (real)(0)}, white = {(real)(1), (real)(1), (real)(1)};
    Color3 color = black, weight = white;
    Medium medium = {black, black};
    Ray rays[1] = {ray};         // an array, or Mesa 22.3 crashes in compiling rays_shade's loops
    Bounce pending[PENDING_MAX]; // refracted rays, while the reflected ones are traced; one per depth
    uint pending_count = 0, depth = 0;
    for (;;) {
        if (depth > 0 || !is_shaded) rays_shade(scene, rays, 1, shaded);
        if (IS_CERTIFIED) *uncertain = *uncertain | (rays[0].active & shaded->uncertain);
        if (depth == 0) ray_counter_add(scene, RAYS_CAMERA_HITS, surface_found(&shaded->surface));
        // without secondary rays the color is the camera ray's and needs no weights
        if (!(HAS_REFLECTION || HAS_TRANSMISSION)) {
            if (COMPUTE_SIGNATURE)
                *path = path_signature_add(*path, rays, shaded->surface.object, mask_none(), mask_none(),
                                           mask_none());
            if (IS_CERTIFIED & !COMPUTE_SIGNATURE)
                *uncertain =
                    *uncertain | (rays[0].active & color_is_uncertain(shaded->color, shaded->color_error));
            return shaded->color;
        }
        mask found = surface_found(&shaded->surface);
        if (HAS_ABSORPTION) {
            if (lanes_any(found)) medium = medium_before(medium, &shaded->surface);
            weight = weight_absorbed(weight, &medium, found, shaded->t);
        }
        if (IS_CERTIFIED)
            color_error = real_fma(weight_largest(weight),
                                   lanes_select(rays[0].active, shaded->color_error, (real)(0)), color_error);
        color = color_add_weighted(color, weight, vector_select(rays[0].active, shaded->color, black));

        Bounce reflected = {rays[0].origin, rays[0].direction, black, depth + 1};
        Bounce refracted = reflected;
        mask total = mask_none();
        if (lanes_any(found) && depth < scene->header->bounces.x) {
            total = surface_bounce(&shaded->surface, vector_renormalize(rays[0].direction), weight, false,
                                   &reflected, &refracted);
            if (scene->header->sample.w > 0) {
                const real least = (real)(scene->header->sample.w);
                reflected.weight = weight_cut(reflected.weight, least, uncertain);
                refracted.weight = weight_cut(refracted.weight, least, uncertain);
            }
            if (IS_CERTIFIED)
                bounces_set_errors(&shaded->surface, rays, total, &reflected, &refracted, uncertain);
            if (HAS_ABSORPTION) {
                reflected.medium = medium;
                refracted.medium = medium_behind(medium, &shaded->surface);
            }
        }
        if (COMPUTE_SIGNATURE)
            *path = path_signature_add(*path, rays, shaded->surface.object, bounce_is_active(&reflected),
                                       bounce_is_active(&refracted), total);
        ray_counter_add(scene, RAYS_REFLECTED, bounce_is_active(&reflected));
        ray_counter_add(scene, RAYS_REFRACTED, bounce_is_active(&refracted));
        Bounce next = reflected;
        if (!lanes_any(bounce_is_active(&reflected)))
            next = refracted;
        else if (HAS_TRANSMISSION && lanes_any(bounce_is_active(&refracted)))
            pending[pending_count++] = refracted;
        if (!lanes_any(bounce_is_active(&next))) {
            if (pending_count == 0) break;
            next = pending[--pending_count];
        }
        rays[0] = bounce_ray(&next);
        weight = next.weight;
        if (HAS_ABSORPTION) medium = next.medium;
        depth = next.depth;
    }
    if (IS_CERTIFIED & !COMPUTE_SIGNATURE) *uncertain = *uncertain | color_is_uncertain(color, color_error);
    return color;
}

#endif
