#include "host/scene/describe.h"

#include "host/base/file.h"
#include "host/scene/mesh.h"
#include <string.h>

const Object *scene_find_object(const Scene *scene, size_t id, size_t *primitive)
{
    *primitive = id;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const size_t count = object_primitive_count(scene, object);
        if (*primitive < count) return object;
        *primitive -= count;
    }
    return NULL;
}

uint32_t object_material(const Scene *scene, const Object *object, size_t primitive)
{
    const uint32_t *of_triangles = object->type == SHAPE_MESH
                                       ? mesh_materials(&scene->meshes.items[object->as.mesh.index], object)
                                       : NULL;
    return of_triangles ? of_triangles[primitive] : object->material;
}

void object_describe(Text *text, const Scene *scene, const char *path, size_t id)
{
    size_t primitive;
    const Object *object = scene_find_object(scene, id, &primitive);
    if (!object) {
        text_appendf(text, "nothing");
        return;
    }
    const Mesh *mesh = object->type == SHAPE_MESH ? &scene->meshes.items[object->as.mesh.index] : NULL;
    if (mesh) text_appendf(text, "triangle %zu of ", primitive);
    text_appendf(text, "%s %zu", shape_names[object_shape(object)], id - primitive);
    if (mesh && mesh->path) text_appendf(text, ", %s", file_base_name(mesh->path));
    if (object->file > 0) path = scene->included.items[object->file - 1].path;
    if (object->line > 0) text_appendf(text, ", %s:%u", file_base_name(path), object->line);
    const char *name = scene->material_names.items[object_material(scene, object, primitive)];
    if (name[0] != '\0') text_appendf(text, ", material %s", name);
}
