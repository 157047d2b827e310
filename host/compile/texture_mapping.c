#include "host/compile/textures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A picture on a plane stands upright on a wall; on a floor or a ceiling its top lies towards -z.
static Vector3 picture_up(Vector3 unit_normal)
{
    bool level = fabs(unit_normal.y) >= fmax(fabs(unit_normal.x), fabs(unit_normal.z));
    Vector3 axis = level ? (Vector3){0, 0, -1} : (Vector3){0, 1, 0};
    return vector_normalize(vector_subtract(axis, vector_scale(unit_normal, vector_dot(axis, unit_normal))));
}

// How many pictures per unit along a direction, and where the eye stands among them; whole ones are left out,
// which keeps the bits far from the origin.
static scalar4 picture_grid(Vector3 direction, double size, Vector3 eye)
{
    double phase = fmod(vector_dot(eye, direction) / size, 1);
    return (scalar4){direction.x / size, direction.y / size, direction.z / size, phase};
}

static void plane_lay(Vector3 normal, double width, TextureSize size, Vector3 eye, scalar4 *u, scalar4 *v)
{
    Vector3 unit = vector_normalize(normal), up = picture_up(unit);
    *u = picture_grid(vector_cross(up, unit), width, eye);
    *v = picture_grid(up, width * size.height / size.width, eye);
}

// Twice the area.
static double triangle_extent(const Vector3 *vertices, const uint32_t *corners)
{
    Vector3 a = vertices[corners[0]];
    return vector_length(
        vector_cross(vector_subtract(vertices[corners[1]], a), vector_subtract(vertices[corners[2]], a)));
}

static TriangleUvs triangle_lay(const Mesh *mesh, const uint32_t *corners, TextureSize size)
{
    const double *a = mesh->uvs[corners[0]], *b = mesh->uvs[corners[1]], *c = mesh->uvs[corners[2]];
    double texels =
        fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) * size.width * size.height;
    double extent = triangle_extent(mesh->vertices, corners);
    return (TriangleUvs){{a[0], a[1], b[0], b[1]}, {c[0], c[1], extent > 0 ? sqrt(texels / extent) : 0, 0}};
}

static uint32_t mesh_image(const Scene *scene, const Object *object, const Mesh *mesh, size_t triangle)
{
    return scene->materials.items[mesh->materials ? mesh->materials[triangle] : object->material].image;
}

// The primitives of an object, by the walk that flatten takes through the scene.
typedef struct {
    CompiledScene *flat;
    const Scene *scene;
    const TextureSize *sizes;
    Vector3 eye;
    size_t primitive_count, uvs_count; // so far
} Laying;

static void *primitive_at(const Laying *laying, size_t id)
{
    const ObjectEntry *entries = laying->flat->arrays[FLAT_OBJECTS].items;
    uint4 entry = entries[id].kind_index_material;
    return flat_array_at(&laying->flat->arrays[FLAT_FIRST_SHAPE + entry.x], entry.y);
}

static void mesh_lay(Laying *laying, const Object *object)
{
    const Mesh *mesh = &laying->scene->meshes.items[object->as.mesh.index];
    TriangleUvs *uvs = laying->flat->arrays[FLAT_TRIANGLE_UVS].items;
    for (size_t i = 0; mesh->uvs && i < mesh->triangle_count; i++) {
        uint32_t image = mesh_image(laying->scene, object, mesh, i);
        if (image == 0) continue;
        Triangle *triangle = primitive_at(laying, laying->primitive_count + i);
        uvs[laying->uvs_count++] = triangle_lay(mesh, mesh->triangles[i], laying->sizes[image - 1]);
        triangle->id.z = (uint32_t)laying->uvs_count;
    }
}

static void object_lay(Laying *laying, const Object *object)
{
    if (object->kind == SHAPE_MESH) {
        mesh_lay(laying, object);
        return;
    }
    const Material *material = &laying->scene->materials.items[object->material];
    if (material->image == 0) return;
    TextureSize size = laying->sizes[material->image - 1];
    void *primitive = primitive_at(laying, laying->primitive_count);
    if (object->kind == SHAPE_PLANE) {
        Plane *plane = primitive;
        plane_lay(object->as.plane.normal, material->image_size, size, laying->eye, &plane->grid_u,
                  &plane->grid_v);
    } else if (object->kind == SHAPE_DISC) {
        Disc *disc = primitive;
        plane_lay(object->as.disc.normal, material->image_size, size, laying->eye, &disc->grid_u,
                  &disc->grid_v);
    }
}

static size_t uvs_largest(const Scene *scene)
{
    size_t count = 0;
    for (size_t i = 0; i < scene->objects.count && scene->images.count > 0; i++) {
        const Object *object = &scene->objects.items[i];
        if (object->kind == SHAPE_MESH && scene->meshes.items[object->as.mesh.index].uvs)
            count += object_primitive_count(scene, object);
    }
    return count;
}

void texture_mapping_fill(CompiledScene *flat, const Scene *scene, const TextureSize *sizes,
                          const FlattenSettings *settings)
{
    Laying laying = {.flat = flat, .scene = scene, .sizes = sizes};
    if (settings->shift_to_eye) laying.eye = scene->camera.position;
    flat->arrays[FLAT_TRIANGLE_UVS] = flat_array_make(FLAT_TRIANGLE_UVS, uvs_largest(scene));
    for (size_t i = 0; i < scene->objects.count && scene->images.count > 0; i++) {
        object_lay(&laying, &scene->objects.items[i]);
        laying.primitive_count += object_primitive_count(scene, &scene->objects.items[i]);
    }
    flat->arrays[FLAT_TRIANGLE_UVS].count = laying.uvs_count;

    SceneHeader *header = flat->arrays[FLAT_HEADER].items;
    const scalar4 right = header->right; // half a pixel
    header->sample.x =
        2 * sqrt((right.x * right.x + right.y * right.y + right.z * right.z) / settings->sample_count);
}
