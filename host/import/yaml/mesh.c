// `mesh:` of YAML scenes.
#include "host/base/array.h"
#include "host/import/mesh/mesh_import.h"
#include "host/import/yaml/yaml.h"

#include <stdlib.h>

typedef struct {
    const YamlNode *file;
    MeshTransform transform;
    uint32_t material;
    bool smooth;
} MeshFields;

// One number for all axes or three; none may be 0.
static bool read_scale(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    Vector3 *scale = target;
    if (node->kind == YAML_SEQUENCE) {
        if (!read_vector(reader, field, node, scale)) return false;
    } else {
        if (!read_number(reader, field, node, &scale->x)) return false;
        scale->y = scale->z = scale->x;
    }
    if (scale->x != 0 && scale->y != 0 && scale->z != 0) return true;
    return report_error(&reader->report, node->offset, "'%s' must not be zero", field->name);
}

static bool read_transform(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Field fields[] = {
        {"translate", read_vector, offsetof(MeshTransform, translate), FORM_ANY, OPTIONAL, NULL},
        {"rotate", read_vector, offsetof(MeshTransform, rotate), FORM_ANY, OPTIONAL, NULL},
        {"scale", read_scale, offsetof(MeshTransform, scale), FORM_ANY, OPTIONAL, NULL},
    };
    return fields_read(reader, node, field->name, fields, COUNT_OF(fields), target, NULL);
}

void yaml_read_mesh(YamlReader *reader, const YamlNode *mapping)
{
    static const Field fields[] = {
        {"file", read_node, offsetof(MeshFields, file), FORM_ANY, REQUIRED, NULL},
        {"transform", read_transform, offsetof(MeshFields, transform), FORM_ANY, OPTIONAL, NULL},
        {"material", read_material, offsetof(MeshFields, material), FORM_ANY, OPTIONAL, NULL},
        {"smooth", read_boolean, offsetof(MeshFields, smooth), FORM_ANY, OPTIONAL, NULL},
    };
    MeshFields read = {.transform.scale = {1, 1, 1}, .material = UINT32_MAX};
    if (!fields_read(reader, mapping, "mesh", fields, COUNT_OF(fields), &read, NULL)) return;
    char *path = yaml_read_path(reader, "file", read.file);
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
    Object object = {.kind = SHAPE_MESH, .material = read.material};
    if (mesh_import(reader->scene, &import, &object.as.mesh.index)) {
        reader->scene->meshes.items[object.as.mesh.index].path = path;
        path = NULL;
        if (object.material == UINT32_MAX) object.material = material_default_index(reader);
        if (reader->scene->materials.items[object.material].texture > 0 &&
            !reader->scene->meshes.items[object.as.mesh.index].uvs)
            report_error(&reader->report, field_node(reader, mapping, "material")->offset,
                         "the mesh has no uv for the material's image");
        else
            array_push(reader->scene->objects, object);
    }
    free(path);
}
