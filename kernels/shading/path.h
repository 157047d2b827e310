// Traces the ray tree of a camera ray and computes its color, or the tree's signature if COMPUTE_SIGNATURE,
// which is defined as 0 or 1 before this file is included.
#ifndef PATH_H
#define PATH_H

#include "shading/certain_bounce.h"
#include "shading/decisions.h"
#include "shading/light_visibility.h"
#include "shading/medium.h"

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
    hit->surface.object = traversal->hit.object;
    const mask found = surface_found(&hit->surface);
    hit->color = background_color(scene, ray->direction, RAY_ACTIVE(ray) & !found);
    if (HAS_ABSORPTION) hit->t = traversal->hit.t;
    if (IS_CERTIFIED) {
        hit->uncertain = traversal->hit.uncertain;
        hit->color_error = HAS_SKY ? lanes_select(found, (real)(0), sky_color_error(scene, ray)) : (real)(0);
    }
    if (!lanes_any(found)) return false;
    hit->surface = visible_surface(scene, ray, &traversal->hit);
    if (IS_CERTIFIED) hit->uncertain = hit->uncertain | (found & hit->surface.uncertain);
    vector_replace(&hit->color, found, hit->surface.ambient);
    return true;
}

// Adds the contribution of a light to which a packet's shadow rays have been traced.
static inline void hit_add_light(const Scene *scene, uint index, LightVisibility *light,
                                 const Traversal *occlusion, ShadedHit *hit)
{
    const real strength = light->fraction; // before light_occlude changes it
    light_occlude(light, occlusion);
    if (IS_CERTIFIED) {
        // where the facing is uncertain, only highlights count
        const mask glossy = hit->surface.specular > 0, faint = light->facing_uncertain & !glossy;
        hit->uncertain = hit->uncertain | (light->uncertain & !faint) | (light->facing_uncertain & glossy);
        hit->color_error = hit->color_error +
                           lanes_select(light->lit | light->facing_uncertain, light->color_error, (real)(0));
    }
    const Color3 color = vector_of(scene->lights[index].color);
    const Color3 arriving = HAS_FILTERS
                                ? color_multiply(color, vector_scale(traversal_filter(occlusion), strength))
                                : vector_scale(color, light->fraction);
    const Color3 reflected = color_multiply(light->reflected, arriving);
    hit->color = vector_add(hit->color, vector_select(light->lit, reflected, color_gray((real)(0))));
}

// Traces those of `count` packets of rays that are in `packets`, given as bits.
static inline void packets_trace(Traversal *traversals, const Scene *scene, Ray *rays, uint count,
                                 uint packets, Query query)
{
    const uint near = packets_near(scene, rays, packets);
    uint in_bvh = 0;
    for (uint i = 0; i < count; i++)
        if (packets >> i & 1 && traversal_begin(&traversals[i], scene, &rays[i], query, near))
            in_bvh |= 1u << i;
    if (HAS_BVH) packets_traverse_bvh(traversals, scene, rays, in_bvh);
    for (uint i = 0; i < count && IS_CERTIFIED; i++)
        if (packets >> i & 1) traversal_classify(&traversals[i]);
}

// Traces `count` packets of rays and shades their hits, without lights if COMPUTE_SIGNATURE.
static OUT_OF_LINE void rays_shade(const Scene *scene, Ray *rays, uint count, TreeNode *nodes,
                                   ShadedHit *hits)
{
    Traversal traversals[PACKETS];
    Ray shadow_rays[PACKETS];
    LightVisibility lights[PACKETS];
    const uint light_count = COMPUTE_SIGNATURE ? 0 : scene->header->image.w;
    uint found = 0; // the packets that hit anything, as bits
    Replay replays[PACKETS];
    mask seen[PACKETS]; // the lanes that are known to see the light
    for (uint i = 0; i < count && REPLAYS_DECISIONS; i++)
        replay_begin(&replays[i], scene, &nodes[i], &rays[i]);
    packets_trace(traversals, scene, rays, count, (1u << count) - 1, CLOSEST_HIT);
    for (uint i = 0; i < count; i++) {
        if (REPLAYS_DECISIONS) replay_end(&replays[i], &rays[i], &traversals[i].hit);
        if (hit_shade(scene, &rays[i], &traversals[i], &hits[i])) found |= 1u << i;
        if (RECORDS_DECISIONS) node_set_hit(&nodes[i], &rays[i], hits[i].surface.object, hits[i].uncertain);
    }
    for (uint light = 0; found != 0 && light < light_count; light++) {
        for (uint i = 0; i < count; i++) {
            if (!(found >> i & 1)) continue;
            lights[i] = light_reach(scene, &hits[i].surface, light, &shadow_rays[i]);
            if (REPLAYS_DECISIONS) seen[i] = replay_light(&nodes[i], light, &shadow_rays[i]);
        }
        packets_trace(traversals, scene, shadow_rays, count, found, OCCLUSION);
        for (uint i = 0; i < count; i++) {
            if (!(found >> i & 1)) continue;
            if (REPLAYS_DECISIONS) traversals[i].active = traversals[i].active | seen[i];
            if (RECORDS_DECISIONS) node_set_light(&nodes[i], light, &shadow_rays[i], &traversals[i]);
            hit_add_light(scene, light, &lights[i], &traversals[i], &hits[i]);
        }
    }
}

