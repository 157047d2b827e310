#include "host/scene/scene.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/scene/mesh.h"
#include "host/scene/portable.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SHAPE_NAME(NAME, name, ...) name,
const char *const shape_names[SHAPE_COUNT] = {SCENE_SHAPE_LIST(SHAPE_NAME) "oval", "mesh"};
#undef SHAPE_NAME

Material material_default(void)
{
    return (Material){.color = {1, 1, 1},
                      .ambient = 1,
                      .diffuse = {1, 1, 1},
                      .shininess = 32,
                      .ior = 1.5,
                      .checker.size = 1,
                      .texture_size = 1,
                      .normal_map.rows = {{1, 0, 0}, {0, 1, 0}},
                      .normal_map.strength = 1};
}

void light_fold_fading(Light *light)
{
    if (light_fades(light) || light->fading[0] == 0) return;
    light->color = vector_scale(light->color, 1 / light->fading[0]);
    light->fading[0] = 0;
}

Color color_tint(Color color)
{
    if (color.x == color.y && color.y == color.z) return vector_all(0);
    const double largest = vector_largest(color);
    return (Color){color.x / largest, color.y / largest, color.z / largest};
}

static double channel_absorption(double left, double distance)
{
    return portable_log2(fmin(fmax(left, 1e-6), 1)) * -M_LN2 / distance;
}

Color color_absorption(Color left, double distance)
{
    return (Color){channel_absorption(left.x, distance), channel_absorption(left.y, distance),
                   channel_absorption(left.z, distance)};
}

Color tint_factors(Color tint)
{
    return vector_is_zero(tint) ? vector_all(1) : tint;
}

Color factor_color(TintedFactor factor)
{
    return vector_scale(tint_factors(factor.tint), factor.largest);
}

void material_set_opacity(Material *material, double opacity)
{
    material->ambient *= opacity;
    material->diffuse = vector_scale(material->diffuse, opacity);
    material->specular.largest *= opacity;
    material->reflection.largest *= opacity;
    material->emission = vector_scale(material->emission, opacity);
    material->transmission.largest = 1 - opacity;
    material->ior = 1;
}

uint32_t scene_add_material(Scene *scene, const Material *material, const char *name)
{
    array_push(scene->materials, *material);
    array_push(scene->material_names, memory_copy_text(name));
    return (uint32_t)(scene->materials.count - 1);
}

static bool texture_is(const SceneTexture *texture, const char *path, const char *layer,
                       TextureContent content)
{
    return !texture->image.values && texture->content == content && strcmp(texture->path, path) == 0 &&
           !texture->layer == !layer && (!layer || strcmp(texture->layer, layer) == 0);
}

uint32_t scene_add_texture(Scene *scene, const char *path, const char *layer, TextureContent content,
                           size_t offset)
{
    size_t index = 0;
    while (index < scene->textures.count && !texture_is(&scene->textures.items[index], path, layer, content))
        index++;
    if (index == SCENE_TEXTURES_MAX) return 0;
    if (index == scene->textures.count)
        array_push(scene->textures, ((SceneTexture){.path = memory_copy_text(path),
                                                    .layer = layer ? memory_copy_text(layer) : NULL,
                                                    .content = content,
                                                    .offset = offset}));
    return (uint32_t)index + 1;
}

void scene_add_object(Scene *scene, Object object, const Material *material)
{
    object.material = scene_add_material(scene, material, "");
    array_push(scene->objects, object);
}

void camera_look_along(Camera *camera, Vector3 position, Vector3 direction)
{
    const double step = fmax(1, vector_length(position));
    camera->position = position;
    camera->look_at = vector_add(position, vector_scale(direction, step));
}

double camera_focal_distance(const Camera *camera)
{
    if (camera->lens.radius == 0) return 0;
    if (camera->lens.focus == FOCUS_DISTANCE) return camera->lens.distance;
    const Vector3 view = vector_subtract(camera->look_at, camera->position);
    const Vector3 in_focus = camera->lens.focus == FOCUS_POINT ? camera->lens.point : camera->look_at;
    return fmax(vector_dot(vector_subtract(in_focus, camera->position), vector_normalize(view)), 0);
}

Color material_passing(const Material *material)
{
    if (material->shadow == SHADOW_OF_TRANSMISSION) return factor_color(material->transmission);
    return vector_all(material->shadow == SHADOW_NONE ? 1 : 0);
}

static Object triangle_of(uint32_t material, Vector3 a, Vector3 b, Vector3 c)
{
    return (Object){.type = SHAPE_TRIANGLE, .material = material, .as.triangle.vertices = {a, b, c}};
}

