#include "host/base/array.h"
#include "host/import/yaml/yaml.h"

#include <string.h>

static const Range range_half_turn = {0, 180, true, "greater than 0 and less than 180"};

typedef struct {
    Light light;
    double intensity;
} LightFields;

// Takes `inverse_square`, or what divides the strength at a distance d: constant + linear d + quadratic d^2.
static bool read_falloff(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Field fields[] = {
        {"constant", read_number, 0, FORM_ANY, OPTIONAL, &range_not_negative},
        {"linear", read_number, sizeof(double), FORM_ANY, OPTIONAL, &range_not_negative},
        {"quadratic", read_number, 2 * sizeof(double), FORM_ANY, OPTIONAL, &range_not_negative},
    };
    double *fading = target;
    if (node->kind == YAML_SCALAR && strcmp(yaml_text(&reader->tree, node), "inverse_square") == 0) {
        fading[2] = 1;
        return true;
    }
    if (node->kind != YAML_MAPPING)
        return expected_report(reader, field->name, "inverse_square or a mapping", node);
    if (!fields_read(reader, node, field->name, fields, COUNT_OF(fields), fading, NULL)) return false;
    return fading[0] + fading[1] + fading[2] > 0 ||
           report_error(&reader->report, node->offset, "'%s' needs a number above 0", field->name);
}

#define FALLOFF                                                                                              \
    {                                                                                                        \
        "falloff", read_falloff, offsetof(LightFields, light.fading), FORM_ANY, OPTIONAL, NULL               \
    }

#define COLOR                                                                                                \
    {"color", read_strength, offsetof(LightFields, light.color), FORM_ANY, OPTIONAL, NULL},                  \
    {                                                                                                        \
        "intensity", read_number, offsetof(LightFields, intensity), FORM_ANY, OPTIONAL, &range_not_negative  \
    }

static const Field point_fields[] = {
    {"position", read_vector, offsetof(LightFields, light.position), FORM_ANY, REQUIRED, NULL},
    FALLOFF,
    COLOR,
};

static const Field directional_fields[] = {
    {"direction", read_direction, offsetof(LightFields, light.direction), FORM_ANY, REQUIRED, NULL},
    COLOR,
};

// `look_at` and `direction` share a member: a target becomes a direction at the end.
static const Field spot_fields[] = {
    {"position", read_vector, offsetof(LightFields, light.position), FORM_ANY, REQUIRED, NULL},
    {"look_at", read_vector, offsetof(LightFields, light.direction), FORM_FIRST, REQUIRED, NULL},
    {"direction", read_direction, offsetof(LightFields, light.direction), FORM_SECOND, REQUIRED, NULL},
    {"angle", read_number, offsetof(LightFields, light.half_angle), FORM_ANY, REQUIRED, &range_half_turn},
    {"penumbra", read_number, offsetof(LightFields, light.penumbra), FORM_ANY, OPTIONAL, &range_not_negative},
    FALLOFF,
    COLOR,
};

static bool spot_finish(YamlReader *reader, const YamlNode *mapping, Form form, Light *light)
{
    if (form == FORM_FIRST) light->direction = vector_subtract(light->direction, light->position);
    if (vector_is_zero(light->direction))
        return report_error(&reader->report, field_node(reader, mapping, "look_at")->offset,
                            "'look_at' must differ from 'position'");
    if (light->penumbra > light->half_angle)
        return report_error(&reader->report, field_node(reader, mapping, "penumbra")->offset,
                            "'penumbra' must not exceed 'angle'");
    return true;
}

static const struct {
    const Field *fields;
    size_t field_count;
} light_kinds[] = {
    [LIGHT_POINT] = {point_fields, COUNT_OF(point_fields)},
    [LIGHT_DIRECTIONAL] = {directional_fields, COUNT_OF(directional_fields)},
    [LIGHT_SPOT] = {spot_fields, COUNT_OF(spot_fields)},
};

static const char *const light_names[COUNT_OF(light_kinds)] = {"point", "directional", "spot"};

static void light_read(YamlReader *reader, const YamlNode *item)
{
    const YamlNode *key, *mapping;
    if (!single_pair(reader, item, "one light, such as `point: {...}`", &key, &mapping)) return;
    size_t kind = 0;
    while (kind < COUNT_OF(light_names) && strcmp(yaml_text(&reader->tree, key), light_names[kind]) != 0)
        kind++;
    if (kind == COUNT_OF(light_names)) {
        unknown_report(reader, key, "light", light_names, COUNT_OF(light_names));
        return;
    }
    LightFields fields = {.light = {.kind = (LightKind)kind, .color = {1, 1, 1}}, .intensity = 1};
    Form form;
    if (!fields_read(reader, mapping, light_names[kind], light_kinds[kind].fields,
                     light_kinds[kind].field_count, &fields, &form))
        return;
    if (kind == LIGHT_SPOT && !spot_finish(reader, mapping, form, &fields.light)) return;
    fields.light.color = vector_scale(fields.light.color, fields.intensity);
    light_fold_fading(&fields.light);
    array_push(reader->scene->lights, fields.light);
}

void yaml_read_lights(YamlReader *reader, const YamlNode *node)
{
    if (node->kind != YAML_SEQUENCE) {
        expected_report(reader, "lights", "a list", node);
        return;
    }
    for (const YamlNode *item = yaml_first(&reader->tree, node); item && !report_is_full(&reader->report);
         item = yaml_next(&reader->tree, item))
        light_read(reader, item);
}
