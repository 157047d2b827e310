// The picture: each work-item traces the rays of one tile of pixels.
#include "bounce.h"
#include "film.h"
#include "phong.h"

// What a surface shows by itself: ambient light and each light that reaches it.
static inline Color3 surface_color(const Scene *scene, const Surface *surface, const Ray *ray)
{
    Color3 ambient = vector_scale(vector_of(scene->header->ambient), surface->ambient);
    Color3 color = color_multiply(ambient, surface->color);
    for (uint i = 0; i < scene->header->picture.w; i++) {
        mask shadowed;
        color = vector_add(color, phong_light(scene, surface, ray, i, &shadowed));
    }
    return color;
}

// Follows a ray and all that it becomes.
static inline Color3 ray_color(const Scene *scene, Ray ray)
{
    const Color3 black = {(real)(0), (real)(0), (real)(0)}, white = {(real)(1), (real)(1), (real)(1)};
    Color3 background = vector_of(scene->header->background);
    Color3 color = black, weight = white;
    Bounce waiting[HAS_TRANSMISSION ? BOUNCES_LARGEST : 1];
    uint waiting_count = 0, depth = 0;
    for (;;) {
        Hit hit = closest_hit(scene, &ray);
        Surface surface;
        surface.found = hit_found(&hit);
        if (depth == 0) rays_count(scene, RAYS_CAMERA_HITS, surface.found);
        Color3 seen = background;
        bool any_found = lanes_any(surface.found);
        if (any_found) {
            surface = surface_at(scene, &ray, &hit);
            seen = vector_select(surface.found, surface_color(scene, &surface, &ray), background);
        }
        if (!(HAS_REFLECTION || HAS_TRANSMISSION)) return seen;
        color = color_add_weighted(color, weight, vector_select(ray.active, seen, black));

        Bounce next = {ray.origin, ray.direction, black, depth + 1, ray.travelled}, other = next;
        if (any_found && depth < scene->header->bounces.x)
            surface_bounce(&surface, &ray, weight, &next, &other);
        rays_count(scene, RAYS_REFLECTED, bounce_counts(&next));
        rays_count(scene, RAYS_REFRACTED, bounce_counts(&other));
        if (!lanes_any(bounce_counts(&next))) {
            next = other;
        } else if (HAS_TRANSMISSION && lanes_any(bounce_counts(&other))) {
            waiting[waiting_count++] = other;
        }
        if (!lanes_any(bounce_counts(&next))) {
            if (waiting_count == 0) return color;
            next = waiting[--waiting_count];
        }
        ray = bounce_ray(&next);
        weight = next.weight;
        depth = next.depth;
    }
}

// Adds samples first..last-1 to the band's film; the last of all turns the sum into the mean. `offsets` has
// each sample's place in its pixel, from -1 to 1. What each addition loses is carried to the next, in
// `losses` from launch to launch (Kahan, Further remarks on reducing truncation errors, CACM 8(1), 1965): a
// plain sum of a million equal samples would be off by 1 %.
kernel void render(SCENE_ARGUMENTS, global const scalar *offsets, global scalar *film, global scalar *losses,
                   uint4 band_pixels, uint first_sample, uint last_sample, global uint *ray_counts)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    scene.ray_counts = ray_counts;
    Band band = {band_pixels.x, band_pixels.y, band_pixels.z, band_pixels.w};
    Tile tile = band_tile(&band);
    if (!lanes_any(tile.inside)) return;

    Color3 sum = {(real)(0), (real)(0), (real)(0)}, lost = sum;
    if (first_sample > 0) {
        sum = film_load_color(film, &tile);
        lost = film_load_color(losses, &tile);
    }
    for (uint sample = first_sample; sample < last_sample; sample++) {
        Ray ray = camera_ray(header, tile.pixels, offsets[2 * sample], offsets[2 * sample + 1], tile.inside);
        rays_count(&scene, RAYS_CAMERA, ray.active);
        Color3 color = vector_subtract(ray_color(&scene, ray), lost);
        Color3 next = vector_add(sum, color);
        lost = vector_subtract(vector_subtract(next, sum), color);
        sum = next;
    }
    uint count = header->picture.z;
    if (last_sample < count) film_store_color(losses, &tile, lost);
    if (count > 1 && last_sample == count) {
        real divisor = (real)((scalar)count);
        sum = (Color3){real_divide(sum.x, divisor), real_divide(sum.y, divisor), real_divide(sum.z, divisor)};
    }
    film_store_color(film, &tile, sum);
}
