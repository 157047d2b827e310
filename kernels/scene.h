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

// The first arguments of each kernel, which carry the scene, and the Scene built from them.
#define SCENE_ARGUMENTS                                                                                      \
    global const char *arena, ArenaOffsets offsets, global const BvhNode *nodes, global const Texel *texels
#define SCENE_POINTER(NAME, Type, name, names)                                                               \
    (global const Type *)(arena + (size_t)offsets.names * ARENA_UNIT),
#define SCENE_FROM_ARGUMENTS                                                                                 \
    {                                                                                                        \
        (global const SceneHeader *)arena, ARENA_LIST(SCENE_POINTER) nodes, texels, 0                        \
    }

// A range of ids with consecutive entries: an instance's triangles, or the objects between instances.
typedef struct {
    uint first, end; // ids
    uint entry;      // the index of the first one's ObjectEntry
    bool is_instance;
    uint instance; // the instance's index, if it is one
    uint material; // 1 + the instance's material, or 0
} ObjectRange;

static inline ObjectRange outside_instances(void)
{
    return (ObjectRange){0, INT_MAX, 0, false, 0, 0};
}

static inline ObjectRange instance_range(const Scene *scene, uint first, uint end, uint index)
{
    const uint4 instance = scene->instances[index].id;
    return (ObjectRange){first, end, scene->shared_meshes[instance.y].root_entry.y, true, index, instance.z};
}

// Returns the range that an id is in.
static inline ObjectRange object_range(const Scene *scene, uint id)
{
    ObjectRange range = outside_instances();
    if (!HAS_INSTANCES) return range;
    const uint count = ((global const uint *)scene->header->counts)[TYPE_INSTANCES];
    uint low = 0, high = count; // `low` instances begin no later than the id
    while (low < high) {
        const uint middle = (low + high) >> 1;
        if (scene->instance_ids[middle].ids.x <= id)
            low = middle + 1;
        else
            high = middle;
    }
    if (low < count) range.end = scene->instance_ids[low].ids.x;
    if (low == 0) return range;
    const uint4 ids = scene->instance_ids[low - 1].ids;
    if (id >= ids.y) {
        range.first = ids.y;
        range.entry = ids.y - ids.z;
        return range;
    }
    return instance_range(scene, ids.x, ids.y, ids.w);
}

// Returns the type_index_material of an id in the range.
static inline uint4 range_entry(const Scene *scene, const ObjectRange *range, scalar_integer id)
{
    if (!HAS_INSTANCES) return scene->objects[id].type_index_material;
    uint4 entry = scene->objects[range->entry + ((uint)id - range->first)].type_index_material;
    if (range->material != 0) entry.z = range->material - 1;
    return entry;
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
