#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/yaml/yaml.h"

#include <stdlib.h>
#include <string.h>

static bool read_checker(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Items two_colors = {2, "two colors", read_color, sizeof(Color)};
    static const Field fields[] = {
        {"colors", read_items, offsetof(Material, checker.colors), REQUIRED, .items = &two_colors},
        {"size", read_number, offsetof(Material, checker.size), OPTIONAL, &range_positive},
    };
    Material *material = target;
    material->checker.is_on = true;
    return fields_read(reader, node, field->name, fields, COUNT_OF(fields), material);
}

typedef struct {
    Color color;
    double distance;
} Absorption;

// Reads a color whose channels lie in the field's range.
static bool read_fractions(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    Color *color = target;
    return read_color(reader, field, node, color) &&
           (vector_largest(*color) <= field->range->high ||
            report_error(&reader->report, node->offset, "'%s' must be %s, not %g", field->name,
                         field->range->must, vector_largest(*color)));
}

static bool read_absorption(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Field fields[] = {
        {"color", read_fractions, offsetof(Absorption, color), REQUIRED, &range_unit},
        {"distance", read_number, offsetof(Absorption, distance), OPTIONAL, &range_positive},
    };
    Absorption absorption = {.distance = 1};
    if (!fields_read(reader, node, field->name, fields, COUNT_OF(fields), &absorption)) return false;
    *(Color *)target = color_absorption(absorption.color, absorption.distance);
    return true;
}

// Reads three numbers, or one for all channels.
static bool read_channels(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    double number;
    if (node->type != YAML_SCALAR) return read_vector(reader, field, node, target);
    if (!read_number(reader, field, node, &number)) return false;
    *(Color *)target = vector_all(number);
    return true;
}

// The indices of refraction at 650, 550 and 450 nm, interpolated from the tables of Johnson, Christy,
// Optical constants of the noble metals, Phys. Rev. B 6(12), 1972, and for aluminium of Rakic, Algorithm for
// the determination of intrinsic optical constants of metal films, Applied Optics 34(22), 1995.
static const struct {
    const char *name;
    Conductor index;
} conductors[] = {
    {"gold", {{0.15557, 0.42415, 1.3831}, {3.6024, 2.4721, 1.9155}}},
    {"silver", {{0.052225, 0.059582, 0.04}, {4.4094, 3.5974, 2.6484}}},
    {"copper", {{0.2378, 1.0066, 1.2404}, {3.6264, 2.5823, 2.3929}}},
    {"aluminium", {{1.558, 1.0152, 0.63324}, {7.7124, 6.6273, 5.4544}}},
    {"aluminum", {{1.558, 1.0152, 0.63324}, {7.7124, 6.6273, 5.4544}}},
};

// Reads the name of a metal, or its index of refraction.
static bool read_conductor(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Field fields[] = {
        {"n", read_channels, offsetof(Conductor, n), REQUIRED, &range_positive},
        {"k", read_channels, offsetof(Conductor, k), REQUIRED, &range_not_negative},
    };
    if (node->type == YAML_SEQUENCE)
        return expected_report(reader, field->name, "the name of a metal or a mapping of n and k", node);
    if (node->type == YAML_MAPPING)
        return fields_read(reader, node, field->name, fields, COUNT_OF(fields), target);
    const Names names = NAMES_OF(conductors);
    const size_t row = name_find(names, yaml_text(&reader->tree, node));
    if (row == names.count) return unknown_report(reader, node, field->name, names);
    *(Conductor *)target = conductors[row].index;
    return true;
}

// Returns the path of the node's file, which is the scene's for a value of --set.
static const char *node_file(const YamlReader *reader, const YamlNode *node)
{
    const Source *scene_source = reader->report.source;
    size_t offset = node->offset;
    const Source *source = source_at(scene_source, &offset);
    for (const Source *set = reader->scene->overrides; set; set = set->next)
        if (set == source) return scene_source->file;
    return source->file;
}

char *yaml_read_path(YamlReader *reader, const char *name, const YamlNode *node)
{
    if (!yaml_text(&reader->tree, node)[0]) {
        expected_report(reader, name, "the name of a file", node);
        return NULL;
    }
    const char *naming_file = node_file(reader, node), *file = yaml_text(&reader->tree, node);
    const char *slash = strrchr(naming_file, '/');
    int folder_length = slash && file[0] != '/' ? (int)(slash + 1 - naming_file) : 0;
    char *path = text_format("%.*s%s", folder_length, naming_file, file);
    scene_file_named(reader->options, path);
    return path;
}

