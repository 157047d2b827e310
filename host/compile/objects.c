#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/instances.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

void primitive_add(Flattening *flattening, int type, const void *primitive, uint32_t material)
{
    const uint32_t id = (uint32_t)flattening->primitive_count++, entry = (uint32_t)flattening->entry_count++;
    FlatArray *array = &flattening->compiled->arrays[FLAT_FIRST_SHAPE + type];
    void *target = flattening->moved;
    if (!target) {
        const uint32_t index = (uint32_t)flattening->counts[type]++;
        ObjectEntry *entries = flattening->compiled->arrays[FLAT_OBJECTS].items;
        entries[entry].type_index_material = (uint4){(uint32_t)type, index, material, 0};
        target = flat_array_at(array, index);
    }
    memcpy(target, primitive, array->layout.size);
    *flat_id(array, target) = id;
}

bool primitive_set_power(Flattening *flattening, double power, uint4 *id)
{
    const double value = rounded(&flattening->rounding, power);
    if (!isfinite(value)) return false;
    flattening->features |= FEATURE_EYE_POWERS;
    id->y |= HAS_POWER;
    if (flattening->rounding.is_double) {
        uint64_t bits;
        memcpy(&bits, &value, sizeof bits);
        id->z = (uint32_t)bits;
        id->w = (uint32_t)(bits >> 32);
    } else {
        const float single = (float)value;
        memcpy(&id->z, &single, sizeof single);
    }
    return true;
}

// Consecutive primitives that one thread flattens.
typedef struct {
    size_t first_object, first_part;
    size_t count;
    // The counts before and after the range. `before` assumes that every triangle of a mesh with normals or
    // texture coordinates uses them.
    Flattening before, after;
} FlatteningRange;

typedef ARRAY_OF(FlatteningRange) FlatteningRanges;

// Appends the ranges of an object's primitives. `flattening` counts what is flattened before them.
static void object_divide(FlatteningRanges *ranges, Flattening *flattening, size_t index)
{
    const Scene *scene = flattening->scene;
    const Object *object = &scene->objects.items[index];
    const size_t primitive_count = object_primitive_count(scene, object);
    const bool is_shared = instance_mesh(flattening->compiled, index) > 0,
               is_smooth = !is_shared && object_is_smooth(scene, object),
               has_uvs = !is_shared && object->type == SHAPE_MESH && scene->textures.count > 0 &&
                         scene->meshes.items[object->as.mesh.index].uvs;
    const size_t type = is_shared ? TYPE_INSTANCES : shape_primitive_type(object->type),
                 count = is_shared ? 1 : primitive_count;
    for (size_t part = 0, step; part < count; part += step) {
        if (flattening->entry_count % FLAT_RANGE_MIN == 0)
            array_push(*ranges, ((FlatteningRange){index, part, 0, *flattening, *flattening}));
        FlatteningRange *range = &ranges->items[ranges->count - 1];
        const size_t space = FLAT_RANGE_MIN - range->count;
        step = count - part < space ? count - part : space;
        range->count += step;
        flattening->entry_count += step;
        flattening->counts[type] += step;
        flattening->primitive_count += is_shared ? primitive_count : step;
        if (is_smooth) flattening->normals_count += step;
        if (has_uvs) flattening->uvs_count += step;
    }
}

static void arrays_make(CompiledScene *compiled, const Flattening *all)
{
    for (size_t type = 0; type < TYPE_COUNT; type++)
        flat_array_renew(compiled, FLAT_FIRST_SHAPE + type, all->counts[type]);
    flat_array_renew(compiled, FLAT_TRIANGLE_NORMALS, all->normals_count);
    flat_array_renew(compiled, FLAT_TRIANGLE_UVS, all->uvs_count);
    flat_array_renew(compiled, FLAT_OBJECTS, all->entry_count);
    flat_array_renew(compiled, FLAT_SHARED_MESHES, compiled->instances ? compiled->instances->mesh_count : 0);
    flat_array_renew(compiled, FLAT_INSTANCE_IDS, all->counts[TYPE_INSTANCES]);
}

static void ranges_flatten(void *context, size_t begin, size_t end)
{
    for (size_t at = begin; at < end; at++) {
        FlatteningRange *range = &((FlatteningRange *)context)[at];
        Flattening flattening = range->before;
        const size_t entries_end = flattening.entry_count + range->count;
        flattening.part = range->first_part;
        for (size_t i = range->first_object; flattening.entry_count < entries_end; i++) {
            const Object *object = &flattening.scene->objects.items[i];
            const size_t count = object_primitive_count(flattening.scene, object);
            const uint32_t shared = instance_mesh(flattening.compiled, i);
            if (shared > 0) instance_flatten(&flattening, object, shared - 1);
            for (; shared == 0 && flattening.part < count && flattening.entry_count < entries_end;
                 flattening.part++)
                shape_ops[object->type]->flatten(&flattening, object);
            flattening.part = 0;
        }
        range->after = flattening;
    }
}

