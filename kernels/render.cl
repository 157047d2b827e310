// The picture: each work-item traces the rays of one tile of pixels.
#include "film.h"
#include "phong.h"

static inline Color3 ray_color(const Scene *scene, const Ray *ray)
{
    Hit hit = closest_hit(scene, ray);
    Color3 background = vector_of(scene->header->background);
    if (!lanes_any(hit_found(&hit))) return background;

    Surface surface = surface_at(scene, ray, &hit);
    Color3 ambient = vector_of(scene->header->ambient);
    Color3 color = {ambient.x * surface.ambient * surface.color.x, ambient.y * surface.ambient * surface.color.y,
                    ambient.z * surface.ambient * surface.color.z};
    for (uint i = 0; i < scene->header->picture.w; i++) {
        mask shadowed;
        color = vector_add(color, phong_light(scene, &surface, ray, i, &shadowed));
    }
    return vector_select(surface.found, color, background);
}

// Adds samples first..last-1 to the band's film; the last of all turns the sum into the mean. `offsets` has each
// sample's place in its pixel, from -1 to 1.
kernel void render(SCENE_ARGUMENTS, global const scalar *offsets, global scalar *film, uint4 band_pixels,
                   uint first_sample, uint last_sample)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    SceneHeader frame = *header;
    Band band = {band_pixels.x, band_pixels.y, band_pixels.z, band_pixels.w};
    Tile tile = band_tile(&band);
    if (!lanes_any(tile.inside)) return;

    Color3 sum = {(real)(0), (real)(0), (real)(0)};
    if (first_sample > 0) sum = film_load_color(film, &tile);
    for (uint sample = first_sample; sample < last_sample; sample++) {
        Ray ray = camera_ray(&frame, tile.pixels, offsets[2 * sample], offsets[2 * sample + 1], tile.inside);
        sum = vector_add(sum, ray_color(&scene, &ray));
    }
    uint count = frame.picture.z;
    if (count > 1 && last_sample == count) {
        real divisor = (real)((scalar)count);
        sum = (Color3){real_divide(sum.x, divisor), real_divide(sum.y, divisor), real_divide(sum.z, divisor)};
    }
    film_store_color(film, &tile, sum);
}
