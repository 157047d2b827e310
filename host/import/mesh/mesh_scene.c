// Makes a scene of one mesh with the file's camera and lights, or a framing camera and two lights.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/mesh/mesh_import.h"
#include "host/import/number.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double gray = 0.18; // of the background

// Returns the upward direction, which is z in STL by custom and y in other formats.
static Vector3 upward(const char *path)
{
    const char *ending = strrchr(path, '.');
    return ending && strcasecmp(ending, ".stl") == 0 ? (Vector3){0, 0, 1} : (Vector3){0, 1, 0};
}

// Returns a camera that looks from the front, the right and above. The mesh takes up to nine tenths of the
// image's height.
static Camera camera_around(const Mesh *mesh, Vector3 center, Vector3 up)
{
    const double half_tangent = 0.36397023426620234, filled = 0.9; // tan 20 degrees
    const Vector3 front = up.z > 0 ? (Vector3){0, -1, 0} : (Vector3){0, 0, 1}, side = vector_cross(up, front);
    const Vector3 toward =
        vector_normalize(vector_add(vector_add(vector_scale(front, 2), vector_scale(up, 0.8)), side));
    const Vector3 right = vector_normalize(vector_cross(up, toward)), above = vector_cross(toward, right);
    double distance = 0;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        const Vector3 from_center = vector_subtract(mesh->vertices[i], center);
        const double off_axis =
            fmax(fabs(vector_dot(from_center, right)), fabs(vector_dot(from_center, above)));
        distance = fmax(distance, vector_dot(from_center, toward) + off_axis / (filled * half_tangent));
    }
    if (distance == 0) distance = fmax(1, vector_length(center));
    return (Camera){.position = vector_add(center, vector_scale(toward, distance)),
                    .look_at = center,
                    .up = up,
                    .field_axis = FIELD_VERTICAL,
                    .half_tangent = half_tangent};
}

// Adds a light from above on the camera's left, and one a third as bright on its right.
static void lights_around(Scene *scene)
{
    const Camera *camera = &scene->camera;
    const Vector3 forward = vector_normalize(vector_subtract(camera->look_at, camera->position)),
                  right = vector_normalize(vector_cross(forward, camera->up)),
                  up = vector_cross(right, forward);
    const Vector3 key = vector_add(vector_add(forward, vector_scale(right, 0.6)), vector_scale(up, -0.8)),
                  fill = vector_add(vector_add(forward, vector_scale(right, -0.9)), vector_scale(up, -0.1));
    array_push(scene->lights,
               ((Light){.type = LIGHT_DIRECTIONAL, .color = {0.75, 0.75, 0.75}, .direction = key}));
    array_push(scene->lights,
               ((Light){.type = LIGHT_DIRECTIONAL, .color = {0.25, 0.25, 0.25}, .direction = fill}));
}

// Returns whether a light is usable, even if a hostile file controls the process that it comes from.
static bool light_is_sound(const Light *light)
{
    const bool has_cone = light->spot.half_angle > 0 && light->spot.half_angle < 180 &&
                          light->spot.penumbra >= 0 && light->spot.penumbra <= light->spot.half_angle;
    return light->type <= LIGHT_SPOT && light->area.type == AREA_NONE &&
           vector_is_within(light->position, NUMBER_MAX) && vector_is_within(light->direction, NUMBER_MAX) &&
           numbers_are_sound(light->color) &&
           (light->type == LIGHT_POINT || !vector_is_zero(light->direction)) &&
           (light->type != LIGHT_SPOT || has_cone);
}

// Clears fading factors that are invalid or of a directional light, and folds a constant divisor into the
// color. Returns false if those of a light that has a position are invalid.
static bool fading_check(Light *light)
{
    const bool is_sound = numbers_are_sound((Vector3){light->fading[0], light->fading[1], light->fading[2]});
    if (!is_sound || light->type == LIGHT_DIRECTIONAL) memset(light->fading, 0, sizeof light->fading);
    light_fold_fading(light);
    return is_sound || light->type == LIGHT_DIRECTIONAL;
}

// Returns the largest channel of the light that arrives at a point, whose distance counts as at least
// `least`.
static double light_arriving(const Light *light, Vector3 point, double least)
{
    const double d = fmax(vector_length(vector_subtract(light->position, point)), least);
    const double divisor = light->fading[0] + d * (light->fading[1] + d * light->fading[2]);
    return vector_largest(light->color) / (light_fades(light) ? fmax(divisor, 1 / NUMBER_MAX) : 1);
}

