// Computes the signature of the ray tree at each pixel's center.
#define COMPUTE_SIGNATURE 1
#include "film.h"
#include "shading/path.h"

static OUT_OF_LINE void tile_path_signature(const Scene *scene, const Tile *tile, global int *paths,
                                            global int *flags)
{
    Ray ray = camera_ray(scene->header, tile->pixels, 0, 0, SAMPLE_CENTER, tile->inside);
    ShadedHit hits[1];
    TreeNode nodes[1];
    unsigned_integer signature;
    mask uncertain;
    ray_tree_color(scene, ray, false, nodes, hits, &signature, &uncertain);
    if (IS_CERTIFIED) film_flag_pixels(flags, tile, uncertain, true);
    film_store_integer(paths, tile, 1, 0, integer_from_unsigned(signature));
}

kernel void path(SCENE_ARGUMENTS, uint4 band_pixels, global char *film, LayerOffsets layers,
                 global int *flags)
{
    Scene scene = SCENE_FROM_ARGUMENTS;
    global int *paths = LAYER_AT(film, layers, path, INTEGER);
    Band band = band_of(band_pixels, 1, flags);
    for (uint i = 0; i < TILES; i++) {
        Tile tile = band_tile(&band, i);
        if (lanes_any(tile.inside)) tile_path_signature(&scene, &tile, paths, flags);
    }
}
