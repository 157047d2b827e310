#include "host/base/array.h"
#include "host/import/yaml/yaml.h"
#include "host/scene/polygon.h"
#include "host/scene/portable.h"

#include <string.h>

const Range range_disc_angle = {0, 90, false, "from 0 to 90"};

typedef struct {
    Light light;
    double intensity, angle;
    Vector3 edges[2], normal, vertices[3];
} LightFields;

// Reads `inverse_square`, or the divisor constant + linear d + quadratic d^2 of the strength at distance d.
static bool read_falloff(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Field fields[] = {
        {"constant", read_number, 0, OPTIONAL, &range_not_negative},
        {"linear", read_number, sizeof(double), OPTIONAL, &range_not_negative},
        {"quadratic", read_number, 2 * sizeof(double), OPTIONAL, &range_not_negative},
    };
    double *fading = target;
    if (yaml_is(&reader->tree, node, "inverse_square")) {
        fading[2] = 1;
        return true;
    }
    if (node->type != YAML_MAPPING)
        return expected_report(reader, field->name, "inverse_square or a mapping", node);
    if (!fields_read(reader, node, field->name, fields, COUNT_OF(fields), fading)) return false;
    return fading[0] + fading[1] + fading[2] > 0 ||
           report_error(&reader->report, node->offset, "'%s' needs at least one number above 0", field->name);
}

// The last rows of the tables of all lights, of those that may fade, and of those with an area.
#define EVERY_LIGHT                                                                                          \
    {"color", read_strength, offsetof(LightFields, light.color)},                                            \
    {                                                                                                        \
        "intensity", read_number, offsetof(LightFields, intensity), OPTIONAL, &range_not_negative            \
    }
#define FADING_LIGHT {"falloff", read_falloff, offsetof(LightFields, light.fading)}, EVERY_LIGHT
#define AREA_LIGHT   {"visible", read_boolean, offsetof(LightFields, light.area.is_visible)}, FADING_LIGHT

static const Field point_fields[] = {
    {"position", read_vector, offsetof(LightFields, light.position), REQUIRED},
    FADING_LIGHT,
};

static const Field directional_fields[] = {
    {"direction", read_direction, offsetof(LightFields, light.direction), REQUIRED},
    {"angle", read_number, offsetof(LightFields, angle), OPTIONAL, &range_disc_angle},
    EVERY_LIGHT,
};

// `look_at` and `direction` share a member, in which a target finally becomes a direction.
static const Field spot_fields[] = {
    {"position", read_vector, offsetof(LightFields, light.position), REQUIRED},
    {"look_at", read_vector, offsetof(LightFields, light.direction), REQUIRED | FORM_FIRST},
    {"direction", read_direction, offsetof(LightFields, light.direction), REQUIRED | FORM_SECOND},
    {"angle", read_number, offsetof(LightFields, light.spot.half_angle), REQUIRED, &range_half_turn},
    {"penumbra", read_number, offsetof(LightFields, light.spot.penumbra), OPTIONAL, &range_not_negative},
    {"radius", read_number, offsetof(LightFields, light.area.radius), OPTIONAL, &range_not_negative},
    FADING_LIGHT,
};

static const Field sphere_fields[] = {
    {"center", read_vector, offsetof(LightFields, light.position), REQUIRED},
    {"radius", read_number, offsetof(LightFields, light.area.radius), REQUIRED, &range_positive},
    AREA_LIGHT,
};

static const Items two_directions = {2, "two vectors", read_direction, sizeof(Vector3)};

static const Field rectangle_fields[] = {
    {"center", read_vector, offsetof(LightFields, light.position), REQUIRED},
    {"edges", read_items, offsetof(LightFields, edges), REQUIRED, .items = &two_directions},
    AREA_LIGHT,
};

static const Field disc_fields[] = {
    {"center", read_vector, offsetof(LightFields, light.position), REQUIRED},
    {"normal", read_direction, offsetof(LightFields, normal), REQUIRED},
    {"radius", read_number, offsetof(LightFields, light.area.radius), REQUIRED, &range_positive},
    AREA_LIGHT,
};

static const Field triangle_fields[] = {
    {"vertices", read_items, offsetof(LightFields, vertices), REQUIRED, .items = &three_points},
    AREA_LIGHT,
};

static bool spot_finish(YamlReader *reader, const YamlNode *mapping, Form form, Light *light)
{
    if (form == FORM_FIRST) light->direction = vector_subtract(light->direction, light->position);
    if (vector_is_zero(light->direction))
        return field_fails(reader, mapping, "look_at", "'look_at' must differ from 'position'");
    if (light->spot.penumbra > light->spot.half_angle)
        return field_fails(reader, mapping, "penumbra", "'penumbra' must not exceed 'angle'");
    return true;
}