// Adds the lights of a mesh with the bounds, and scales them if they would make the image white or black.
static void lights_add(Scene *scene, const MeshView *view, Bounds bounds, Report *report)
{
    const double brightest = 4, darkest = 0x1p-6;
    const Vector3 center = bounds_center(bounds);
    const double radius = vector_length(vector_subtract(bounds.max, bounds.min)) / 2;
    double sum = 0;
    size_t unsound_count = 0, unsound_fading_count = 0;
    for (size_t i = 0; i < view->lights.count; i++) {
        Light light = view->lights.items[i];
        unsound_fading_count += !fading_check(&light);
        if (!light_is_sound(&light)) {
            unsound_count++;
            continue;
        }
        array_push(scene->lights, light);
        sum += light_arriving(&light, center, light.type == LIGHT_DIRECTIONAL ? 0 : radius);
    }
    if (unsound_fading_count > 0)
        report_warning(report, MESSAGE_WHOLE_FILE,
                       "%zu light%s a negative or excessive attenuation, which is ignored",
                       unsound_fading_count, unsound_fading_count == 1 ? " has" : "s have");
    if (unsound_count > 0)
        report_warning(report, MESSAGE_WHOLE_FILE,
                       "%zu light%s no direction or a value out of range and %s ignored", unsound_count,
                       unsound_count == 1 ? " has" : "s have", text_is_are(unsound_count));
    if (sum == 0 || (sum >= darkest && sum <= brightest)) return;
    report_warning(
        report, MESSAGE_WHOLE_FILE,
        "the lights' total around the center is %.3g, which would show little but white or black; they are "
        "scaled to 1",
        sum);
    for (size_t i = 0; i < scene->lights.count; i++)
        scene->lights.items[i].color = vector_scale(scene->lights.items[i].color, 1 / sum);
}

static bool camera_is_sound(const Camera *camera)
{
    return vector_is_within(camera->position, NUMBER_MAX) && vector_is_within(camera->look_at, NUMBER_MAX) &&
           vector_is_within(camera->up, NUMBER_MAX) && !vectors_equal(camera->position, camera->look_at) &&
           camera->field_axis <= FIELD_HORIZONTAL && camera->projection <= PROJECTION_EQUIRECTANGULAR &&
           camera->half_tangent > 0 && camera->half_tangent <= NUMBER_MAX && camera->frame_aspect >= 0 &&
           camera->frame_aspect <= NUMBER_MAX && camera->lens.radius == 0;
}

static void scene_show(Scene *scene, const MeshView *view, Vector3 up, Report *report)
{
    const Mesh *mesh = &scene->meshes.items[0];
    const Bounds bounds = mesh_vertex_bounds(mesh);
    const bool has_camera = view->has_camera && camera_is_sound(&view->camera);
    if (view->has_camera && !has_camera)
        report_warning(report, MESSAGE_WHOLE_FILE,
                       "the camera has no direction or a value out of range; "
                       "a camera that frames the mesh is used instead");
    scene->camera = has_camera ? view->camera : camera_around(mesh, bounds_center(bounds), up);
    scene->background = vector_all(gray);
    lights_add(scene, view, bounds, report);
    if (scene->lights.count == 0) lights_around(scene);
}

void scene_of_mesh(Scene *scene, Mesh *mesh)
{
    const Material material = material_default();
    *scene = (Scene){0};
    array_push(scene->meshes, *mesh);
    *mesh = (Mesh){0};
    scene_add_object(scene, (Object){.type = SHAPE_MESH}, &material);
    scene_show(scene, &(MeshView){0}, (Vector3){0, 1, 0}, NULL);
}

bool scene_read_mesh(Scene *scene, const char *path, const SceneOptions *options, MessageList *messages)
{
    const Source source = {.file = path, .bytes = ""};
    Report report = report_open(&source, messages);
    MeshView view = {0};
    const MeshImport import = {.path = path,
                               .transform = affine_identity,
                               .own_materials = true,
                               .view = &view,
                               .options = options,
                               .report = &report,
                               .offset = MESSAGE_WHOLE_FILE};
    Object object = {.type = SHAPE_MESH};
    *scene = (Scene){0};
    if (mesh_import(scene, &import, &object.as.mesh.index)) {
        const Material material = material_default();
        scene->meshes.items[0].path = memory_copy_text(path);
        scene_add_object(scene, object, &material);
        scene_show(scene, &view, upward(path), &report);
    }
    free(view.lights.items);
    return scene_finish(scene, &report, options);
}
