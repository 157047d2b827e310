// Compiles the meshes that instances share, and appends them to the scene's arrays.
#include "host/base/memory.h"
#include "host/compile/instances.h"
#include "host/compile/stages.h"
#include <stdlib.h>
#include <string.h>

// The arrays that shared meshes add to.
static const FlatType extended[EXTENDED_COUNT] = {FLAT_FIRST_SHAPE + TYPE_TRIANGLES,
                                                  FLAT_TRIANGLE_NORMALS,
                                                  FLAT_TRIANGLE_UVS,
                                                  FLAT_OBJECTS,
                                                  FLAT_NODES,
                                                  FLAT_TRIANGLE_BLOCKS};

// Compiles a shared mesh, alone and in its own space.
static CompiledScene shared_mesh_compile(const CompiledScene *compiled, const Scene *scene,
                                         const SharedMeshPlan *shared, const CompileSettings *settings,
                                         uint64_t *hash)
{
    Mesh mesh = scene->meshes.items[shared->mesh];
    Object object = {.type = SHAPE_MESH, .material = shared->object_material};
    if (shared->material > 0) mesh.materials = NULL;
    mesh.vertices = memory_allocate(mesh.vertex_count, sizeof *mesh.vertices);
    for (size_t i = 0; i < mesh.vertex_count; i++)
        mesh.vertices[i] = vector_scale(
            vector_subtract(scene->meshes.items[shared->mesh].vertices[i], shared->center), shared->scale);
    Scene alone = *scene;
    alone.objects.items = &object;
    alone.objects.count = 1;
    alone.meshes.items = &mesh;
    alone.meshes.count = 1;
    CompiledScene part = {.textures = compiled->textures, .unit = 1};
    const Rounding rounding = {.is_double = settings->precision == PRECISION_DOUBLE, .is_local = true};
    objects_flatten(&part, &alone, &rounding);
    for (size_t i = 0; i < EXTENDED_COUNT && settings->hashes_primitives; i++)
        *hash = flat_array_hash(*hash, &part.arrays[extended[i]]);
    mesh_bvh_flatten(&part, settings);
    free(mesh.vertices);
    part.textures = NULL;
    return part;
}

// Reallocates an array with room for `count` more items.
static void array_extend(CompiledScene *compiled, FlatType type, size_t count)
{
    FlatArray *array = &compiled->arrays[type];
    const size_t size = array->layout.size;
    void *items = memory_allocate_large(array->count + count, size);
    if (array->count > 0) memcpy(items, array->items, array->count * size);
    free(array->items);
    array->items = items;
}

static void array_append(CompiledScene *compiled, FlatType type, const FlatArray *added)
{
    FlatArray *array = &compiled->arrays[type];
    if (added->count > 0)
        memcpy(flat_array_at(array, array->count), added->items, added->count * array->layout.size);
    array->count += added->count;
    compiled->changed[type] = true;
}

// Points the structs of a shared mesh to their places behind those of `compiled`.
static void shared_mesh_shift(const CompiledScene *compiled, CompiledScene *part)
{
    uint32_t bases[FLAT_COUNT];
    for (size_t type = 0; type < FLAT_COUNT; type++)
        bases[type] = (uint32_t)compiled->arrays[type].count;
    const uint32_t triangle_base = bases[FLAT_FIRST_SHAPE + TYPE_TRIANGLES];
    const FlatArray *triangles = &part->arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES];
    ObjectEntry *entries = part->arrays[FLAT_OBJECTS].items;
    for (size_t i = 0; i < triangles->count; i++) {
        Triangle *triangle = flat_array_at(triangles, i);
        if (triangle->id.y > 0) triangle->id.y += bases[FLAT_TRIANGLE_NORMALS];
        if (triangle->id.z > 0) triangle->id.z += bases[FLAT_TRIANGLE_UVS];
        entries[i].type_index_material.y += triangle_base;
    }
    const uint32_t block_count = (uint32_t)part->arrays[FLAT_TRIANGLE_BLOCKS].count;
    bvh_shift(part, bases[FLAT_NODES], block_count > 0 ? bases[FLAT_TRIANGLE_BLOCKS] : triangle_base);
    uint32_t *firsts = part->arrays[FLAT_BLOCK_TRIANGLES].items;
    for (uint32_t i = 0; i < block_count; i++)
        firsts[i] += triangle_base;
}