// Moves the normals and texture coordinates of a range down to the given places.
static void range_move_attributes(const FlatteningRange *range, size_t first_normals, size_t first_uvs)
{
    const Flattening *before = &range->before, *after = &range->after;
    const FlatArray *arrays = before->compiled->arrays;
    Triangle *triangles = arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES].items;
    TriangleNormals *normals = arrays[FLAT_TRIANGLE_NORMALS].items;
    TriangleUvs *uvs = arrays[FLAT_TRIANGLE_UVS].items;
    for (size_t i = before->counts[TYPE_TRIANGLES]; i < after->counts[TYPE_TRIANGLES]; i++) {
        if (triangles[i].id.y > 0) triangles[i].id.y -= (uint32_t)(before->normals_count - first_normals);
        if (triangles[i].id.z > 0) triangles[i].id.z -= (uint32_t)(before->uvs_count - first_uvs);
    }
    memmove(normals + first_normals, normals + before->normals_count,
            (after->normals_count - before->normals_count) * sizeof *normals);
    memmove(uvs + first_uvs, uvs + before->uvs_count, (after->uvs_count - before->uvs_count) * sizeof *uvs);
}

void objects_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding)
{
    Flattening all = {.compiled = compiled, .scene = scene, .rounding = *rounding};
    OWNED FlatteningRanges ranges = {0};
    for (size_t i = 0; i < scene->objects.count; i++)
        object_divide(&ranges, &all, i);
    arrays_make(compiled, &all);
    parallel_run(ranges.count, 1, ranges_flatten, ranges.items);
    size_t normals_count = 0, uvs_count = 0;
    for (size_t i = 0; i < ranges.count; i++) {
        const Flattening *before = &ranges.items[i].before, *after = &ranges.items[i].after;
        if (normals_count < before->normals_count || uvs_count < before->uvs_count)
            range_move_attributes(&ranges.items[i], normals_count, uvs_count);
        normals_count += after->normals_count - before->normals_count;
        uvs_count += after->uvs_count - before->uvs_count;
        compiled->features |= after->features;
    }
    compiled->arrays[FLAT_TRIANGLE_NORMALS].count = normals_count;
    compiled->arrays[FLAT_TRIANGLE_UVS].count = uvs_count;
}

typedef struct {
    Flattening flattening;
    const FlatArray *array;    // that is being moved
    const uint32_t *first_ids; // of each object's primitives, and behind the last
    _Atomic FeatureSet features;
} Move;

// Moves structs in the order of the array, so that memory is written sequentially.
static void range_move(void *context, size_t begin, size_t end)
{
    Move *move = context;
    Flattening flattening = move->flattening;
    const Scene *scene = flattening.scene;
    const uint32_t *first_ids = move->first_ids;
    size_t object = 0; // adjacent ones mostly have the same
    for (size_t i = begin; i < end; i++) {
        flattening.moved = flat_array_at(move->array, i);
        const uint32_t id = *flat_id(move->array, flattening.moved);
        if (id < first_ids[object] || id >= first_ids[object + 1]) {
            size_t low = 0, high = scene->objects.count;
            while (high - low > 1) {
                size_t middle = (low + high) / 2;
                *(first_ids[middle] <= id ? &low : &high) = middle;
            }
            object = low;
        }
        flattening.primitive_count = id;
        flattening.part = id - first_ids[object];
        const Object *of_id = &scene->objects.items[object];
        const uint32_t shared = instance_mesh(flattening.compiled, object);
        if (shared > 0)
            instance_flatten(&flattening, of_id, shared - 1);
        else
            shape_ops[of_id->type]->flatten(&flattening, of_id);
    }
    atomic_fetch_or(&move->features, flattening.features);
}

void objects_move(CompiledScene *compiled, const Scene *scene, const Rounding *rounding)
{
    OWNED uint32_t *first_ids = memory_allocate(scene->objects.count + 1, sizeof *first_ids);
    first_ids[0] = 0;
    for (size_t i = 0; i < scene->objects.count; i++)
        first_ids[i + 1] = first_ids[i] + (uint32_t)object_primitive_count(scene, &scene->objects.items[i]);
    Move move = {.flattening = {.compiled = compiled, .scene = scene, .rounding = *rounding},
                 .first_ids = first_ids};
    for (size_t type = 0; type < TYPE_COUNT; type++) {
        move.array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
        compiled->changed[FLAT_FIRST_SHAPE + type] = true;
        parallel_run(move.array->count, FLAT_RANGE_MIN, range_move, &move);
    }
    compiled->features = (compiled->features & ~(FeatureSet)FEATURE_EYE_POWERS) | move.features;
}