static void lamp_add(Scene *scene, const Light *light, uint32_t material)
{
    const Vector3 center = light->position, u = light->area.across[0], v = light->area.across[1],
                  first = vector_subtract(center, vector_add(u, v)),
                  last = vector_add(center, vector_add(u, v));
    Object lamp = {.type = SHAPE_SPHERE, .material = material};
    if (light->area.type == AREA_SPHERE) {
        lamp.as.sphere.center = center;
        lamp.as.sphere.radius = light->area.radius;
    } else if (light->area.type == AREA_ELLIPSE) {
        lamp.type = SHAPE_DISC;
        lamp.as.disc.center = center;
        lamp.as.disc.normal = vector_cross(vector_normalize(u), vector_normalize(v));
        lamp.as.disc.radius = light->area.radius;
    } else if (light->area.type == AREA_TRIANGLE) {
        const Vector3 vertex = vector_subtract(center, vector_scale(vector_add(u, v), 0.25));
        lamp = triangle_of(material, vertex, vector_add(vertex, u), vector_add(vertex, v));
    } else {
        lamp = triangle_of(material, first, vector_subtract(center, vector_subtract(u, v)), last);
        array_push(scene->objects, lamp);
        lamp = triangle_of(material, first, vector_add(center, vector_subtract(u, v)), last);
    }
    array_push(scene->objects, lamp);
}

void scene_add_lamps(Scene *scene)
{
    for (size_t i = 0; i < scene->lights.count; i++) {
        const Light *light = &scene->lights.items[i];
        if (!light->area.is_visible || light->area.type == AREA_NONE) continue;
        Material material = material_default();
        material.color = vector_all(0);
        material.emission = light->color;
        material.shadow = SHADOW_NONE;
        lamp_add(scene, light, scene_add_material(scene, &material, ""));
    }
}

size_t object_primitive_count(const Scene *scene, const Object *object)
{
    return object->type == SHAPE_MESH ? scene->meshes.items[object->as.mesh.index].triangle_count : 1;
}

size_t scene_primitive_count(const Scene *scene)
{
    if (scene->meshes.count == 0) return scene->objects.count;
    size_t count = 0;
    for (size_t i = 0; i < scene->objects.count; i++)
        count += object_primitive_count(scene, &scene->objects.items[i]);
    return count;
}

ShapeType object_shape(const Object *object)
{
    return object->type == SHAPE_OVAL ? object->as.oval.unit : object->type;
}

bool object_is_smooth(const Scene *scene, const Object *object)
{
    if (object->type == SHAPE_MESH) return scene->meshes.items[object->as.mesh.index].normals != NULL;
    return object->type == SHAPE_TRIANGLE && object->as.triangle.smooth;
}

void scene_free(Scene *scene)
{
    for (size_t i = 0; i < scene->material_names.count; i++)
        free(scene->material_names.items[i]);
    free(scene->material_names.items);
    free(scene->lights.items);
    free(scene->sky.cells);
    free(scene->materials.items);
    free(scene->objects.items);
    for (size_t i = 0; i < scene->meshes.count; i++)
        mesh_free(&scene->meshes.items[i]);
    free(scene->meshes.items);
    for (size_t i = 0; i < scene->textures.count; i++) {
        free(scene->textures.items[i].path);
        free(scene->textures.items[i].layer);
        text_free(&scene->textures.items[i].bytes);
        image_free(&scene->textures.items[i].image);
    }
    free(scene->textures.items);
    for (size_t i = 0; i < scene->included.count; i++)
        free(scene->included.items[i].path);
    free(scene->included.items);
    while (scene->overrides) {
        Source *freed = scene->overrides;
        scene->overrides = freed->next;
        free((char *)freed->bytes);
        free(freed);
    }
    *scene = (Scene){0};
}

void scene_add_override(Scene *scene, const char *name, const char *text)
{
    Source **end = &scene->overrides;
    while (*end)
        end = &(*end)->next;
    *end = memory_allocate_zeroed(1, sizeof **end);
    **end = (Source){.file = name, .bytes = memory_copy_text(text), .length = strlen(text)};
}

bool scene_was_read_from(const Scene *scene, const char *scene_path, const char *path)
{
    const FileId file = file_id(path);
    bool is_read = file_is_same(file_id(scene_path), file);
    for (size_t i = 0; i < scene->included.count && !is_read; i++)
        is_read = file_is_same(file_id(scene->included.items[i].path), file);
    for (size_t i = 0; i < scene->textures.count && !is_read; i++)
        is_read = file_is_same(file_id(scene->textures.items[i].path), file);
    for (size_t i = 0; i < scene->meshes.count && !is_read; i++)
        is_read = file_is_same(file_id(scene->meshes.items[i].path), file);
    return is_read;
}

void scene_choose_image_size(const Scene *scene, uint32_t *width, uint32_t *height)
{
    if (*width > 0) return;
    *width = scene->width > 0 ? scene->width : 1280;
    double aspect = scene->camera.frame_aspect > 0 ? scene->camera.frame_aspect : 16.0 / 9;
    double fitting = fmax(1, fmin(round(*width / aspect), IMAGE_SIDE_MAX));
    *height = scene->height > 0 ? scene->height : (uint32_t)fitting;
}
