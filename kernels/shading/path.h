// The ray tree of a camera ray, and its color. COMPUTE_SIGNATURE, defined as 0 or 1 before this file is
// included, asks for the tree's signature instead of the color.
#ifndef PATH_H
#define PATH_H

#include "shading/bounce.h"
#include "shading/phong.h"

// What a packet of rays sees.
typedef struct {
    Hit hit;
    Surface surface; // where any lane hit one
    Color3 color;    // without reflection and refraction; the background's where nothing was hit
} Seen;

// Adds each light that reaches the surfaces of `count` packets.
static inline void surfaces_light(const Scene *scene, uint count, Seen *seen)
{
    Ray shadow_rays[PACKETS];
    LightVisibility lights[PACKETS];
    Traversal traversals[PACKETS];
    for (uint index = 0; index < scene->header->image.w; index++) {
        for (uint i = 0; i < count; i++) {
            shadow_rays[i].active = lights[i].lit = mask_none();
            if (lanes_any(hit_found(&seen[i].hit)))
                lights[i] = light_reach(scene, &seen[i].surface, index, &shadow_rays[i]);
        }
        scene_traverse(scene, shadow_rays, count, OCCLUSION, traversals);
        for (uint i = 0; i < count; i++) {
            if (!lanes_any(lights[i].lit)) continue;
            light_occlude(&lights[i], traversal_transmittance(&traversals[i]));
            if (!lanes_any(lights[i].lit)) continue;
            Color3 reflected = phong_shade(scene, &seen[i].surface, &lights[i], index);
            seen[i].color = vector_add(seen[i].color, reflected);
        }
    }
}

// The surfaces that `count` packets of rays hit, and their colors; no colors if COMPUTE_SIGNATURE.
static OUT_OF_LINE void rays_see(const Scene *scene, Ray *rays, uint count, Seen *seen)
{
    Traversal traversals[PACKETS];
    scene_traverse(scene, rays, count, CLOSEST_HIT, traversals);
    Color3 background = vector_of(scene->header->background);
    for (uint i = 0; i < count; i++) {
        seen[i].hit = traversals[i].hit;
        mask found = hit_found(&seen[i].hit);
        seen[i].color = background;
        if (!lanes_any(found)) continue;
        seen[i].surface = visible_surface(scene, &rays[i], &seen[i].hit);
        const Surface *surface = &seen[i].surface;
        Color3 ambient = vector_scale(vector_of(scene->header->ambient), surface->ambient);
        seen[i].color = color_multiply(ambient, surface->color);
    }
    if (COMPUTE_SIGNATURE) return;
    surfaces_light(scene, count, seen);
    for (uint i = 0; i < count; i++)
        seen[i].color = vector_select(hit_found(&seen[i].hit), seen[i].color, background);
}

// The same of camera rays, for ray_tree_color. A lone packet's are left to it, whose loop then has the only
// copy of the search.
static inline void camera_rays_see(const Scene *scene, Ray *rays, uint count, Seen *seen)
{
    if (PACKETS > 1) rays_see(scene, rays, count, seen);
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

// Traces a ray tree depth first, reflected before refracted, from what camera_rays_see left in *seen. If
// COMPUTE_SIGNATURE, *path is its signature (types.h), which in each lane is independent of the other lanes,
// and the color is undefined.
static inline Color3 ray_tree_color(const Scene *scene, Ray ray, Seen *seen, unsigned_integer *path)
{
    *path = (unsigned_integer)(PATH_START);
    const Color3 black = {(real)(0), (real)(0), (real)(0)}, white = {(real)(1), (real)(1), (real)(1)};
    Color3 color = black, weight = white;
    Bounce pending[PENDING_MAX]; // refracted rays, while the reflected ones are traced; one per depth
    uint pending_count = 0, depth = 0;
    for (;;) {
        if (PACKETS == 1 || depth > 0) rays_see(scene, &ray, 1, seen);
        if (depth == 0) ray_counter_add(scene, RAYS_CAMERA_HITS, hit_found(&seen->hit));
        // without secondary rays the color is that of the camera ray: no weights
        if (!(HAS_REFLECTION || HAS_TRANSMISSION)) {
            if (COMPUTE_SIGNATURE)
                *path = path_signature_add(*path, &ray, &seen->hit, mask_none(), mask_none(), mask_none());
            return seen->color;
        }
        color = color_add_weighted(color, weight, vector_select(ray.active, seen->color, black));

        Bounce reflected = {ray.origin, ray.direction, black, depth + 1, ray.travelled};
        Bounce refracted = reflected;
        mask total = mask_none();
        if (lanes_any(hit_found(&seen->hit)) && depth < scene->header->bounces.x)
            total = surface_bounce(&seen->surface, vector_renormalize(ray.direction), weight, false,
                                   &reflected, &refracted);
        if (COMPUTE_SIGNATURE)
            *path = path_signature_add(*path, &ray, &seen->hit, bounce_is_active(&reflected),
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
