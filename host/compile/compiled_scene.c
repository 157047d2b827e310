#include "host/compile/compiled_scene.h"

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include <stdlib.h>
#include <string.h>

// clang-format off
// Of a struct whose uint4 members are those from `first` to `last`, and of one that has none.
#define LAYOUT(Type, first, last)                           \
    {sizeof(Type), offsetof(Type, first) / sizeof(scalar4), \
     (offsetof(Type, last) + sizeof((Type *)0)->last - offsetof(Type, first)) / sizeof(uint4)}
#define LAYOUT_OF_REALS(Type) {sizeof(Type), sizeof(Type) / sizeof(scalar4), 0}

static const FlatLayout layouts[FLAT_COUNT] = {
    [FLAT_HEADER] = LAYOUT(SceneHeader, image, bvh_counts),
#define SHAPE_LAYOUT(feature, Type, name, names) [FLAT_FIRST_SHAPE + KIND_##feature] = LAYOUT(Type, id, id),
    SHAPE_LIST(SHAPE_LAYOUT)
    [FLAT_TRIANGLE_NORMALS] = LAYOUT_OF_REALS(TriangleNormals),
    [FLAT_TRIANGLE_UVS] = LAYOUT_OF_REALS(TriangleUvs),
    [FLAT_TRIANGLE_NEIGHBORS] = LAYOUT(TriangleNeighbors, ids_sides, ids_sides),
    // the widest; flat_nodes_renew makes them as wide as the kernel's
    [FLAT_NODES] = {BVH_WIDTH_MAX / 4 * (BVH_PLANES * sizeof(scalar4) + 2 * sizeof(uint4)),
                    BVH_WIDTH_MAX / 4 * BVH_PLANES, BVH_WIDTH_MAX / 4 * 2},
    [FLAT_CULL_SPHERES] = LAYOUT_OF_REALS(CullSphere),
    [FLAT_OBJECTS] = LAYOUT(ObjectEntry, kind_index_material, kind_index_material),
    [FLAT_MATERIALS] = LAYOUT(FlatMaterial, optical_depth, texture),
    [FLAT_LIGHTS] = LAYOUT(FlatLight, kind, kind),
    [FLAT_TEXTURE_LEVELS] = LAYOUT(TextureLevel, place, place),
    [FLAT_TEXELS] = LAYOUT(Texel, color, color),
};
// clang-format on

enum { FLAT_STRUCT_MAX = 1024 };
_Static_assert(sizeof(SceneHeader) <= FLAT_STRUCT_MAX, "no flat struct is larger");
_Static_assert(BVH_WIDTH_MAX / 4 * (BVH_PLANES * sizeof(scalar4) + 2 * sizeof(uint4)) <= FLAT_STRUCT_MAX,
               "nor a node");

static void range_zero(void *context, size_t begin, size_t end)
{
    const FlatArray *array = context;
    memset(flat_array_at(array, begin), 0, (end - begin) * array->layout.size);
}

static void array_renew(CompiledScene *compiled, size_t kind, FlatLayout layout, size_t count)
{
    FlatArray *array = &compiled->arrays[kind];
    free(array->items);
    *array = (FlatArray){memory_allocate_large(memory_product(count, layout.size)), count, layout};
    parallel_run(count, FLAT_RANGE_MIN, range_zero, array);
    compiled->changed[kind] = true;
}

void flat_array_renew(CompiledScene *compiled, size_t kind, size_t count)
{
    array_renew(compiled, kind, layouts[kind], count);
}

void flat_nodes_renew(CompiledScene *compiled, size_t count, unsigned width)
{
    const FlatLayout widest = layouts[FLAT_NODES];
    const unsigned parts = BVH_WIDTH_MAX / width;
    const FlatLayout layout = {widest.size / parts, widest.scalar4_count / parts, widest.uint4_count / parts};
    array_renew(compiled, FLAT_NODES, layout, count);
}

void *flat_array_at(const FlatArray *array, size_t index)
{
    return (char *)array->items + index * array->layout.size;
}

// A shape's struct has its id in its first uint4, right behind its scalar4 members.
uint32_t *flat_id(const FlatArray *array, void *primitive)
{
    return (uint32_t *)(void *)((char *)primitive + array->layout.scalar4_count * sizeof(scalar4));
}

void compiled_scene_free(CompiledScene *compiled)
{
    for (size_t kind = 0; kind < FLAT_COUNT; kind++)
        free(compiled->arrays[kind].items);
    free(compiled->textures);
    *compiled = (CompiledScene){0};
}

static size_t narrow_size(const FlatLayout *layout)
{
    return 4 * sizeof(float) * layout->scalar4_count + sizeof(uint4) * layout->uint4_count;
}

size_t flat_array_size(const FlatArray *array, bool is_double)
{
    const FlatLayout *layout = &array->layout;
    return array->count * (is_double ? layout->size : narrow_size(layout));
}

typedef struct {
    const FlatArray *array;
    char *target;
    size_t first; // of the array's structs, which the ranges count from
} Narrowing;

// The target may be the array's own memory: a struct is copied before its place is written.
static void range_narrow(void *context, size_t begin, size_t end)
{
    const Narrowing *narrowing = context;
    const FlatLayout *layout = &narrowing->array->layout;
    const size_t number_count = 4 * layout->scalar4_count;
    double item[FLAT_STRUCT_MAX / sizeof(double)];
    for (size_t i = narrowing->first + begin; i < narrowing->first + end; i++) {
        memcpy(item, flat_array_at(narrowing->array, i), layout->size);
        float *narrow = (float *)(void *)(narrowing->target + i * narrow_size(layout));
        for (size_t k = 0; k < number_count; k++)
            narrow[k] = (float)item[k];
        memcpy(narrow + number_count, item + number_count, sizeof(uint4) * layout->uint4_count);
    }
}

void flat_array_write(const FlatArray *array, bool is_double, void *target)
{
    Narrowing narrowing = {array, target, 0};
    if (is_double)
        memcpy(target, array->items, flat_array_size(array, is_double));
    else
        parallel_run(array->count, FLAT_RANGE_MIN, range_narrow, &narrowing);
}

// By threads as far as what they write stays before what they read, which is ever farther.
static void array_narrow(const FlatArray *array)
{
    const size_t from_size = array->layout.size, to_size = narrow_size(&array->layout);
    if (from_size == to_size) return;
    Narrowing narrowing = {array, array->items, 0};
    size_t end = array->count < FLAT_RANGE_MIN ? array->count : FLAT_RANGE_MIN;
    range_narrow(&narrowing, 0, end);
    while (end < array->count) {
        narrowing.first = end;
        end = end * from_size / to_size;
        if (end > array->count) end = array->count;
        parallel_run(end - narrowing.first, FLAT_RANGE_MIN / 4, range_narrow, &narrowing);
    }
    memory_discard(array->items, array->count * to_size, array->count * from_size);
}

void *flat_array_take(FlatArray *array, bool is_double)
{
    if (!is_double) array_narrow(array);
    void *items = array->items;
    array->items = NULL;
    return items;
}
