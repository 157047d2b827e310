#include "host/compile/compiled_scene.h"

#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/instances.h"
#include <stdlib.h>
#include <string.h>

// clang-format off
// Describe a struct whose uint4 members are those from `first` to `last`, and one that has none.
#define LAYOUT(Type, first, last)                           \
    {sizeof(Type), offsetof(Type, first) / sizeof(scalar4), \
     (offsetof(Type, last) + sizeof((Type *)0)->last - offsetof(Type, first)) / sizeof(uint4)}
#define LAYOUT_OF_REALS(Type) {sizeof(Type), sizeof(Type) / sizeof(scalar4), 0}

static const FlatLayout layouts[FLAT_COUNT] = {
    [FLAT_HEADER] = LAYOUT(SceneHeader, image, bvh_counts),
#define SHAPE_LAYOUT(feature, Type, name, names) [FLAT_FIRST_SHAPE + TYPE_##feature] = LAYOUT(Type, id, id),
    PRIMITIVE_LIST(SHAPE_LAYOUT)
    [FLAT_TRIANGLE_NORMALS] = LAYOUT_OF_REALS(TriangleNormals),
    [FLAT_TRIANGLE_UVS] = LAYOUT_OF_REALS(TriangleUvs),
    [FLAT_TRIANGLE_NEIGHBORS] = LAYOUT(TriangleNeighbors, ids_sides, ids_sides),
    // of the largest width; flat_wide_array_renew narrows them to the kernel's
    [FLAT_TRIANGLE_BLOCKS] = {BVH_WIDTH_MAX / 4 * BLOCK_ROWS * sizeof(scalar4), BVH_WIDTH_MAX / 4 * BLOCK_ROWS, 0},
    [FLAT_SPHERE_BLOCKS] = {BVH_WIDTH_MAX / 4 * (SPHERE_ROWS * sizeof(scalar4) + 2 * sizeof(uint4)),
                            BVH_WIDTH_MAX / 4 * SPHERE_ROWS, BVH_WIDTH_MAX / 4 * 2},
    [FLAT_BLOCK_TRIANGLES] = LAYOUT(BlockTriangles, triangles, triangles),
    [FLAT_NODES] = {BVH_WIDTH_MAX / 4 * (BVH_PLANES * sizeof(scalar4) + 2 * sizeof(uint4)),
                    BVH_WIDTH_MAX / 4 * BVH_PLANES, BVH_WIDTH_MAX / 4 * 2},
    [FLAT_CULL_SPHERES] = LAYOUT_OF_REALS(CullSphere),
    [FLAT_OBJECTS] = LAYOUT(ObjectEntry, type_index_material, type_index_material),
    [FLAT_MATERIALS] = LAYOUT(FlatMaterial, optical_depth, normal_map),
    [FLAT_LIGHTS] = LAYOUT(FlatLight, type, type),
    [FLAT_SKY_CELLS] = LAYOUT_OF_REALS(FlatSkyCell),
    [FLAT_TEXTURE_LEVELS] = LAYOUT(TextureLevel, range, range),
    [FLAT_SHARED_MESHES] = LAYOUT(SharedMesh, root_entry, root_entry),
    [FLAT_INSTANCE_IDS] = LAYOUT(InstanceIds, ids, ids),
    [FLAT_TEXELS] = LAYOUT(Texel, color, color),
};
// clang-format on

static void range_zero(void *context, size_t begin, size_t end)
{
    const FlatArray *array = context;
    memset(flat_array_at(array, begin), 0, (end - begin) * array->layout.size);
}

void flat_array_renew_as(CompiledScene *compiled, size_t type, size_t count, FlatLayout layout)
{
    FlatArray *array = &compiled->arrays[type];
    free(array->items);
    *array = (FlatArray){memory_allocate_large(count, layout.size), count, layout};
    parallel_run(count, FLAT_RANGE_MIN, range_zero, array);
    compiled->changed[type] = true;
}

void flat_array_renew(CompiledScene *compiled, size_t type, size_t count)
{
    flat_array_renew_as(compiled, type, count, layouts[type]);
}

static size_t narrow_size(const FlatLayout *layout)
{
    return 4 * sizeof(float) * layout->scalar4_count + sizeof(uint4) * layout->uint4_count;
}

void flat_wide_array_renew(CompiledScene *compiled, size_t type, size_t count, unsigned width, bool is_narrow)
{
    const FlatLayout widest = layouts[type];
    const unsigned parts = BVH_WIDTH_MAX / width;
    const FlatLayout layout = {widest.size / parts, widest.scalar4_count / parts, widest.uint4_count / parts};
    const size_t size = narrow_size(&layout);
    flat_array_renew_as(compiled, type, count,
                        is_narrow ? (FlatLayout){size, 0, size / sizeof(uint4)} : layout);
}

void *flat_array_at(const FlatArray *array, size_t index)
{
    return (char *)array->items + index * array->layout.size;
}

bool is_ordered_by_bvh(size_t type)
{
    return (type >= FLAT_FIRST_SHAPE && type < FLAT_FIRST_SHAPE + TYPE_COUNT) || type == FLAT_OBJECTS ||
           type == FLAT_NODES || type == FLAT_TRIANGLE_BLOCKS || type == FLAT_SPHERE_BLOCKS ||
           type == FLAT_BLOCK_TRIANGLES || type == FLAT_SHARED_MESHES || type == FLAT_INSTANCE_IDS;
}

uint64_t flat_array_hash(uint64_t hash, const FlatArray *array)
{
    const size_t size =
        array->layout.scalar4_count * sizeof(scalar4) + array->layout.uint4_count * sizeof(uint4);
    for (size_t i = 0; i < array->count; i++)
        hash = hash_bytes(hash, flat_array_at(array, i), size);
    return hash;
}

// Returns the id of a shape's struct, in its first uint4, right after its scalar4 members.
uint32_t *flat_id(const FlatArray *array, void *primitive)
{
    return (uint32_t *)(void *)((char *)primitive + array->layout.scalar4_count * sizeof(scalar4));
}

void compiled_scene_free(CompiledScene *compiled)
{
    for (size_t type = 0; type < FLAT_COUNT; type++)
        free(compiled->arrays[type].items);
    free(compiled->textures);
    instance_plan_free(compiled->instances);
    *compiled = (CompiledScene){0};
}

size_t flat_array_size(const FlatArray *array, bool is_double)
{
    const FlatLayout *layout = &array->layout;
    return array->count * (is_double ? layout->size : narrow_size(layout));
}

typedef struct {
    const FlatArray *array;
    char *target;
} ArrayWrite;

static void range_copy(void *context, size_t begin, size_t end)
{
    const ArrayWrite *write = context;
    const size_t size = write->array->layout.size;
    memcpy(write->target + begin * size, flat_array_at(write->array, begin), (end - begin) * size);
}

static void range_narrow(void *context, size_t begin, size_t end)
{
    const ArrayWrite *write = context;
    const FlatLayout *layout = &write->array->layout;
    const size_t number_count = 4 * layout->scalar4_count;
    for (size_t i = begin; i < end; i++) {
        const double *item = flat_array_at(write->array, i);
        float *narrow = (float *)(void *)(write->target + i * narrow_size(layout));
        for (size_t k = 0; k < number_count; k++)
            narrow[k] = (float)item[k];
        memcpy(narrow + number_count, item + number_count, sizeof(uint4) * layout->uint4_count);
    }
}

void flat_array_write(const FlatArray *array, bool is_double, void *target)
{
    ArrayWrite write = {array, target};
    parallel_run(array->count, FLAT_RANGE_MIN, is_double ? range_copy : range_narrow, &write);
}
