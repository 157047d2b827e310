#include "host/base/array.h"
#include "host/import/place.h"
#include "host/import/yaml/yaml.h"
#include "host/scene/oval.h"
#include "host/scene/polygon.h"
#include "host/scene/portable.h"

#include <string.h>

static const Range range_quarter_turn = {0, 90, true, "greater than 0 and less than 90"};

// The forms of a cylinder and a cone, and those of a paraboloid.
enum { FORM_FINITE = FORM_FIRST, FORM_INFINITE = FORM_SECOND };
enum { FORM_FOCAL_LENGTH = FORM_FIRST, FORM_RADIUS = FORM_SECOND };

typedef struct {
    Object object; // first: fields have its offsets
    Affine transform;
} PlacedObject;

// The last rows of every shape's table.
#define EVERY_SHAPE                                                                                          \
    {"material", read_material, offsetof(Object, material)},                                                 \
    {                                                                                                        \
        "transform", read_transform, offsetof(PlacedObject, transform)                                       \
    }

static const Field sphere_fields[] = {
    {"center", read_vector, offsetof(Object, as.sphere.center), REQUIRED},
    {"radius", read_number, offsetof(Object, as.sphere.radius), REQUIRED, &range_positive},
    EVERY_SHAPE,
};

static const Field plane_fields[] = {
    {"point", read_vector, offsetof(Object, as.plane.point), REQUIRED},
    {"normal", read_direction, offsetof(Object, as.plane.normal), REQUIRED},
    EVERY_SHAPE,
};

static const Field disc_fields[] = {
    {"center", read_vector, offsetof(Object, as.disc.center), REQUIRED},
    {"normal", read_direction, offsetof(Object, as.disc.normal), REQUIRED},
    {"radius", read_number, offsetof(Object, as.disc.radius), REQUIRED, &range_positive},
    EVERY_SHAPE,
};

static const Field box_fields[] = {
    {"min", read_vector, offsetof(Object, as.box.min), REQUIRED},
    {"max", read_vector, offsetof(Object, as.box.max), REQUIRED},
    EVERY_SHAPE,
};

static bool box_finish(YamlReader *reader, const YamlNode *mapping, Form form, Object *object)
{
    (void)form;
    Vector3 min = object->as.box.min, max = object->as.box.max;
    if (min.x <= max.x && min.y <= max.y && min.z <= max.z) return true;
    return field_fails(reader, mapping, "max", "'max' must not be below 'min'");
}

// `from` and `to` share members with `point` and `axis`. Until cylinder_finish the axis holds the finite
// form's `to`.
static const Field cylinder_fields[] = {
    {"from", read_vector, offsetof(Object, as.cylinder.from), REQUIRED | FORM_FINITE},
    {"to", read_vector, offsetof(Object, as.cylinder.axis), REQUIRED | FORM_FINITE},
    {"point", read_vector, offsetof(Object, as.cylinder.from), REQUIRED | FORM_INFINITE},
    {"axis", read_direction, offsetof(Object, as.cylinder.axis), REQUIRED | FORM_INFINITE},
    {"radius", read_number, offsetof(Object, as.cylinder.radius), REQUIRED, &range_positive},
    {"caps", read_boolean, offsetof(Object, as.cylinder.caps), FORM_FINITE},
    EVERY_SHAPE,
};

static bool axis_finish(YamlReader *reader, const YamlNode *mapping, Vector3 from, Vector3 *axis)
{
    *axis = vector_subtract(*axis, from);
    return !vector_is_zero(*axis) || field_fails(reader, mapping, "to", "'to' must differ from 'from'");
}

static bool cylinder_finish(YamlReader *reader, const YamlNode *mapping, Form form, Object *object)
{
    object->as.cylinder.finite = form == FORM_FINITE;
    object->as.cylinder.caps &= object->as.cylinder.finite;
    return form == FORM_INFINITE ||
           axis_finish(reader, mapping, object->as.cylinder.from, &object->as.cylinder.axis);
}

// `from` and `to` share members with `apex` and `axis`. Until cone_finish the axis holds the finite form's
// `to`, and the slope the infinite form's angle in degrees.
static const Field cone_fields[] = {
    {"from", read_vector, offsetof(Object, as.cone.from), REQUIRED | FORM_FINITE},
    {"to", read_vector, offsetof(Object, as.cone.axis), REQUIRED | FORM_FINITE},
    {"radius", read_items, offsetof(Object, as.cone.radius), REQUIRED | FORM_FINITE, &range_not_negative,
     .items = &two_numbers},
    {"caps", read_boolean, offsetof(Object, as.cone.caps), FORM_FINITE},
    {"apex", read_vector, offsetof(Object, as.cone.from), REQUIRED | FORM_INFINITE},
    {"axis", read_direction, offsetof(Object, as.cone.axis), REQUIRED | FORM_INFINITE},
    {"angle", read_number, offsetof(Object, as.cone.slope), REQUIRED | FORM_INFINITE, &range_quarter_turn},
    EVERY_SHAPE,
};