// Adds a ray's hit and its bounces to the signature.
static inline unsigned_integer path_signature_add(unsigned_integer path, const Ray *ray, integer object,
                                                  const Bounces *bounces)
{
    const integer none = (integer)(0);
    const mask reflected = bounce_is_active(&bounces->reflected),
               refracted = bounce_is_active(&bounces->refracted);
    integer events = lanes_select(reflected, (integer)(PATH_REFLECTED), none) |
                     lanes_select(refracted, (integer)(PATH_REFRACTED), none) |
                     lanes_select(reflected & bounces->total, (integer)(PATH_TOTAL_REFLECTION), none);
    unsigned_integer word = unsigned_from_integer(object + (integer)(1)) * (unsigned_integer)(PATH_EVENTS) +
                            unsigned_from_integer(events);
    unsigned_integer longer =
        ((path ^ word) * (unsigned_integer)(PATH_FACTOR)) & (unsigned_integer)(0xffffffffu);
    return lanes_select(ray->active, longer, path);
}

// The part of CERTIFIED_COLOR_ERROR that the bounds may reach. The remainder is for the roundings of the sum.
#define COLOR_ERROR_PART (1 - 0x1p-4f)

// Returns the lanes whose color may be off by more than CERTIFIED_COLOR_ERROR.
static inline mask color_is_uncertain(Color3 color, real error)
{
    real largest = real_max(color_largest(color), (real)(1));
    return !(error <= (real)(COLOR_ERROR_PART * CERTIFIED_COLOR_ERROR) * largest);
}

// Sets the bounces of a ray at its hit. `traced` is the bounce that the ray was made from. Adds the lanes
// where they are uncertain to *uncertain.
static inline void hit_set_bounces(const Scene *scene, const Ray *ray, const Surface *surface,
                                   const Bounce *traced, Bounces *bounces, mask *uncertain)
{
    surface_set_bounces(surface, vector_renormalize(ray->direction), traced->weight, false, bounces);
    if (scene->header->sample.w > 0) {
        const real least = (real)(scene->header->sample.w);
        bounces->reflected.weight = weight_cut(bounces->reflected.weight, least, uncertain);
        bounces->refracted.weight = weight_cut(bounces->refracted.weight, least, uncertain);
    }
    if (IS_CERTIFIED) bounces_set_errors(surface, ray, bounces, uncertain);
    if (HAS_ABSORPTION) {
        bounces->reflected.medium = traced->medium;
        bounces->refracted.medium = medium_behind(traced->medium, surface);
    }
}

// A refracted ray that waits while the reflected one is traced. A GPU may reserve memory for PENDING_MAX of
// them in each thread, so this has only what every kernel needs of a Bounce.
typedef struct {
    Vector origin, direction;
    Color3 weight;
    uint depth;
} PendingRay;