// Reads a file's name, or a mapping of a file and its layer.
static bool content_read(YamlReader *reader, const Field *field, const YamlNode *node, TextureContent content,
                         uint32_t *target)
{
    typedef struct {
        const YamlNode *file, *layer;
    } ImageNodes;
    static const Field fields[] = {
        {"file", read_node, offsetof(ImageNodes, file), REQUIRED},
        {"layer", read_node, offsetof(ImageNodes, layer)},
    };
    ImageNodes nodes = {.file = node};
    if (node->type == YAML_MAPPING &&
        !fields_read(reader, node, field->name, fields, COUNT_OF(fields), &nodes))
        return false;
    if (nodes.layer && !yaml_text(&reader->tree, nodes.layer)[0])
        return expected_report(reader, "layer", "the name of a layer", nodes.layer);
    OWNED char *path = yaml_read_path(reader, field->name, nodes.file);
    if (!path) return false;
    node = nodes.file;
    const char *layer = nodes.layer ? yaml_text(&reader->tree, nodes.layer) : NULL;
    *target = scene_add_texture(reader->scene, path, layer, content, node->offset);
    return *target > 0 || report_error(&reader->report, node->offset, "a scene may have at most %d textures",
                                       SCENE_TEXTURES_MAX);
}

bool read_texture(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    return content_read(reader, field, node, TEXTURE_COLORS, target);
}

static bool read_normal_map(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    return content_read(reader, field, node, TEXTURE_NORMALS, target);
}

// Reads a factor or a color in the field's range into a TintedFactor.
static bool read_tinted(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    TintedFactor *factor = target;
    Color channels = {0, 0, 0};
    const char *text = yaml_text(&reader->tree, node);
    *factor = (TintedFactor){0};
    if (text[0] != '\0' && strchr("+-.0123456789", text[0]))
        return read_number(reader, field, node, &factor->largest);
    if (!read_strength(reader, field, node, &channels)) return false;
    *factor = (TintedFactor){vector_largest(channels), color_tint(channels)};
    return factor->largest <= field->range->high ||
           report_error(&reader->report, node->offset, "'%s' must be %s, not %g", field->name,
                        field->range->must, factor->largest);
}

static bool read_shadow(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    bool has_shadow;
    if (!read_boolean(reader, field, node, &has_shadow)) return false;
    *(ShadowType *)target = has_shadow ? SHADOW_OF_TRANSMISSION : SHADOW_NONE;
    return true;
}

// Warns of a surface that passes on more light than it receives, which each bounce multiplies. Ignores
// diffuse light, most of which remains under reflection by angle, as in plastic. Sums of decimals round.
static void energy_check(YamlReader *reader, const Material *material, const YamlNode *node)
{
    const double reflection = material->reflection.largest, transmission = material->transmission.largest;
    const bool is_fraction_of_transmission = material->fresnel && transmission > 0;
    if (reflection + transmission <= 1 + 1e-9) return;
    report_warning(&reader->report, field_node(reader, node, "reflection")->offset,
                   "reflection %g and transmission %g exceed 1 together, so the surface adds light%s",
                   reflection, transmission,
                   is_fraction_of_transmission ? "; by 'fresnel' it reflects a part of its transmission"
                                               : "");
}

// Reports keys that have a meaning only with textures, and returns false if there are any.
static bool textures_check(YamlReader *reader, const Material *material, const YamlNode *node)
{
    const YamlNode *size = field_node(reader, node, "size"),
                   *strength = field_node(reader, node, "normal_strength");
    bool fit = true;
    if (size != node && material->image.texture == 0 && material->normal_map.texture == 0)
        fit = report_error(&reader->report, size->offset, "'size' needs an 'image' or a 'normal_map'");
    if (strength != node && material->normal_map.texture == 0)
        fit = report_error(&reader->report, strength->offset, "'normal_strength' needs a 'normal_map'");
    return fit;
}

