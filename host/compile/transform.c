#include "host/compile/transform.h"

#include "host/base/memory.h"
#include "host/scene/shape_members.h"
#include <stdlib.h>

// Changes every position and every other vector (axes, normals, directions) except those of meshes. Scaling
// a normal or a direction has no effect, because they need not be unit vectors.
static void scene_for_each_vector(Scene *scene, void (*change)(Vector3 *vector, double factor), double factor)
{
    change(&scene->camera.position, factor);
    change(&scene->camera.look_at, factor);
    change(&scene->camera.up, factor);
    change(&scene->camera.lens.point, factor);
    change(&scene->sky.up, factor);
    change(&scene->sky.forward, factor);
    for (size_t i = 0; i < scene->lights.count; i++) {
        change(&scene->lights.items[i].position, factor);
        change(&scene->lights.items[i].direction, factor);
        change(&scene->lights.items[i].area.across[0], factor);
        change(&scene->lights.items[i].area.across[1], factor);
    }
    for (size_t i = 0; i < scene->objects.count; i++) {
        const ShapeMembers members = shape_members(&scene->objects.items[i]);
        for (Vector3 *const *point = members.points; *point; point++)
            change(*point, factor);
        for (Vector3 *const *direction = members.directions; *direction; direction++)
            change(*direction, factor);
        box_order(&scene->objects.items[i]);
    }
}

static void vector_grow(Vector3 *vector, double factor)
{
    *vector = vector_scale(*vector, factor);
}

void scene_scale(Scene *scene, double factor)
{
    scene_for_each_vector(scene, vector_grow, factor);
    scene->camera.lens.radius *= factor;
    scene->camera.lens.distance *= factor;
    if (scene->camera.projection == PROJECTION_ORTHOGRAPHIC) scene->camera.half_tangent *= factor;
    for (size_t i = 0; i < scene->objects.count; i++) {
        Object *object = &scene->objects.items[i];
        const ShapeMembers members = shape_members(object);
        for (double *const *length = members.lengths; *length; length++)
            **length *= factor;
        for (int row = 0; row < 3 && object->type == SHAPE_MESH && object->as.mesh.is_instance; row++)
            object->as.mesh.transform.rows[row][3] *= factor;
    }
    for (size_t i = 0; i < scene->lights.count; i++) {
        scene->lights.items[i].area.radius *= factor;
        scene->lights.items[i].fading[1] /= factor;
        scene->lights.items[i].fading[2] /= factor * factor;
    }
    for (size_t i = 0; i < scene->meshes.count; i++) {
        Mesh *mesh = &scene->meshes.items[i];
        for (size_t k = 0; k < mesh->vertex_count; k++)
            vector_grow(&mesh->vertices[k], factor);
        vector_grow(&mesh->bounds.min, factor);
        vector_grow(&mesh->bounds.max, factor);
    }
    for (size_t i = 0; i < scene->materials.count; i++) {
        scene->materials.items[i].checker.size *= factor;
        scene->materials.items[i].texture_size *= factor;
        scene->materials.items[i].absorption = vector_scale(scene->materials.items[i].absorption, 1 / factor);
    }
}

Scene scene_scaled(const Scene *scene, double factor)
{
    Scene scaled = *scene;
    scaled.lights.items = memory_copy(scene->lights.items, scene->lights.count, sizeof *scene->lights.items);
    scaled.materials.items =
        memory_copy(scene->materials.items, scene->materials.count, sizeof *scene->materials.items);
    scaled.objects.items =
        memory_copy(scene->objects.items, scene->objects.count, sizeof *scene->objects.items);
    scaled.meshes.items = memory_copy(scene->meshes.items, scene->meshes.count, sizeof *scene->meshes.items);
    for (size_t i = 0; i < scene->meshes.count; i++) {
        const Mesh *mesh = &scene->meshes.items[i];
        scaled.meshes.items[i].vertices =
            memory_copy(mesh->vertices, mesh->vertex_count, sizeof *mesh->vertices);
    }
    scene_scale(&scaled, factor);
    return scaled;
}

void scene_scaled_free(Scene *scaled)
{
    for (size_t i = 0; i < scaled->meshes.count; i++)
        free(scaled->meshes.items[i].vertices);
    free(scaled->lights.items);
    free(scaled->materials.items);
    free(scaled->objects.items);
    free(scaled->meshes.items);
    *scaled = (Scene){0};
}

static void vector_mirror(Vector3 *vector, double factor)
{
    vector->x *= factor;
}

// A checker's squares lie at floor(x / size), so mirroring turns an even one into an odd one.
void scene_mirror(Scene *scene)
{
    scene_for_each_vector(scene, vector_mirror, -1);
    for (size_t i = 0; i < scene->materials.count; i++) {
        Color *colors = scene->materials.items[i].checker.colors, first = colors[0];
        colors[0] = colors[1];
        colors[1] = first;
    }
}

static void vector_turn(Vector3 *vector, double unused)
{
    (void)unused;
    *vector = (Vector3){vector->z, vector->x, vector->y};
}

void scene_turn_axes(Scene *scene)
{
    scene_for_each_vector(scene, vector_turn, 1);
}
