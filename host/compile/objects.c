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

static void arrays_make(CompiledScene *compiled, const Scene *scene)
{
    size_t counts[TYPE_COUNT] = {0}, normals_count = 0, uvs_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const Mesh *mesh = object->type == SHAPE_MESH ? &scene->meshes.items[object->as.mesh.index] : NULL;
        size_t count = object_primitive_count(scene, object);
        if (instance_mesh(compiled, i) > 0) {
            counts[TYPE_INSTANCES]++;
            continue;
        }
        counts[shape_primitive_type(object->type)] += count;
        if (object_is_smooth(scene, object)) normals_count += count;
        if (mesh && mesh->uvs && scene->textures.count > 0) uvs_count += count;
    }
    for (size_t type = 0; type < TYPE_COUNT; type++)
        flat_array_renew(compiled, FLAT_FIRST_SHAPE + type, counts[type]);
    flat_array_renew(compiled, FLAT_TRIANGLE_NORMALS, normals_count);
    flat_array_renew(compiled, FLAT_TRIANGLE_UVS, uvs_count);
    const InstancePlan *plan = compiled->instances;
    const size_t instance_count = plan ? plan->instance_count : 0;
    flat_array_renew(compiled, FLAT_OBJECTS,
                     scene_primitive_count(scene) - (plan ? plan->triangle_count : 0) + instance_count);
    flat_array_renew(compiled, FLAT_SHARED_MESHES, plan ? plan->mesh_count : 0);
    flat_array_renew(compiled, FLAT_INSTANCE_IDS, instance_count);
}

void objects_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding)
{
    arrays_make(compiled, scene);
    Flattening flattening = {.compiled = compiled, .scene = scene, .rounding = *rounding};
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const size_t count = object_primitive_count(scene, object);
        const uint32_t shared = instance_mesh(compiled, i);
        if (shared > 0) instance_flatten(&flattening, object, shared - 1);
        for (flattening.part = 0; shared == 0 && flattening.part < count; flattening.part++)
            shape_ops[object->type]->flatten(&flattening, object);
    }
    compiled->features |= flattening.features;
    compiled->arrays[FLAT_TRIANGLE_NORMALS].count = flattening.normals_count;
    compiled->arrays[FLAT_TRIANGLE_UVS].count = flattening.uvs_count;
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
    uint32_t *first_ids = memory_allocate(scene->objects.count + 1, sizeof *first_ids);
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
    free(first_ids);
    compiled->features = (compiled->features & ~(FeatureSet)FEATURE_EYE_POWERS) | move.features;
}
