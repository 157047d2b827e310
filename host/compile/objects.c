#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <string.h>

void primitive_add(Flattening *flattening, int kind, const void *primitive, uint32_t material)
{
    const uint32_t id = (uint32_t)flattening->primitive_count++, index = (uint32_t)flattening->counts[kind]++;
    FlatArray *array = &flattening->compiled->arrays[FLAT_FIRST_SHAPE + kind];
    memcpy(flat_array_at(array, index), primitive, array->layout.size);
    *flat_id(array, index) = id;
    ObjectEntry *entries = flattening->compiled->arrays[FLAT_OBJECTS].items;
    entries[id].kind_index_material = (uint4){(uint32_t)kind, index, material, 0};
}

static void arrays_make(CompiledScene *compiled, const Scene *scene)
{
    size_t counts[KIND_COUNT] = {0}, normals_count = 0, uvs_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const Mesh *mesh = object->kind == SHAPE_MESH ? &scene->meshes.items[object->as.mesh.index] : NULL;
        size_t count = object_primitive_count(scene, object);
        counts[shape_ops[object->kind]->kind] += count;
        bool smooth =
            mesh ? mesh->normals != NULL : object->kind == SHAPE_TRIANGLE && object->as.triangle.smooth;
        if (smooth) normals_count += count;
        if (mesh && mesh->uvs && scene->textures.count > 0) uvs_count += count;
    }
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        compiled->arrays[FLAT_FIRST_SHAPE + kind] = flat_array_make(FLAT_FIRST_SHAPE + kind, counts[kind]);
    compiled->arrays[FLAT_TRIANGLE_NORMALS] = flat_array_make(FLAT_TRIANGLE_NORMALS, normals_count);
    compiled->arrays[FLAT_TRIANGLE_UVS] = flat_array_make(FLAT_TRIANGLE_UVS, uvs_count);
    compiled->arrays[FLAT_OBJECTS] = flat_array_make(FLAT_OBJECTS, scene_primitive_count(scene));
}

void objects_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding)
{
    arrays_make(compiled, scene);
    Flattening flattening = {.compiled = compiled, .scene = scene, .rounding = *rounding};
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        shape_ops[object->kind]->flatten(&flattening, object);
    }
    compiled->arrays[FLAT_TRIANGLE_NORMALS].count = flattening.normals_count;
    compiled->arrays[FLAT_TRIANGLE_UVS].count = flattening.uvs_count;
}
