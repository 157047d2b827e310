// Renders the image. Each work-item renders a macro-tile, PACKETS of its packets at a time.
#define COMPUTE_SIGNATURE 0
#include "film.h"
#include "shading/path.h"

// Adds samples first_sample .. last_sample - 1 of tiles first_tile .. first_tile + PACKETS - 1 to the film.
// The last launch divides the sum by the number of samples. `offsets` has x and y of each sample in its
// pixel, -1 to 1. `compensation` keeps the rounding error of the sum between launches. The colors of a list
// also go to `band_film`, unless it is NULL.
static OUT_OF_LINE void tiles_render(const Scene *scene, const Band *band, uint first_tile,
                                     global const scalar *offsets, global scalar *film,
                                     global scalar *compensation, uint first_sample, uint last_sample,
                                     global int *flags, global float *band_film, const Records *records)
{
    Tile tiles[PACKETS];
    Ray rays[PACKETS];
    ShadedHit hits[PACKETS];
    TreeNode nodes[PACKETS];
    Color3 sums[PACKETS], lost[PACKETS];
    const uint count = scene->header->image.z;
    for (uint i = 0; i < PACKETS; i++) {
        tiles[i] = band_tile(band, first_tile + i);
        if (count == 1) continue;
        sums[i] = lost[i] = (Color3){(real)(0), (real)(0), (real)(0)};
        if (first_sample > 0) {
            sums[i] = film_load_color(film, &tiles[i]);
            lost[i] = film_load_color(compensation, &tiles[i]);
        }
    }
    for (uint sample = first_sample; sample < last_sample; sample++) {
        for (uint i = 0; i < PACKETS; i++) {
            rays[i] = camera_ray(scene->header, tiles[i].pixels, offsets[2 * sample], offsets[2 * sample + 1],
                                 sample, tiles[i].inside);
            ray_counter_add(scene, RAYS_CAMERA, rays[i].active);
            nodes[i] = tree_root(records, sample, tile_slots(&tiles[i]), tiles[i].inside);
        }
        if (PACKETS > 1) rays_shade(scene, rays, PACKETS, nodes, hits);
        for (uint i = 0; i < PACKETS; i++) {
            if (!lanes_any(tiles[i].inside)) continue;
            unsigned_integer path;
            mask uncertain;
            Color3 traced =
                ray_tree_color(scene, rays[i], PACKETS > 1, &nodes[i], &hits[i], &path, &uncertain);
            if (IS_CERTIFIED) film_flag_pixels(flags, &tiles[i], uncertain, sample == 0);
            if (count == 1) {
                sums[i] = traced;
                continue;
            }
            compensated_add(&sums[i], &lost[i], traced);
        }
    }
    if (last_sample < count) film_store_tiles(compensation, tiles, lost);
    for (uint i = 0; i < PACKETS && count > 1 && last_sample == count; i++) {
        real divisor = (real)((scalar)count);
        sums[i] = color_divide(sums[i], divisor);
    }
    film_store_tiles(film, tiles, sums);
    for (uint i = 0; i < PACKETS && IS_PIXEL_LIST && band_film && last_sample == count; i++)
        film_merge(band_film, band, &tiles[i], sums[i]);
}

kernel void render(SCENE_ARGUMENTS, global const scalar *sample_offsets, global scalar *film,
                   uint4 band_pixels, uint first_sample, uint last_sample, global uint *ray_counts, uint cell,
                   global int *flags, global float *band_film, uint4 band_records)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    scene.ray_counts = ray_counts;
    Band band = band_of(band_pixels, cell, flags);
    global scalar *compensation = film + (size_t)band.width * band.height * 3;
    const Records records =
        records_of(IS_PIXEL_LIST ? (global char *)band_film : (global char *)film, band_records);
    for (uint first_tile = 0; first_tile < TILES; first_tile += PACKETS)
        tiles_render(&scene, &band, first_tile, sample_offsets, film, compensation, first_sample, last_sample,
                     flags, band_film, &records);
}
