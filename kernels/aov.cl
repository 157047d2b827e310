// Fills the AOVs at each pixel's center.
#include "film.h"
#include "shading/light_visibility.h"

// Returns the distance of a hit, or infinity on a miss. Infinity is made from its bits, since
// -cl-finite-math-only (--build-options) assumes that it does not occur.
static inline real hit_distance(const Hit *hit)
{
    return real_from_bits(lanes_select(hit_found(hit), bits_from_real(hit->t), (integer)(INFINITY_BITS)));
}

#define LAYER_MEMBER(NAME, name, type, components, note)  global LAYER_##type *name;
#define LAYER_POINTER(NAME, name, type, components, note) LAYER_AT(film, layers, name, type),

typedef struct {
    HIT_AOV_LIST(LAYER_MEMBER)
} HitLayers;

// Fills the AOVs of a tile. light_count is 0 if there is no shadow layer.
static OUT_OF_LINE void tile_aovs(const Scene *scene, const Tile *tile, const HitLayers *layers,
                                  uint light_count, global int *flags)
{
    Ray ray = camera_ray(scene->header, tile->pixels, 0, 0, SAMPLE_CENTER, tile->inside);
    Hit hit = closest_hit(scene, &ray);
    Surface surface = visible_surface(scene, &ray, &hit);
    const mask found = hit_found(&hit);
    const Vector zero = {(real)(0), (real)(0), (real)(0)};
    film_store_vector(layers->ray, tile, ray.direction);
    film_store(layers->t, tile, 1, 0, hit_distance(&hit));
    film_store_vector(layers->normal, tile, vector_select(found, surface.shading_normal, zero));
    film_store_vector(layers->position, tile, vector_select(found, surface.position, zero));
    film_store_integer(layers->object, tile, 1, 0, hit.object);
    mask uncertain = mask_none();
    if (IS_CERTIFIED) uncertain = hit.uncertain | (found & surface.uncertain);
    for (uint i = 0; i < light_count; i++) {
        LightVisibility light = light_visibility(scene, &surface, i);
        if (IS_CERTIFIED) uncertain = uncertain | (found & (light.uncertain | light.facing_uncertain));
        mask shadowed = found & !light.lit;
        film_store_integer(layers->shadow, tile, light_count, i,
                           lanes_select(shadowed, (integer)(1), (integer)(0)));
    }
    if (IS_CERTIFIED) film_flag_pixels(flags, tile, uncertain, true);
}

kernel void aov(SCENE_ARGUMENTS, uint4 band_pixels, global char *film, LayerOffsets layers, global int *flags,
                uint light_count)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    Band band = band_of(band_pixels, 1, flags);
    const HitLayers hit_layers = {HIT_AOV_LIST(LAYER_POINTER)};
    for (uint i = 0; i < TILES; i++) {
        Tile tile = band_tile(&band, i);
        if (lanes_any(tile.inside)) tile_aovs(&scene, &tile, &hit_layers, light_count, flags);
    }
}
