// Makes a scene of one mesh with the file's camera and lights, or a framing camera and two lights.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/mesh/mesh_import.h"
#include "host/import/number.h"
#include "host/scene/bounds.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double gray = 0.18; // of the background

static Bounds mesh_bounds(const Mesh *mesh)
{
    Bounds bounds = bounds_empty();
    for (size_t i = 0; i < mesh->vertex_count; i++)
        bounds = bounds_join(bounds, (Bounds){mesh->vertices[i], mesh->vertices[i]});
    return bounds;
}

static Vector3 mesh_center(const Mesh *mesh)
{
    return bounds_center(mesh_bounds(mesh));
}

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
           vector_is_within(light->color, NUMBER_MAX) &&
           vector_is_zero(vector_min(light->color, vector_all(0))) &&
           (light->type == LIGHT_POINT || !vector_is_zero(light->direction)) &&
           (light->type != LIGHT_SPOT || has_cone);
}

// Clears fading factors that are negative, out of range or all zero.
static void fading_check(Light *light)
{
    double sum = 0;
    bool is_sound = light->type != LIGHT_DIRECTIONAL;
    for (int i = 0; i < 3; i++) {
        sum += light->fading[i];
        is_sound = is_sound && light->fading[i] >= 0 && light->fading[i] <= NUMBER_MAX;
    }
    if (!is_sound || sum == 0) memset(light->fading, 0, sizeof light->fading);
    light_fold_fading(light);
}

// Returns the largest channel of the light that arrives at a point, whose distance counts as at least
// `least`.
static double light_arriving(const Light *light, Vector3 point, double least)
{
    const double d = fmax(vector_length(vector_subtract(light->position, point)), least);
    const double divisor = light->fading[0] + d * (light->fading[1] + d * light->fading[2]);
    return vector_largest(light->color) / (light_fades(light) ? fmax(divisor, 1 / NUMBER_MAX) : 1);
}

// Adds the lights and scales them if they would make the image white or black.
static void lights_add(Scene *scene, const MeshView *view, Report *report)
{
    const double brightest = 4, darkest = 0x1p-6;
    const Bounds bounds = mesh_bounds(&scene->meshes.items[0]);
    const Vector3 center = bounds_center(bounds);
    const double radius = vector_length(vector_subtract(bounds.max, bounds.min)) / 2;
    double sum = 0;
    for (size_t i = 0; i < view->lights.count; i++) {
        Light light = view->lights.items[i];
        fading_check(&light);
        if (!light_is_sound(&light)) continue;
        array_push(scene->lights, light);
        sum += light_arriving(&light, center, light.type == LIGHT_DIRECTIONAL ? 0 : radius);
    }
    if (sum == 0 || (sum >= darkest && sum <= brightest)) return;
    report_warning(
        report, MESSAGE_WHOLE_FILE,
        "lights of %.3g in total around the center, which would show little but white or black: scaled to 1",
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

static void scene_show(Scene *scene, const MeshView *view, const char *path, Report *report)
{
    const Mesh *mesh = &scene->meshes.items[0];
    const Vector3 center = mesh_center(mesh);
    const bool has_camera = view->has_camera && camera_is_sound(&view->camera);
    scene->camera = has_camera ? view->camera : camera_around(mesh, center, upward(path));
    scene->background = vector_all(gray);
    lights_add(scene, view, report);
    if (scene->lights.count == 0) lights_around(scene);
}

void scene_of_mesh(Scene *scene, Mesh *mesh)
{
    const Material material = material_default();
    *scene = (Scene){.background = vector_all(gray)};
    array_push(scene->meshes, *mesh);
    *mesh = (Mesh){0};
    scene_add_object(scene, (Object){.type = SHAPE_MESH}, &material);
    const Mesh *own = &scene->meshes.items[0];
    scene->camera = camera_around(own, mesh_center(own), (Vector3){0, 1, 0});
    lights_around(scene);
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
        scene_show(scene, &view, path, &report);
    }
    free(view.lights.items);
    return scene_finish(scene, &report, options);
}
