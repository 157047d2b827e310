// Reads the document of a YAML scene and its camera (docs/scene-format.md).
#include "host/import/yaml/yaml.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/load.h"
#include "host/scene/portable.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    Camera camera;
    double fov_degrees, focal_length, frame[2], height, aperture, turn;
} CameraFields;

static bool read_projection(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    *(Projection *)target = PROJECTION_EQUIRECTANGULAR;
    return yaml_is(&reader->tree, node, "equirectangular") ||
           expected_report(reader, field->name, "equirectangular", node);
}

// Reads a distance or a point.
static bool read_focus(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    CameraFields *read = target;
    read->camera.lens.focus = node->type == YAML_SCALAR ? FOCUS_DISTANCE : FOCUS_POINT;
    if (node->type != YAML_SCALAR) return read_vector(reader, field, node, &read->camera.lens.point);
    Field distance = *field;
    distance.range = &range_positive;
    return read_number(reader, &distance, node, &read->camera.lens.distance);
}

// The forms of a camera, by the key that sets its frame.
enum {
    FORM_FOV = FORM_FIRST,
    FORM_FOCAL_LENGTH = FORM_SECOND,
    FORM_HEIGHT = FORM_THIRD,
    FORM_PROJECTION = FORM_FOURTH
};

static void frame_set(CameraFields *read, Form form)
{
    Camera *camera = &read->camera;
    if (form == FORM_HEIGHT) {
        camera->projection = PROJECTION_ORTHOGRAPHIC;
        camera->half_tangent = read->height / 2;
    } else if (form == FORM_PROJECTION) {
        camera->field_axis = FIELD_HORIZONTAL;
        camera->half_tangent = M_PI;
        camera->frame_aspect = 2;
    } else if (form == FORM_FOV) {
        camera->field_axis = FIELD_VERTICAL;
        camera->half_tangent = portable_tangent(read->fov_degrees * (M_PI / 360));
    } else {
        camera->field_axis = FIELD_HORIZONTAL;
        camera->half_tangent = read->frame[0] / 2 / read->focal_length;
        camera->frame_aspect = read->frame[0] / read->frame[1];
    }
}

bool yaml_read_camera(YamlReader *reader, const YamlNode *node)
{
    enum { FORM_FLAT = FORM_FOV | FORM_FOCAL_LENGTH | FORM_HEIGHT }; // the image is part of a plane
    static const Field fields[] = {
        {"position", read_vector, offsetof(CameraFields, camera.position), REQUIRED},
        {"look_at", read_vector, offsetof(CameraFields, camera.look_at), REQUIRED},
        {"up", read_direction, offsetof(CameraFields, camera.up)},
        {"fov", read_number, offsetof(CameraFields, fov_degrees), FORM_FOV, &range_half_turn},
        {"focal_length", read_number, offsetof(CameraFields, focal_length), REQUIRED | FORM_FOCAL_LENGTH,
         &range_positive},
        {"frame", read_items, offsetof(CameraFields, frame), REQUIRED | FORM_FOCAL_LENGTH, &range_positive,
         .items = &two_numbers},
        {"height", read_number, offsetof(CameraFields, height), REQUIRED | FORM_HEIGHT, &range_positive},
        {"projection", read_projection, offsetof(CameraFields, camera.projection),
         REQUIRED | FORM_PROJECTION},
        {"shift", read_items, offsetof(CameraFields, camera.shift), FORM_FLAT, .items = &two_numbers},
        {"turn", read_number, offsetof(CameraFields, turn)},
        {"aperture", read_number, offsetof(CameraFields, aperture), FORM_FLAT, &range_not_negative},
        {"focus", read_focus, 0, FORM_FLAT},
    };
    CameraFields read = {.camera = {.up = {0, 1, 0}}, .fov_degrees = 50};
    const Form form = fields_read(reader, node, "camera", fields, COUNT_OF(fields), &read);
    if (!form) return false;
    frame_set(&read, form);
    Camera *camera = &reader->scene->camera;
    *camera = read.camera;
    if (vectors_equal(camera->look_at, camera->position))
        return field_fails(reader, node, "look_at", "'look_at' must differ from 'position'");
    if (read.turn != 0) {
        const Vector3 from = vector_subtract(camera->position, camera->look_at);
        camera->position =
            vector_add(camera->look_at, vector_turned(from, vector_normalize(camera->up), read.turn));
    }
    camera->lens.radius = read.aperture / 2;
    const YamlNode *focus = field_node(reader, node, "focus");
    if (camera->lens.radius == 0 && focus != node)
        report_warning(&reader->report, focus->offset, "'focus' has no effect without an 'aperture'");
    return camera->lens.radius == 0 || camera_focal_distance(camera) > 0 ||
           report_error(&reader->report, focus->offset, "'focus' must lie in front of the camera");
}

