// Computes the fraction of each pixel that objects cover, and the background's light in the remainder.
#include "film.h"
#include "shading/sky.h"
#include "traversal/traversal.h"

static OUT_OF_LINE void tile_coverage(const Scene *scene, const Tile *tile, global const scalar *offsets,
                                      global scalar *coverage, global scalar *backdrop, global int *flags)
{
    const uint count = scene->header->image.z;
    const real one = (real)(1), zero = (real)(0), divisor = (real)((scalar)count);
    real covered = zero;
    const Vector black = {zero, zero, zero};
    Vector light = black, lost = black;
    for (uint sample = 0; sample < count; sample++) {
        Ray ray = camera_ray(scene->header, tile->pixels, offsets[2 * sample], offsets[2 * sample + 1],
                             sample, tile->inside);
        Hit hit = closest_hit(scene, &ray);
        if (IS_CERTIFIED) film_flag_pixels(flags, tile, hit.uncertain, sample == 0);
        const mask found = hit_found(&hit);
        covered = covered + lanes_select(found, one, zero);
        Vector seen = background_color(scene, ray.direction, ray.active & !found);
        compensated_add(&light, &lost, vector_select(found, black, seen));
    }
    film_store(coverage, tile, 1, 0, real_divide(covered, divisor));
    film_store_vector(backdrop, tile, color_divide(light, divisor));
}

kernel void coverage(SCENE_ARGUMENTS, uint4 band_pixels, global char *film, LayerOffsets layers,
                     global int *flags, global const scalar *sample_offsets)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    global scalar *covered = LAYER_AT(film, layers, coverage, REAL);
    global scalar *backdrop = LAYER_AT(film, layers, backdrop, REAL);
    Band band = band_of(band_pixels, 1, flags);
    for (uint i = 0; i < TILES; i++) {
        Tile tile = band_tile(&band, i);
        if (lanes_any(tile.inside)) tile_coverage(&scene, &tile, sample_offsets, covered, backdrop, flags);
    }
}