// Adds a material, which is the default one for a `node` of NULL. Reports errors and returns false if it is
// invalid.
static bool material_append(YamlReader *reader, const YamlNode *node, const char *name)
{
    static const Field fields[] = {
        {"color", read_color, offsetof(Material, color), FORM_FIRST},
        {"checker", read_checker, 0, FORM_SECOND},
        {"image", read_texture, offsetof(Material, image.texture), REQUIRED | FORM_THIRD},
        {"size", read_number, offsetof(Material, texture_size), FORM_FIRST | FORM_THIRD, &range_positive},
        {"cutout", read_number, offsetof(Material, cutout.threshold), FORM_THIRD, &range_unit},
        {"normal_map", read_normal_map, offsetof(Material, normal_map.texture), FORM_FIRST | FORM_THIRD},
        {"normal_strength", read_number, offsetof(Material, normal_map.strength), FORM_FIRST | FORM_THIRD,
         &range_not_negative},
        {"ambient", read_number, offsetof(Material, ambient), OPTIONAL, &range_not_negative},
        {"diffuse", read_strength, offsetof(Material, diffuse)},
        {"specular", read_tinted, offsetof(Material, specular), OPTIONAL, &range_not_negative},
        {"shininess", read_number, offsetof(Material, shininess), OPTIONAL, &range_not_negative},
        {"reflection", read_tinted, offsetof(Material, reflection), OPTIONAL, &range_unit},
        {"transmission", read_tinted, offsetof(Material, transmission), OPTIONAL, &range_unit},
        {"ior", read_number, offsetof(Material, ior), OPTIONAL, &range_positive},
        {"absorption", read_absorption, offsetof(Material, absorption)},
        {"emission", read_strength, offsetof(Material, emission)},
        {"conductor", read_conductor, offsetof(Material, conductor)},
        {"fresnel", read_boolean, offsetof(Material, fresnel)},
        {"shadow", read_shadow, offsetof(Material, shadow)},
    };
    Material material = material_default();
    const YamlNode *conductor = node ? field_node(reader, node, "conductor") : NULL;
    if (conductor != node) { // the default of a metal
        material.reflection.largest = 1;
        material.ambient = 0;
        material.diffuse = vector_all(0);
    }
    bool is_read =
        !node || (fields_read(reader, node, "material", fields, COUNT_OF(fields), &material) != 0 &&
                  textures_check(reader, &material, node));
    if (material.cutout.threshold > 0) material.cutout.texture = material.image.texture;
    if (conductor != node && (material.fresnel || material.transmission.largest > 0))
        is_read = report_error(&reader->report, conductor->offset, "'conductor' cannot be combined with '%s'",
                               material.fresnel ? "fresnel" : "transmission");
    if (is_read && node) energy_check(reader, &material, node);
    scene_add_material(reader->scene, &material, name);
    return is_read;
}

static int material_names_compare(const void *a, const void *b)
{
    const MaterialName *first = a, *second = b;
    int order = strcmp(first->name, second->name);
    return order ? order : (first->material > second->material) - (first->material < second->material);
}

static int material_name_matches(const void *word, const void *name)
{
    return strcmp(word, ((const MaterialName *)name)->name);
}

void yaml_read_materials(YamlReader *reader, const YamlNode *node)
{
    if (!node_has_type(reader, node, YAML_MAPPING, "materials")) return;
    const YamlNode *value;
    for (const YamlNode *key = yaml_first(&reader->tree, node); key; key = yaml_next(&reader->tree, value)) {
        value = yaml_next(&reader->tree, key);
        if (!key_is_word(reader, key)) continue;
        MaterialName name = {.name = yaml_text(&reader->tree, key),
                             .material = (uint32_t)reader->scene->materials.count,
                             .offset = key->offset};
        array_push(reader->names, name);
        material_append(reader, value, name.name);
    }
    if (!reader->names.count) return;
    qsort(reader->names.items, reader->names.count, sizeof(MaterialName), material_names_compare);
    for (size_t i = 1; i < reader->names.count && !report_is_full(&reader->report); i++) {
        const MaterialName *name = &reader->names.items[i];
        if (!strcmp(name[-1].name, name->name))
            twice_report(reader, "material", name->name, name->offset, name[-1].offset);
    }
}

static bool unknown_material_report(YamlReader *reader, const YamlNode *node)
{
    const char *text = yaml_text(&reader->tree, node), *quote = text[0] == '#' ? "'" : "";
    if (is_color_text(text))
        return report_error(&reader->report, node->offset,
                            "unknown material '%s'; for the color, write {color: %s%s%s}", text, quote, text,
                            quote);
    const Names names = {reader->names.items, reader->names.count, sizeof(MaterialName)};
    return unknown_report(reader, node, "material", names);
}

bool read_material(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    uint32_t *index = target;
    if (node->type == YAML_MAPPING) {
        *index = (uint32_t)reader->scene->materials.count;
        return material_append(reader, node, "");
    }
    if (!yaml_text(&reader->tree, node)[0])
        return expected_report(reader, field->name, "the name of a material or a mapping", node);
    const MaterialName *name = reader->names.count
                                   ? bsearch(yaml_text(&reader->tree, node), reader->names.items,
                                             reader->names.count, sizeof(MaterialName), material_name_matches)
                                   : NULL;
    if (!name) return unknown_material_report(reader, node);
    *index = name->material;
    return true;
}

uint32_t material_default_index(YamlReader *reader)
{
    if (reader->default_material == UINT32_MAX) {
        reader->default_material = (uint32_t)reader->scene->materials.count;
        material_append(reader, NULL, "");
    }
    return reader->default_material;
}
