// Reads `define:`, `group:` and `instance:` of YAML scenes.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/yaml/yaml.h"
#include "host/scene/mesh.h"
#include "host/scene/object_transform.h"

#include <stdlib.h>
#include <string.h>

// Bound the cost of a hostile file. COPIES_MAX bounds the objects of definitions and their instances. A mesh
// counts as one object, a box as four, and a member of a group that an alias repeats as GROUP_COST.
enum { COPIES_MAX = 1 << 22, GROUP_COST = 16, DEFINITIONS_MAX = 1000 };

static bool copies_add(YamlReader *reader, size_t count, const YamlNode *node)
{
    // the file's size bounds the first reading of each group
    const size_t largest = COPIES_MAX + GROUP_COST * reader->tree.nodes.count;
    if (reader->copy_count > largest) return false; // was reported
    reader->copy_count += count;
    return reader->copy_count <= largest ||
           report_error(&reader->report, node->offset,
                        "definitions, instances and repeated groups may have at most %d objects", COPIES_MAX);
}

// Returns whether a transform moves the object but not its pattern. Images on spheres have poles along y,
// and other patterns are fixed in the world.
static bool pattern_ignores_transform(const Scene *scene, const Object *object, const Affine *affine)
{
    const Material *material = &scene->materials.items[object->material];
    const double(*m)[4] = affine->rows;
    if (material->checker.is_on) return true;
    if (material_any_texture(material) == 0 || object->type == SHAPE_MESH) return false;
    const bool turns = m[0][1] != 0 || m[0][2] != 0 || m[1][0] != 0 || m[1][2] != 0 || m[2][0] != 0 ||
                       m[2][1] != 0 || m[0][0] < 0 || m[1][1] < 0 || m[2][2] < 0;
    return object->type != SHAPE_SPHERE || turns;
}

void yaml_transform_objects(YamlReader *reader, size_t first, const Affine *affine, const YamlNode *mapping)
{
    Scene *scene = reader->scene;
    const YamlNode *transform = field_node(reader, mapping, "transform");
    if (transform == mapping) return;
    for (size_t i = first; i < scene->objects.count; i++) {
        Object *object = &scene->objects.items[i];
        const ShapeType type = object_shape(object);
        if (!reader->warned_of_pattern && pattern_ignores_transform(scene, object, affine)) {
            report_warning(&reader->report, transform->offset,
                           "checkers and images other than those of meshes do not move with their objects");
            reader->warned_of_pattern = true;
        }
        const char *why = object_transform(scene, object, affine);
        if (!why) continue;
        report_error(&reader->report, transform->offset, "under this transform a %s %s", shape_names[type],
                     why);
        return;
    }
}

void yaml_read_group(YamlReader *reader, const YamlNode *mapping)
{
    typedef struct {
        const YamlNode *objects;
        Affine transform;
    } Group;
    static const Field fields[] = {
        {"objects", read_node, offsetof(Group, objects), REQUIRED},
        {"transform", read_transform, offsetof(Group, transform)},
    };
    Group group = {.transform = affine_identity};
    if (!fields_read(reader, mapping, "group", fields, COUNT_OF(fields), &group) ||
        !copies_add(reader, GROUP_COST * (1 + (size_t)group.objects->child_count), mapping))
        return;
    const size_t first = reader->scene->objects.count;
    yaml_read_object_list(reader, group.objects, false);
    yaml_transform_objects(reader, first, &group.transform, mapping);
}

// Moves the scene's objects from `first_object` on to a definition of the key's name, except their meshes.
static Definition definition_move(YamlReader *reader, const YamlNode *key, size_t first_object)
{
    Scene *scene = reader->scene;
    Definition definition = {.name = yaml_text(&reader->tree, key),
                             .offset = key->offset,
                             .object_count = scene->objects.count - first_object};
    definition.objects = memory_allocate(definition.object_count, sizeof *definition.objects);
    for (size_t i = 0; i < definition.object_count; i++) {
        Object *object = &definition.objects[i];
        *object = scene->objects.items[first_object + i];
        if (object->type != SHAPE_MESH || object->as.mesh.is_instance) continue;
        Mesh *mesh = &scene->meshes.items[object->as.mesh.index];
        mesh->bounds = mesh_vertex_bounds(mesh);
        object->as.mesh.is_instance = true;
        object->as.mesh.transform = affine_identity;
    }
    scene->objects.count = reader->places.object_count = first_object;
    return definition;
}

static Names definition_names(const YamlReader *reader)
{
    return (Names){reader->definitions.items, reader->definitions.count, sizeof(Definition)};
}