static bool cone_finish(YamlReader *reader, const YamlNode *mapping, Form form, Object *object)
{
    object->as.cone.finite = form == FORM_FINITE;
    object->as.cone.caps &= object->as.cone.finite;
    if (form == FORM_INFINITE) {
        object->as.cone.slope = portable_tangent(object->as.cone.slope * (M_PI / 180));
        return true;
    }
    if (object->as.cone.radius[0] == 0 && object->as.cone.radius[1] == 0)
        return field_fails(reader, mapping, "radius", "'radius' must not be zero at both ends");
    return axis_finish(reader, mapping, object->as.cone.from, &object->as.cone.axis);
}

static const Items three_directions = {3, "three directions", read_direction, sizeof(Vector3)};

static const Field triangle_fields[] = {
    {"vertices", read_items, offsetof(Object, as.triangle.vertices), REQUIRED, .items = &three_points},
    {"normals", read_items, offsetof(Object, as.triangle.normals), .items = &three_directions},
    EVERY_SHAPE,
};

static bool triangle_finish(YamlReader *reader, const YamlNode *mapping, Form form, Object *object)
{
    (void)form;
    const Vector3 *vertices = object->as.triangle.vertices;
    object->as.triangle.smooth = !vector_is_zero(object->as.triangle.normals[0]);
    if (!triangle_has_area(vertices[0], vertices[1], vertices[2]))
        report_warning(&reader->report, mapping->offset, "the triangle has no area and is never hit");
    return true;
}

static const Field torus_fields[] = {
    {"center", read_vector, offsetof(Object, as.torus.center), REQUIRED},
    {"axis", read_direction, offsetof(Object, as.torus.axis), REQUIRED},
    {"major", read_number, offsetof(Object, as.torus.major), REQUIRED, &range_positive},
    {"minor", read_number, offsetof(Object, as.torus.minor), REQUIRED, &range_positive},
    EVERY_SHAPE,
};

// Until paraboloid_finish the focal length holds `radius`, the radius of the rim.
static const Field paraboloid_fields[] = {
    {"apex", read_vector, offsetof(Object, as.paraboloid.apex), REQUIRED},
    {"axis", read_direction, offsetof(Object, as.paraboloid.axis), REQUIRED},
    {"height", read_number, offsetof(Object, as.paraboloid.height), OPTIONAL, &range_positive},
    {"focal_length", read_number, offsetof(Object, as.paraboloid.focal_length), REQUIRED | FORM_FOCAL_LENGTH,
     &range_positive},
    {"radius", read_number, offsetof(Object, as.paraboloid.focal_length), REQUIRED | FORM_RADIUS,
     &range_positive},
    {"caps", read_boolean, offsetof(Object, as.paraboloid.caps)},
    EVERY_SHAPE,
};

static bool paraboloid_finish(YamlReader *reader, const YamlNode *mapping, Form form, Object *object)
{
    object->as.paraboloid.finite = object->as.paraboloid.height > 0;
    if (!object->as.paraboloid.finite && field_node(reader, mapping, "caps") != mapping)
        return field_fails(reader, mapping, "caps", "'caps' needs a 'height'");
    if (form == FORM_FOCAL_LENGTH) return true;
    if (!object->as.paraboloid.finite)
        return report_error(&reader->report, mapping->offset,
                            "a paraboloid with a 'radius' needs a 'height'");
    const double radius = object->as.paraboloid.focal_length;
    object->as.paraboloid.focal_length = radius / object->as.paraboloid.height * radius / 4;
    return true;
}

static const Range range_exponent = {2, 16, false, "an even number from 2 to 16"};

// Until superellipsoid_finish the first axis holds `radii`.
static const Field superellipsoid_fields[] = {
    {"center", read_vector, offsetof(Object, as.superellipsoid.center), REQUIRED},
    {"radii", read_vector, offsetof(Object, as.superellipsoid.axes), REQUIRED, &range_positive},
    {"exponent", read_number, offsetof(Object, as.superellipsoid.exponent), REQUIRED, &range_exponent},
    EVERY_SHAPE,
};

static bool superellipsoid_finish(YamlReader *reader, const YamlNode *mapping, Form form, Object *object)
{
    (void)form;
    Vector3 *axes = object->as.superellipsoid.axes;
    const Vector3 radii = axes[0];
    axes[0] = (Vector3){radii.x, 0, 0};
    axes[1] = (Vector3){0, radii.y, 0};
    axes[2] = (Vector3){0, 0, radii.z};
    if (!axes_are_moderate(axes))
        return field_fails(reader, mapping, "radii",
                           "'radii' must be within a factor of a million of each other");
    return fmod(object->as.superellipsoid.exponent, 2) == 0 ||
           field_fails(reader, mapping, "exponent", "'exponent' must be an even number from 2 to 16");
}

