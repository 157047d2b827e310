// `mesh:` of the native format.
#include "host/base/array.h"
#include "host/scene/mesh.h"
#include "host/scene/yaml_scene.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    const YamlNode *file;
    MeshTransform transform;
    uint32_t material;
    bool smooth;
} MeshFields;

// One number for all axes, or three; none is 0.
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
    report_error(&reader->report, node->offset, "'%s' must not be zero", field->name);
    return false;
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

// A relative name starts where the scene file lies. Caller frees.
static char *path_beside(const char *scene_file, const char *name)
{
    const char *slash = strrchr(scene_file, '/');
    int folder_length = slash && name[0] != '/' ? (int)(slash + 1 - scene_file) : 0;
    Text path = {0};
    text_appendf(&path, "%.*s%s", folder_length, scene_file, name);
    return path.items;
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
    if (read.file->kind != YAML_SCALAR || !yaml_text(&reader->tree, read.file)[0]) {
        expected_report(reader, "file", "the name of a file", read.file);
        return;
    }
    MeshSmoothing smoothing = SMOOTH_AS_FILE;
    if (field_node(reader, mapping, "smooth") != mapping)
        smoothing = read.smooth ? SMOOTH_ALWAYS : SMOOTH_NEVER;
    char *path = path_beside(reader->report.source->file, yaml_text(&reader->tree, read.file));
    const MeshImport import = {
        .path = path,
        .transform = read.transform,
        .smoothing = smoothing,
        .own_materials = read.material == UINT32_MAX,
    };
    Object object = {.kind = SHAPE_MESH, .material = read.material};
    if (mesh_import(reader->scene, &import, &reader->report, read.file->offset, &object.as.mesh.index)) {
        if (object.material == UINT32_MAX) object.material = material_default_index(reader);
        array_push(reader->scene->objects, object);
    }
    free(path);
}
