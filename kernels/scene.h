// Gives kernels access to the scene's arrays.
#ifndef SCENE_H
#define SCENE_H

#include "numerics/lanes.h"

#include "types.h"

#define SCENE_MEMBER(NAME, Type, name, names) global const Type *names;
typedef struct {
    global const SceneHeader *header;
    ARENA_LIST(SCENE_MEMBER)
    global const BvhNode *nodes;
    global const Texel *texels;
    global uint *ray_counts; // by RAYS_…; NULL unless rays are counted
} Scene;

// The first arguments of each kernel, which have the scene, and the Scene made from them.
#define SCENE_ARGUMENTS                                                                                      \
    global const char *arena, ArenaOffsets offsets, global const BvhNode *nodes, global const Texel *texels
#define SCENE_POINTER(NAME, Type, name, names)                                                               \
    (global const Type *)(arena + (size_t)offsets.names * ARENA_UNIT),
#define SCENE_FROM_ARGUMENTS                                                                                 \
    {                                                                                                        \
        (global const SceneHeader *)arena, ARENA_LIST(SCENE_POINTER) nodes, texels, 0                        \
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