// Traces a ray tree depth first, reflected before refracted, and returns its color. *node and *shaded,
// elements of arrays, hold the current ray's node and hit; *node is the root's at first. With `is_shaded` it
// holds the camera ray's at first, which rays_shade has traced with other packets. If COMPUTE_SIGNATURE, sets
// *path to the tree's signature (types.h), which in each lane is independent of the other lanes, and the
// color is undefined. At `certified` sets *uncertain to the lanes with any uncertain decision.
static inline Color3 ray_tree_color(const Scene *scene, Ray ray, bool is_shaded, TreeNode *node,
                                    ShadedHit *shaded, unsigned_integer *path, mask *uncertain)
{
    const Color3 black = color_gray((real)(0));
    *uncertain = mask_none();
    *path = (unsigned_integer)(PATH_START);
    Color3 color = black;
    real color_error = (real)(0);
    Bounce traced = {ray.origin, ray.direction, color_gray((real)(1)), 0};
    if (HAS_ABSORPTION) traced.medium = (Medium){black, black};
    Ray rays[1] = {ray}; // an array, or Mesa 22.3 crashes in compiling rays_shade's loops
    // Refracted rays, while the reflected ones are traced; one per depth. Compilers drop arrays that a kernel
    // does not read.
    PendingRay pending[PENDING_MAX];
    real travelled[PENDING_MAX];
    Sample samples[PENDING_MAX];
    Medium media[PENDING_MAX];
    CertainBounce certain[PENDING_MAX];
    uint pending_count = 0;
    for (;;) {
        if (traced.depth > 0 || !is_shaded) rays_shade(scene, rays, 1, node, shaded);
        const mask active = rays[0].active, found = surface_found(&shaded->surface);
        if (IS_CERTIFIED) *uncertain = *uncertain | (active & shaded->uncertain);
        if (traced.depth == 0) ray_counter_add(scene, RAYS_CAMERA_HITS, found);
        Bounces bounces = bounces_none(&rays[0], traced.depth + 1);
        // without secondary rays the color is the camera ray's and needs no weights
        if (!(HAS_REFLECTION || HAS_TRANSMISSION)) {
            if (COMPUTE_SIGNATURE) *path = path_signature_add(*path, rays, shaded->surface.object, &bounces);
            color = shaded->color;
            if (IS_CERTIFIED) color_error = shaded->color_error;
            break;
        }
        if (HAS_ABSORPTION) {
            if (lanes_any(found)) traced.medium = medium_before(traced.medium, &shaded->surface);
            traced.weight = weight_absorbed(traced.weight, &traced.medium, found, shaded->t);
        }
        const Color3 shown = vector_select(active, shaded->color, black);
        color = color_add_weighted(color, traced.weight, shown);
        if (IS_CERTIFIED)
            color_error = real_fma(weight_largest(traced.weight),
                                   lanes_select(active, shaded->color_error, (real)(0)), color_error);

        if (lanes_any(found) && traced.depth < scene->header->bounces.x)
            hit_set_bounces(scene, rays, &shaded->surface, &traced, &bounces, uncertain);
        if (COMPUTE_SIGNATURE) *path = path_signature_add(*path, rays, shaded->surface.object, &bounces);
        if (HAS_DECISIONS) bounces_set_nodes(&bounces, node);
        if (RECORDS_DECISIONS) node_store(node, &bounces);
        const mask reflects = bounce_is_active(&bounces.reflected),
                   refracts = bounce_is_active(&bounces.refracted);
        ray_counter_add(scene, RAYS_REFLECTED, reflects);
        ray_counter_add(scene, RAYS_REFRACTED, refracts);
        if (lanes_any(reflects)) {
            if (HAS_TRANSMISSION && lanes_any(refracts)) {
                const Bounce *refracted = &bounces.refracted;
                pending[pending_count] = (PendingRay){refracted->origin, refracted->direction,
                                                      refracted->weight, refracted->depth};
                travelled[pending_count] = refracted->travelled;
                samples[pending_count] = refracted->sample;
                media[pending_count] = refracted->medium;
                certain[pending_count++] = refracted->certain;
            }
            traced = bounces.reflected;
        } else if (lanes_any(refracts)) {
            traced = bounces.refracted;
        } else {
            if (pending_count == 0) break;
            const PendingRay last = pending[--pending_count];
            traced = (Bounce){last.origin, last.direction, last.weight, last.depth};
            if (HAS_IMAGES) traced.travelled = travelled[pending_count];
            if (HAS_AREA_LIGHTS) traced.sample = samples[pending_count];
            if (HAS_ABSORPTION) traced.medium = media[pending_count];
            if (IS_CERTIFIED) traced.certain = certain[pending_count];
        }
        rays[0] = bounce_ray(&traced);
        if (HAS_DECISIONS) node_set_bounce(node, &traced);
    }
    if (IS_CERTIFIED & !COMPUTE_SIGNATURE)
        *uncertain = *uncertain | (ray.active & color_is_uncertain(color, color_error));
    return color;
}

#endif
