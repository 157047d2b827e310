// The image: each work-item renders its tiles of pixels in turn.
#define COMPUTE_SIGNATURE 0
#include "film.h"
#include "shading/path.h"

// Adds samples first_sample .. last_sample - 1 to the film; the last launch divides the sum by the number of
// samples. `offsets`: x and y of each sample in its pixel, -1 to 1. `compensation`: the rounding error of the
// sum, compensated in the next addition and kept between launches (Kahan, Further remarks on reducing
// truncation errors, CACM 8(1), 1965): a plain sum of a million equal samples would be off by 1 %.
static KERNEL_BODY void tile_render(const Scene *scene, const Tile *tile, global const scalar *offsets,
                                    global scalar *film, global scalar *compensation, uint first_sample,
                                    uint last_sample)
{
    Color3 sum = {(real)(0), (real)(0), (real)(0)}, lost = sum;
    if (first_sample > 0) {
        sum = film_load_color(film, tile);
        lost = film_load_color(compensation, tile);
    }
    for (uint sample = first_sample; sample < last_sample; sample++) {
        Ray ray = camera_ray(scene->header, tile->pixels, offsets[2 * sample], offsets[2 * sample + 1],
                             tile->inside);
        ray_counter_add(scene, RAYS_CAMERA, ray.active);
        unsigned_integer path;
        Color3 color = vector_subtract(ray_color(scene, ray, &path), lost);
        Color3 next = vector_add(sum, color);
        lost = vector_subtract(vector_subtract(next, sum), color);
        sum = next;
    }
    uint count = scene->header->image.z;
    if (last_sample < count) film_store_color(compensation, tile, lost);
    if (count > 1 && last_sample == count) {
        real divisor = (real)((scalar)count);
        sum = (Color3){real_divide(sum.x, divisor), real_divide(sum.y, divisor), real_divide(sum.z, divisor)};
    }
    film_store_color(film, tile, sum);
}

kernel void render(SCENE_ARGUMENTS, global const scalar *offsets, global scalar *film,
                   global scalar *compensation, uint4 band_pixels, uint first_sample, uint last_sample,
                   global uint *ray_counts)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    scene.ray_counts = ray_counts;
    Band band = {band_pixels.x, band_pixels.y, band_pixels.z, band_pixels.w};
    for (uint i = 0; i < ITEM_TILES; i++) {
        Tile tile = band_tile(&band, i);
        if (lanes_any(tile.inside))
            tile_render(&scene, &tile, offsets, film, compensation, first_sample, last_sample);
    }
}