static void block_triangles_append(CompiledScene *compiled, const CompiledScene *part)
{
    const size_t before = compiled->arrays[FLAT_TRIANGLE_BLOCKS].count,
                 added = part->arrays[FLAT_TRIANGLE_BLOCKS].count;
    FlatArray *firsts = &compiled->arrays[FLAT_BLOCK_TRIANGLES];
    firsts->count = (before + added + 3) / 4;
    if (added > 0)
        memcpy((uint32_t *)firsts->items + before, part->arrays[FLAT_BLOCK_TRIANGLES].items,
               added * sizeof(uint32_t));
    compiled->changed[FLAT_BLOCK_TRIANGLES] = true;
}

// Makes arrays ready for appending: blocks and nodes are as wide as the kernel's.
static void arrays_prepare(CompiledScene *compiled, const CompiledScene *parts, size_t part_count)
{
    InstancePlan *plan = compiled->instances;
    size_t block_count = compiled->arrays[FLAT_TRIANGLE_BLOCKS].count;
    for (size_t i = 0; i < EXTENDED_COUNT; i++) {
        size_t count = 0;
        for (size_t k = 0; k < part_count; k++)
            count += parts[k].arrays[extended[i]].count;
        FlatArray *array = &compiled->arrays[extended[i]];
        const FlatLayout *layout = &parts[0].arrays[extended[i]].layout;
        plan->hidden_counts[i] = array->count;
        if (memcmp(&array->layout, layout, sizeof *layout) != 0) // empty, or one node that leads nowhere
            flat_array_renew_as(compiled, extended[i], array->count, *layout);
        array_extend(compiled, extended[i], count);
        if (extended[i] == FLAT_TRIANGLE_BLOCKS) block_count += count;
    }
    FlatArray *firsts = &compiled->arrays[FLAT_BLOCK_TRIANGLES];
    const size_t added = (block_count + 3) / 4 - firsts->count;
    array_extend(compiled, FLAT_BLOCK_TRIANGLES, added);
    // the last struct may be filled in part
    memset(flat_array_at(firsts, firsts->count), 0, added * firsts->layout.size);
}

void shared_meshes_append(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings)
{
    InstancePlan *plan = compiled->instances;
    if (!plan) return;
    OWNED CompiledScene *parts = memory_allocate(plan->mesh_count, sizeof *parts);
    for (size_t i = 0; i < plan->mesh_count; i++)
        parts[i] =
            shared_mesh_compile(compiled, scene, &plan->meshes[i], settings, &compiled->primitives_hash);
    arrays_prepare(compiled, parts, plan->mesh_count);
    SharedMesh *meshes = compiled->arrays[FLAT_SHARED_MESHES].items;
    for (size_t i = 0; i < plan->mesh_count; i++) {
        const uint32_t root = (uint32_t)compiled->arrays[FLAT_NODES].count,
                       entry = (uint32_t)compiled->arrays[FLAT_OBJECTS].count;
        meshes[i] = (SharedMesh){scalar4_of(plan->meshes[i].extent, 0), {root, entry, 0, 0}};
        shared_mesh_shift(compiled, &parts[i]);
        block_triangles_append(compiled, &parts[i]);
        for (size_t k = 0; k < EXTENDED_COUNT; k++)
            array_append(compiled, extended[k], &parts[i].arrays[extended[k]]);
        if (parts[i].pending_children_max > compiled->pending_children_max)
            compiled->pending_children_max = parts[i].pending_children_max;
        compiled_scene_free(&parts[i]);
    }
    const FlatArray *ids = &compiled->arrays[FLAT_INSTANCE_IDS];
    const ObjectEntry *entries = compiled->arrays[FLAT_OBJECTS].items;
    for (size_t i = 0; i < ids->count; i++) {
        uint4 *of_instance = &((InstanceIds *)ids->items)[i].ids;
        of_instance->w = entries[entry_of_id(compiled, of_instance->x)].type_index_material.y;
    }
}

void shared_meshes_toggle(CompiledScene *compiled)
{
    InstancePlan *plan = compiled->instances;
    for (size_t i = 0; plan && i < EXTENDED_COUNT; i++) {
        const size_t count = compiled->arrays[extended[i]].count;
        compiled->arrays[extended[i]].count = plan->hidden_counts[i];
        plan->hidden_counts[i] = count;
    }
}
