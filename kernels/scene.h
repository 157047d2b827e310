// The scene's arrays, as kernels see them.
#ifndef SCENE_H
#define SCENE_H

#include "numerics/lanes.h"

#include "types.h"

#define SCENE_SHAPE_MEMBER(feature, Type, name, names) global const Type *names;
typedef struct {
    global const SceneHeader *header;
    SHAPE_LIST(SCENE_SHAPE_MEMBER)
    global const TriangleNormals *triangle_normals;
    global const TriangleUvs *triangle_uvs;
    global const TriangleNeighbors *triangle_neighbors;
    global const BvhNode *nodes;
    global const CullSphere *cull_spheres;
    global const ObjectEntry *objects;
    global const Material *materials;
    global const Light *lights;
    global const TextureLevel *texture_levels;
    global const Texel *texels;
    global uint *ray_counts; // of each RAYS_…; NULL unless rays are counted
} Scene;

// The arrays as kernel arguments, and the Scene made of them: the same list in the same order in each kernel.
#define SCENE_SHAPE_ARGUMENT(feature, Type, name, names) global const Type *names,
#define SCENE_ARGUMENTS                                                                                      \
    global const SceneHeader *header,                                                                        \
        SHAPE_LIST(SCENE_SHAPE_ARGUMENT) global const TriangleNormals *triangle_normals,                     \
        global const TriangleUvs *triangle_uvs, global const TriangleNeighbors *triangle_neighbors,          \
        global const BvhNode *nodes, global const CullSphere *cull_spheres,                                  \
        global const ObjectEntry *objects, global const Material *materials, global const Light *lights,     \
        global const TextureLevel *texture_levels, global const Texel *texels
#define SCENE_SHAPE_VALUE(feature, Type, name, names) names,
#define SCENE_FROM_ARGUMENTS                                                                                 \
    {                                                                                                        \
        header, SHAPE_LIST(SCENE_SHAPE_VALUE) triangle_normals, triangle_uvs, triangle_neighbors, nodes,     \
            cull_spheres, objects, materials, lights, texture_levels, texels, 0                              \
    }

// Adds the lanes in `rays` to a counter, in a counting build of the image's kernel only.
static inline void ray_counter_add(const Scene *scene, uint counter, mask rays)
{
    if (!IS_COUNTING || !scene->ray_counts) return;
    IntegerLanes counted = {rays};
    uint count = 0;
    for (uint lane = 0; lane < LANES; lane++)
        count += counted.each[lane] != 0;
    if (count > 0) atomic_add(&scene->ray_counts[counter], count);
}

#endif
