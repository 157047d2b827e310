// The ray tree of a camera ray, and its color. COMPUTE_SIGNATURE, defined as 0 or 1 before this file is
// included, asks for the tree's signature instead of the color.
#ifndef PATH_H
#define PATH_H

#include "shading/bounce.h"
#include "shading/phong.h"

// Ambient light and each light that reaches the surface, without reflection and refraction.
static inline Color3 surface_color(const Scene *scene, const Surface *surface)
{
    Color3 ambient = vector_scale(vector_of(scene->header->ambient), surface->ambient);
    Color3 color = color_multiply(ambient, surface->color);
    for (uint i = 0; i < scene->header->image.w; i++)
        color = vector_add(color, phong_shade(scene, surface, i));
    return color;
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

// Traces a ray tree depth first, reflected before refracted. If COMPUTE_SIGNATURE, *path is its signature
// (types.h), which in each lane is independent of the other lanes, and the color is undefined.
static inline Color3 ray_color(const Scene *scene, Ray ray, unsigned_integer *path)
{
    *path = (unsigned_integer)(PATH_START);
    const Color3 black = {(real)(0), (real)(0), (real)(0)}, white = {(real)(1), (real)(1), (real)(1)};
    Color3 background = vector_of(scene->header->background);
    Color3 color = black, weight = white;
    Bounce pending[PENDING_MAX]; // refracted rays, while the reflected ones are traced; one per depth
    uint pending_count = 0, depth = 0;
    for (;;) {
        Hit hit = closest_hit(scene, &ray);
        Surface surface;
        surface.found = hit_found(&hit);
        if (depth == 0) ray_counter_add(scene, RAYS_CAMERA_HITS, surface.found);
        Color3 seen = background;
        bool any_found = lanes_any(surface.found);
        if (any_found) {
            surface = visible_surface(scene, &ray, &hit);
            if (!COMPUTE_SIGNATURE)
                seen = vector_select(surface.found, surface_color(scene, &surface), background);
        }
        // without secondary rays the color is that of the camera ray: no weights
        if (!(HAS_REFLECTION || HAS_TRANSMISSION)) {
            if (COMPUTE_SIGNATURE)
                *path = path_signature_add(*path, &ray, &hit, mask_none(), mask_none(), mask_none());
            return seen;
        }
        color = color_add_weighted(color, weight, vector_select(ray.active, seen, black));

        Bounce reflected = {ray.origin, ray.direction, black, depth + 1, ray.travelled};
        Bounce refracted = reflected;
        mask total = mask_none();
        if (any_found && depth < scene->header->bounces.x)
            total = surface_bounce(&surface, vector_renormalize(ray.direction), weight, false, &reflected,
                                   &refracted);
        if (COMPUTE_SIGNATURE)
            *path = path_signature_add(*path, &ray, &hit, bounce_is_active(&reflected),
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
