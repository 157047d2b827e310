// What lies behind each pixel's center, in place of its color.
#include "film.h"
#include "shading/phong.h"

// Infinity for a miss, put together from bits: `fast` need not know infinities.
static inline real hit_distance(const Hit *hit)
{
    return real_from_bits(lanes_select(hit_found(hit), bits_from_real(hit->t), (integer)(INFINITY_BITS)));
}

static KERNEL_BODY void tile_describe(const Scene *scene, const Tile *tile, global scalar *directions,
                                      global scalar *ts, global scalar *normals, global scalar *positions,
                                      global int *objects_hit, global int *shadows, uint shadow_count)
{
    Ray ray = camera_ray(scene->header, tile->pixels, 0, 0, tile->inside);
    Hit hit = closest_hit(scene, &ray);
    Surface surface = surface_seen(scene, &ray, &hit);
    const Vector nothing = {(real)(0), (real)(0), (real)(0)};
    film_store_color(directions, tile, ray.direction);
    film_store(ts, tile, 1, 0, hit_distance(&hit));
    film_store_color(normals, tile, vector_select(surface.found, surface.shading_normal, nothing));
    film_store_color(positions, tile, vector_select(surface.found, surface.position, nothing));
    film_store_integer(objects_hit, tile, 1, 0, hit.object);
    for (uint i = 0; i < shadow_count; i++) {
        mask shadowed;
        phong_light(scene, &surface, i, &shadowed);
        film_store_integer(shadows, tile, shadow_count, i,
                           lanes_select(shadowed, (integer)(1), (integer)(0)));
    }
}

kernel void aov(SCENE_ARGUMENTS, uint4 band_pixels, global scalar *directions, global scalar *ts,
                global scalar *normals, global scalar *positions, global int *objects_hit,
                global int *shadows, uint shadow_count)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    Band band = {band_pixels.x, band_pixels.y, band_pixels.z, band_pixels.w};
    for (uint i = 0; i < ITEM_TILES; i++) {
        Tile tile = band_tile(&band, i);
        if (lanes_any(tile.inside))
            tile_describe(&scene, &tile, directions, ts, normals, positions, objects_hit, shadows,
                          shadow_count);
    }
}
