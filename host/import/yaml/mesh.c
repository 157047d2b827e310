// Reads `mesh:` of YAML scenes.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/mesh/mesh_import.h"
#include "host/import/yaml/yaml.h"

#include <stdlib.h>

typedef struct {
    const YamlNode *file;
    Affine transform;
    uint32_t material;
    bool smooth;
} MeshFields;

void yaml_read_mesh(YamlReader *reader, const YamlNode *mapping)
{
    static const Field fields[] = {
        {"file", read_node, offsetof(MeshFields, file), REQUIRED},
        {"transform", read_transform, offsetof(MeshFields, transform)},
        {"material", read_material, offsetof(MeshFields, material)},
        {"smooth", read_boolean, offsetof(MeshFields, smooth)},
    };
    MeshFields read = {.transform = affine_identity, .material = UINT32_MAX};
    if (!fields_read(reader, mapping, "mesh", fields, COUNT_OF(fields), &read)) return;
    OWNED char *path = yaml_read_path(reader, "file", read.file);
    if (!path) return;
    MeshSmoothing smoothing = SMOOTH_AS_FILE;
    if (field_node(reader, mapping, "smooth") != mapping)
        smoothing = read.smooth ? SMOOTH_ALWAYS : SMOOTH_NEVER;
    const MeshImport import = {
        .path = path,
        .transform = read.transform,
        .smoothing = smoothing,
        .own_materials = read.material == UINT32_MAX,
        .options = reader->options,
        .report = &reader->report,
        .offset = read.file->offset,
    };
    Object object = {.type = SHAPE_MESH, .material = read.material};
    if (!mesh_import(reader->scene, &import, &object.as.mesh.index)) return;
    reader->scene->meshes.items[object.as.mesh.index].path = memory_release(&path);
    if (object.material == UINT32_MAX) object.material = material_default_index(reader);
    if (yaml_material_fits(reader, &object, mapping)) array_push(reader->scene->objects, object);
}