// Returns the cost of a copy. A box counts as four objects, because it may become a mesh of 12 triangles.
static size_t definition_cost(const Definition *definition)
{
    size_t cost = 1;
    for (size_t i = 0; i < definition->object_count; i++)
        cost += definition->objects[i].type == SHAPE_BOX ? 4 : 1;
    return cost;
}

void yaml_read_definitions(YamlReader *reader, const YamlNode *node)
{
    static const Field fields[] = {{"objects", read_node, 0, REQUIRED}};
    if (!node_has_type(reader, node, YAML_MAPPING, "define")) return;
    const YamlNode *value;
    for (const YamlNode *key = yaml_first(&reader->tree, node); key && !report_is_full(&reader->report);
         key = yaml_next(&reader->tree, value)) {
        value = yaml_next(&reader->tree, key);
        if (!key_is_word(reader, key)) continue;
        const char *name = yaml_text(&reader->tree, key);
        const size_t first_object = reader->scene->objects.count;
        const YamlNode *objects = NULL;
        const size_t known = name_find(definition_names(reader), name);
        if (known < reader->definitions.count) {
            twice_report(reader, "definition", name, key->offset, reader->definitions.items[known].offset);
            continue;
        }
        if (reader->definitions.count == DEFINITIONS_MAX) {
            report_error(&reader->report, key->offset, "a scene may have at most %d definitions",
                         DEFINITIONS_MAX);
            return;
        }
        if (fields_read(reader, value, "definition", fields, COUNT_OF(fields), &objects) &&
            copies_add(reader, GROUP_COST * (1 + (size_t)objects->child_count), value))
            yaml_read_object_list(reader, objects, false);
        const Definition definition = definition_move(reader, key, first_object);
        array_push(reader->definitions, definition);
        copies_add(reader, definition_cost(&definition), value);
    }
}

// Frees the meshes that no object of the scene uses and leaves them empty.
static void unused_meshes_free(Scene *scene)
{
    OWNED bool *is_used = memory_allocate_zeroed(scene->meshes.count, sizeof *is_used);
    for (size_t i = 0; i < scene->objects.count; i++)
        if (scene->objects.items[i].type == SHAPE_MESH) is_used[scene->objects.items[i].as.mesh.index] = true;
    for (size_t i = 0; i < scene->meshes.count; i++)
        if (!is_used[i]) mesh_free(&scene->meshes.items[i]);
}

void yaml_definitions_free(YamlReader *reader)
{
    if (reader->definitions.count > 0) unused_meshes_free(reader->scene);
    for (size_t i = 0; i < reader->definitions.count; i++)
        free(reader->definitions.items[i].objects);
    free(reader->definitions.items);
}

// Returns the named definition. Reports an error and returns NULL if it is not defined before the node.
static const Definition *definition_named(YamlReader *reader, const YamlNode *node)
{
    if (node->type != YAML_SCALAR) {
        expected_report(reader, "of", "a name of 'define'", node);
        return NULL;
    }
    const Names names = definition_names(reader);
    const size_t index = name_find(names, yaml_text(&reader->tree, node));
    if (index < names.count) return &reader->definitions.items[index];
    unknown_report(reader, node, "definition", names);
    return NULL;
}

void yaml_read_instance(YamlReader *reader, const YamlNode *mapping)
{
    typedef struct {
        const YamlNode *of;
        Affine transform;
        uint32_t material;
    } Instance;
    static const Field fields[] = {
        {"of", read_node, offsetof(Instance, of), REQUIRED},
        {"transform", read_transform, offsetof(Instance, transform)},
        {"material", read_material, offsetof(Instance, material)},
    };
    Instance instance = {.transform = affine_identity, .material = UINT32_MAX};
    if (!fields_read(reader, mapping, "instance", fields, COUNT_OF(fields), &instance)) return;
    const Definition *definition = definition_named(reader, instance.of);
    if (!definition || !copies_add(reader, definition_cost(definition), mapping)) return;
    Scene *scene = reader->scene;
    const size_t first = scene->objects.count;
    const bool own_material = instance.material != UINT32_MAX;
    for (size_t i = 0; i < definition->object_count; i++) {
        Object object = definition->objects[i];
        if (own_material) object.material = instance.material;
        if (object.type == SHAPE_MESH) object.as.mesh.has_own_material |= own_material;
        if (!yaml_material_fits(reader, &object, mapping)) return;
        array_push(scene->objects, object);
    }
    yaml_transform_objects(reader, first, &instance.transform, mapping);
}