typedef struct {
    Object start; // defaults
    const Field *fields;
    size_t field_count;
    // Checks fields against each other and derives members. Reports an error and returns false if they do not
    // fit. May be NULL.
    bool (*finish)(YamlReader *reader, const YamlNode *mapping, Form form, Object *object);
    bool takes_texture; // whether its material may have a texture
} Shape;

// The shapes by ShapeType, except meshes, which have a separate reader.
static const Shape shapes[SHAPE_OVAL] = {
    {{.type = SHAPE_SPHERE}, FIELDS(sphere_fields), NULL, true},
    {{.type = SHAPE_PLANE}, FIELDS(plane_fields), NULL, true},
    {{.type = SHAPE_DISC}, FIELDS(disc_fields), NULL, true},
    {{.type = SHAPE_BOX}, FIELDS(box_fields), box_finish, false},
    {{.type = SHAPE_CYLINDER, .as.cylinder.caps = true}, FIELDS(cylinder_fields), cylinder_finish, false},
    {{.type = SHAPE_CONE, .as.cone.caps = true}, FIELDS(cone_fields), cone_finish, false},
    {{.type = SHAPE_TRIANGLE}, FIELDS(triangle_fields), triangle_finish, false},
    {{.type = SHAPE_TORUS}, FIELDS(torus_fields), NULL, false},
    {{.type = SHAPE_PARABOLOID, .as.paraboloid.caps = true},
     FIELDS(paraboloid_fields),
     paraboloid_finish,
     false},
    {{.type = SHAPE_SUPERELLIPSOID}, FIELDS(superellipsoid_fields), superellipsoid_finish, false},
};

bool yaml_material_fits(YamlReader *reader, const Object *object, const YamlNode *mapping)
{
    if (material_any_texture(&reader->scene->materials.items[object->material]) == 0) return true;
    const YamlNode *node = field_node(reader, mapping, "material");
    if (object->type == SHAPE_MESH)
        return reader->scene->meshes.items[object->as.mesh.index].uvs ||
               report_error(&reader->report, node->offset,
                            "the mesh has no texture coordinates for the material's images");
    return (object->type != SHAPE_OVAL && shapes[object->type].takes_texture) ||
           report_error(&reader->report, node->offset,
                        "images and normal maps lie on a sphere, plane, disc or mesh, not on a %s%s",
                        object->type == SHAPE_OVAL ? "stretched " : "", shape_names[object_shape(object)]);
}

static void shape_read(YamlReader *reader, ShapeType type, const YamlNode *mapping)
{
    const Shape *shape = &shapes[type];
    PlacedObject placed = {.object = shape->start, .transform = affine_identity};
    Object *object = &placed.object;
    object->material = UINT32_MAX;
    const Form form =
        fields_read(reader, mapping, shape_names[type], shape->fields, shape->field_count, &placed);
    if (!form) return;
    if (shape->finish && !shape->finish(reader, mapping, form, object)) return;
    if (object->material == UINT32_MAX) object->material = material_default_index(reader);
    if (!yaml_material_fits(reader, object, mapping)) return;
    array_push(reader->scene->objects, *object);
    yaml_transform_objects(reader, reader->scene->objects.count - 1, &placed.transform, mapping);
}

#define SHAPE_WORD(NAME, name, ...) name,

static void object_read(YamlReader *reader, const YamlNode *item)
{
    static const char *const names[] = {SCENE_SHAPE_LIST(SHAPE_WORD) "mesh", "group", "instance"};
    static void (*const compound_readers[])(YamlReader *, const YamlNode *) = {
        yaml_read_mesh, yaml_read_group, yaml_read_instance};
    const YamlNode *mapping;
    const size_t type = choice_read(reader, item, "shape", NAMES_OF(names), &mapping);
    if (type < SHAPE_OVAL)
        shape_read(reader, (ShapeType)type, mapping);
    else if (type < COUNT_OF(names))
        compound_readers[type - SHAPE_OVAL](reader, mapping);
}

void yaml_read_object_list(YamlReader *reader, const YamlNode *list, bool shows_progress)
{
    if (!node_has_type(reader, list, YAML_SEQUENCE, "objects")) return;
    Stage *stage = shows_progress ? reader->options->stage : NULL;
    size_t done = 0, mesh_count = SIZE_MAX;
    for (const YamlNode *item = yaml_first(&reader->tree, list); item && !report_is_full(&reader->report);
         item = yaml_next(&reader->tree, item)) {
        if (mesh_count != reader->scene->meshes.count) // the last one had separate stages
            stage_begin(stage, "reading the objects of", reader->report.source->file, list->child_count);
        mesh_count = reader->scene->meshes.count;
        stage_set(stage, done++);
        object_read(reader, item);
        places_record(&reader->places, reader->scene, item->offset);
    }
}