// Rejects an `include` that --set adds, because files are included before values are set.
static bool read_include(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    (void)target;
    return report_error(&reader->report, node->offset,
                        "'%s' cannot be set, because files are included before values are set", field->name);
}

static bool read_frames(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    double count;
    if (!read_number(reader, field, node, &count)) return false;
    if (count != floor(count)) return expected_report(reader, field->name, "a whole number", node);
    *(uint32_t *)target = (uint32_t)count;
    return true;
}

typedef struct {
    Background background;
    Color ambient;
    SceneAnimation animation;
    const YamlNode *camera, *lights, *materials, *definitions, *objects;
} Document;

static void document_read(YamlReader *reader)
{
    static const Range range_frames = {1, FRAMES_MAX, false, "from 1 to 1000000"};
    static const Range range_frame_rate = {NUMBER_MIN, 1000, false, "greater than 0 and at most 1000"};
    static const Field fields[] = {
        {"include", read_include, 0},
        {"camera", read_node, offsetof(Document, camera)},
        {"frames", read_frames, offsetof(Document, animation.frame_count), OPTIONAL, &range_frames},
        {"fps", read_number, offsetof(Document, animation.frame_rate), OPTIONAL, &range_frame_rate},
        {"shutter", read_number, offsetof(Document, animation.shutter), OPTIONAL, &range_unit},
        {"background", read_background, offsetof(Document, background)},
        {"ambient", read_strength, offsetof(Document, ambient)},
        {"lights", read_node, offsetof(Document, lights)},
        {"materials", read_node, offsetof(Document, materials)},
        {"define", read_node, offsetof(Document, definitions)},
        {"objects", read_node, offsetof(Document, objects)},
    };
    Document document = {.ambient = vector_all(NAN), .animation = reader->scene->animation};
    const YamlNode *root = reader->tree.nodes.items;
    fields_read(reader, root, "scene", fields, COUNT_OF(fields), &document);
    document.animation.has_shutter = field_node(reader, root, "shutter") != root;
    reader->scene->animation = document.animation;
    yaml_set_background(reader, &document.background, document.ambient);
    if (document.camera)
        yaml_read_camera(reader, document.camera);
    else if (!reader->options->camera && root->type == YAML_MAPPING)
        report_error(&reader->report, root->offset, "the scene lacks 'camera'");
    if (document.lights) yaml_read_lights(reader, document.lights);
    if (document.materials) // before the objects that name them
        yaml_read_materials(reader, document.materials);
    reader->places = places_open(reader->report.source, reader->scene->overrides);
    if (document.definitions) yaml_read_definitions(reader, document.definitions);
    if (document.objects) yaml_read_object_list(reader, document.objects, true);
    scene_add_lamps(reader->scene);
    yaml_definitions_free(reader);
    places_close(&reader->places);
}

bool scene_read_yaml(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages)
{
    *scene = (Scene){.color_meaning = COLORS_LINEAR};
    for (size_t i = 0; i < options->override_count; i++)
        scene_add_override(scene, options->override_name, options->overrides[i]);
    Source whole = {source->file, source->bytes, source->length, scene->overrides};
    YamlReader reader = {.report = report_open(&whole, messages),
                         .scene = scene,
                         .options = options,
                         .default_material = UINT32_MAX};
    stage_begin(options->stage, "reading", source->file, source->length);
    if (yaml_tree_read(&reader.tree, &reader.report, 0, options->stage) && yaml_include(&reader, &whole) &&
        yaml_override(&reader) && yaml_animate(&reader))
        document_read(&reader);
    yaml_tree_free(&reader.tree);
    free(reader.names.items);
    const bool is_read = scene_finish(scene, &reader.report, options);
    yaml_included_free(&reader);
    return is_read;
}
