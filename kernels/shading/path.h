// The ray tree of a camera ray, and its color. COMPUTE_SIGNATURE, defined as 0 or 1 before this file is
// included, asks for the tree's signature instead of the color.
#ifndef PATH_H
#define PATH_H

#include "shading/bounce.h"
#include "shading/phong.h"

// The hits of a packet of rays, shaded.
typedef struct {
    Hit hit;
    Surface surface; // undefined if no lane hit any
    Color3 color;    // without reflection and refraction; the background's where nothing was hit
    mask doubt;      // at `certified`: lanes in doubt about any of this
} ShadedHit;

// Adds each light that reaches the surfaces of `count` packets.
static inline void surfaces_light(const Scene *scene, uint count, ShadedHit *hits)
{
    Ray shadow_rays[PACKETS];
    LightVisibility lights[PACKETS];
    Traversal traversals[PACKETS];
    for (uint index = 0; index < scene->header->image.w; index++) {
        for (uint i = 0; i < count; i++) {
            shadow_rays[i].active = lights[i].lit = mask_none();
            shadow_rays[i].tmax = (real)(0);
            if (lanes_any(hit_found(&hits[i].hit)))
                lights[i] = light_reach(scene, &hits[i].surface, index, &shadow_rays[i]);
        }
        scene_traverse(scene, shadow_rays, count, OCCLUSION, traversals);
        for (uint i = 0; i < count; i++) {
            if (IS_CERTIFIED && lanes_any(hit_found(&hits[i].hit))) {
                const Surface *surface = &hits[i].surface;
                mask glossy = surface->specular > (real)(0);
                light_add_doubt(&lights[i], &traversals[i].hit);
                mask matters = glossy | !lights[i].facing_doubt;
                hits[i].doubt =
                    hits[i].doubt | (lights[i].doubt & matters) | (lights[i].facing_doubt & glossy);
            }
            if (!lanes_any(lights[i].lit)) continue;
            light_occlude(&lights[i], traversal_transmittance(&traversals[i]));
            if (!lanes_any(lights[i].lit)) continue;
            Color3 reflected = phong_shade(scene, &hits[i].surface, &lights[i], index);
            hits[i].color = vector_add(hits[i].color, reflected);
        }
    }
}

// Traces `count` packets of rays and shades their hits; no colors if COMPUTE_SIGNATURE.
static OUT_OF_LINE void rays_shade(const Scene *scene, Ray *rays, uint count, ShadedHit *hits)
{
    Traversal traversals[PACKETS];
    scene_traverse(scene, rays, count, CLOSEST_HIT, traversals);
    Color3 background = vector_of(scene->header->background);
    for (uint i = 0; i < count; i++) {
        hits[i].hit = traversals[i].hit;
        mask found = hit_found(&hits[i].hit);
        hits[i].color = background;
        if (IS_CERTIFIED) hits[i].doubt = hits[i].hit.doubt;
        if (!lanes_any(found)) continue;
        hits[i].surface = visible_surface(scene, &rays[i], &hits[i].hit);
        const Surface *surface = &hits[i].surface;
        if (IS_CERTIFIED) hits[i].doubt = hits[i].doubt | (found & surface->doubt);
        Color3 ambient = vector_scale(vector_of(scene->header->ambient), surface->ambient);
        hits[i].color = color_multiply(ambient, surface->color);
    }
    if (COMPUTE_SIGNATURE) return;
    surfaces_light(scene, count, hits);
    for (uint i = 0; i < count; i++)
        hits[i].color = vector_select(hit_found(&hits[i].hit), hits[i].color, background);
}

// Adds a ray's hit and its bounces to the signature.
static inline unsigned_integer path_signature_add(unsigned_integer path, const Ray *ray, const Hit *hit,
                                                  mask reflected, mask refracted, mask total)
{
    const integer none = (integer)(0);
    integer events = lanes_select(reflected, (integer)(PATH_REFLECTED), none) |
                     lanes_select(refracted, (integer)(PATH_REFRACTED), none) |
                     lanes_select(reflected & total, (integer)(PATH_TOTAL_REFLECTION), none);
    unsigned_integer word =
        unsigned_from_integer((hit->object + (integer)(1)) * (integer)(PATH_EVENTS) + events);
    unsigned_integer longer =
        ((path ^ word) * (unsigned_integer)(PATH_FACTOR)) & (unsigned_integer)(0xffffffffu);
    return lanes_select(ray->active, longer, path);
}

// Traces a ray tree depth first, reflected before refracted. `is_shaded`: *shaded is the camera ray's hit,
// from rays_shade; otherwise the loop traces it, whose traversal is then compiled once. If COMPUTE_SIGNATURE,
// *path is the tree's signature (types.h), which in each lane is independent of the other lanes, and the
// color is undefined. At `certified` *doubt are the lanes with any decision in doubt.
static inline Color3 ray_tree_color(const Scene *scene, Ray ray, bool is_shaded, ShadedHit *shaded,
                                    unsigned_integer *path, mask *doubt)
{
    *doubt = mask_none();
    *path = (unsigned_integer)(PATH_START);
    const Color3 black = {(real)(0), (real)(0), (real)(0)}, white = {(real)(1), (real)(1), (real)(1)};
    Color3 color = black, weight = white;
    Bounce pending[PENDING_MAX]; // refracted rays, while the reflected ones are traced; one per depth
    uint pending_count = 0, depth = 0;
    for (;;) {
        if (depth > 0 || !is_shaded) rays_shade(scene, &ray, 1, shaded);
        if (IS_CERTIFIED) *doubt = *doubt | (ray.active & shaded->doubt);
        if (depth == 0) ray_counter_add(scene, RAYS_CAMERA_HITS, hit_found(&shaded->hit));
        // without secondary rays the color is that of the camera ray: no weights
        if (!(HAS_REFLECTION || HAS_TRANSMISSION)) {
            if (COMPUTE_SIGNATURE)
                *path = path_signature_add(*path, &ray, &shaded->hit, mask_none(), mask_none(), mask_none());
            return shaded->color;
        }
        color = color_add_weighted(color, weight, vector_select(ray.active, shaded->color, black));

        Bounce reflected = {ray.origin, ray.direction, black, depth + 1, ray.travelled};
        Bounce refracted = reflected;
        mask total = mask_none();
        if (lanes_any(hit_found(&shaded->hit)) && depth < scene->header->bounces.x)
            total = surface_bounce(&shaded->surface, vector_renormalize(ray.direction), weight, false,
                                   &reflected, &refracted);
        if (IS_CERTIFIED && lanes_any(hit_found(&shaded->hit)) && depth < scene->header->bounces.x)
            bounces_set_errors(&shaded->surface, &ray, total, &reflected, &refracted, doubt);
        if (COMPUTE_SIGNATURE)
            *path = path_signature_add(*path, &ray, &shaded->hit, bounce_is_active(&reflected),
                                       bounce_is_active(&refracted), total);
        ray_counter_add(scene, RAYS_REFLECTED, bounce_is_active(&reflected));
        ray_counter_add(scene, RAYS_REFRACTED, bounce_is_active(&refracted));
        Bounce next = reflected;
        if (!lanes_any(bounce_is_active(&reflected)))
            next = refracted;
        else if (HAS_TRANSMISSION && lanes_any(bounce_is_active(&refracted)))
            pending[pending_count++] = refracted;
        if (!lanes_any(bounce_is_active(&next))) {
            if (pending_count == 0) return color;
            next = pending[--pending_count];
        }
        ray = bounce_ray(&next);
        weight = next.weight;
        depth = next.depth;
    }
}

#endif