// Sets two vectors of the given length, perpendicular to a direction and to each other.
static void across_set(Vector3 across[2], Vector3 direction, double length)
{
    const Vector3 axis = vector_normalize(direction);
    const Vector3 u = vector_normalize(vector_cross(axis, vector_least_aligned_axis(axis)));
    across[0] = vector_scale(u, length);
    across[1] = vector_scale(vector_cross(axis, u), length);
}

void light_set_angle(Light *light, double degrees)
{
    if (degrees == 0) return;
    const double length = vector_length(light->direction);
    across_set(light->area.across, light->direction, length * portable_tangent(degrees * (M_PI / 360)));
    light->area.type = AREA_ELLIPSE;
}

// Sets the light's area.
static void area_set(LightFields *read)
{
    Light *light = &read->light;
    if (light->type == LIGHT_DIRECTIONAL) {
        light_set_angle(light, read->angle);
    } else if (light->area.type == AREA_ELLIPSE) {
        across_set(light->area.across, read->normal, light->area.radius);
    } else if (light->area.type == AREA_RECTANGLE) {
        light->area.across[0] = vector_scale(read->edges[0], 0.5);
        light->area.across[1] = vector_scale(read->edges[1], 0.5);
    } else if (light->area.type == AREA_TRIANGLE) {
        const Vector3 *vertices = read->vertices;
        for (int i = 0; i < 2; i++)
            light->area.across[i] = vector_subtract(vertices[i + 1], vertices[0]);
        const Vector3 diagonal = vector_add(light->area.across[0], light->area.across[1]);
        light->position = vector_add(vertices[0], vector_scale(diagonal, 0.25));
    } else if (light->area.radius > 0) {
        light->area.type = AREA_SPHERE;
    }
}

static const struct {
    const char *name;
    LightType type;
    LightAreaType area;
    const Field *fields;
    size_t field_count;
} light_types[] = {
    {"point", LIGHT_POINT, AREA_NONE, FIELDS(point_fields)},
    {"directional", LIGHT_DIRECTIONAL, AREA_NONE, FIELDS(directional_fields)},
    {"spot", LIGHT_SPOT, AREA_NONE, FIELDS(spot_fields)},
    {"sphere", LIGHT_POINT, AREA_SPHERE, FIELDS(sphere_fields)},
    {"rectangle", LIGHT_POINT, AREA_RECTANGLE, FIELDS(rectangle_fields)},
    {"disc", LIGHT_POINT, AREA_ELLIPSE, FIELDS(disc_fields)},
    {"triangle", LIGHT_POINT, AREA_TRIANGLE, FIELDS(triangle_fields)},
};

static bool light_read(YamlReader *reader, const YamlNode *item)
{
    const YamlNode *mapping;
    const size_t row = choice_read(reader, item, "light", NAMES_OF(light_types), &mapping);
    if (row == COUNT_OF(light_types)) return false;
    LightFields fields = {
        .light = {.type = light_types[row].type, .color = {1, 1, 1}, .area.type = light_types[row].area},
        .intensity = 1,
    };
    Light *light = &fields.light;
    const Form form = fields_read(reader, mapping, light_types[row].name, light_types[row].fields,
                                  light_types[row].field_count, &fields);
    if (!form || (light->type == LIGHT_SPOT && !spot_finish(reader, mapping, form, light))) return false;
    const Vector3 across = vector_cross(vector_normalize(fields.edges[0]), vector_normalize(fields.edges[1])),
                  *vertices = fields.vertices;
    if (light->area.type == AREA_RECTANGLE && vector_length(across) < 1e-9)
        return field_fails(reader, mapping, "edges", "'edges' must not be parallel");
    if (light->area.type == AREA_TRIANGLE && !triangle_has_area(vertices[0], vertices[1], vertices[2]))
        return field_fails(reader, mapping, "vertices", "'vertices' must not be on one line");
    area_set(&fields);
    light->color = vector_scale(light->color, fields.intensity);
    light_fold_fading(light);
    array_push(reader->scene->lights, *light);
    return true;
}

void yaml_read_lights(YamlReader *reader, const YamlNode *node)
{
    if (!node_has_type(reader, node, YAML_SEQUENCE, "lights")) return;
    for (const YamlNode *item = yaml_first(&reader->tree, node); item && !report_is_full(&reader->report);
         item = yaml_next(&reader->tree, item))
        light_read(reader, item);
}
