// Reads Tachyon's objects.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/dat.h"
#include "host/scene/mesh.h"
#include "host/scene/portable.h"

#include <stdlib.h>
#include <string.h>

// Reads a count of the items that follow.
static bool item_count_read(DatReader *reader, const char *name, unsigned *count)
{
    static const Range range_count = {0, INT32_MAX, false, "from 0 to 2147483647"};
    return line_whole_number(&reader->line, name, &range_count, count);
}

// Reads the texture and adds the object, unless it has a size that is not above 0, which Tachyon never hits.
static bool object_end(DatReader *reader, Object object, double size, size_t offset)
{
    if (!dat_texture(reader, &object.material)) return false;
    if (size > 0)
        array_push(reader->scene->objects, object);
    else
        dat_warn(reader, offset, "a %s without size or direction is not shown", shape_names[object.type]);
    return true;
}

bool dat_sphere(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.type = SHAPE_SPHERE};
    return dat_vector(reader, "center", &object.as.sphere.center) &&
           dat_number(reader, "rad", &object.as.sphere.radius) &&
           object_end(reader, object, object.as.sphere.radius, offset);
}

bool dat_plane(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.type = SHAPE_PLANE};
    return dat_vector(reader, "center", &object.as.plane.point) &&
           dat_vector(reader, "normal", &object.as.plane.normal) &&
           object_end(reader, object, !vector_is_zero(object.as.plane.normal), offset);
}

bool dat_cylinder(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.type = SHAPE_CYLINDER};
    return dat_vector(reader, "center", &object.as.cylinder.from) &&
           dat_vector(reader, "axis", &object.as.cylinder.axis) &&
           dat_number(reader, "rad", &object.as.cylinder.radius) &&
           object_end(reader, object, vector_is_zero(object.as.cylinder.axis) ? 0 : object.as.cylinder.radius,
                      offset);
}

bool dat_finite_cylinder(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.type = SHAPE_CYLINDER, .as.cylinder.finite = true};
    Vector3 apex;
    if (!dat_vector(reader, "base", &object.as.cylinder.from) || !dat_vector(reader, "apex", &apex) ||
        !dat_number(reader, "rad", &object.as.cylinder.radius))
        return false;
    object.as.cylinder.axis = vector_subtract(apex, object.as.cylinder.from);
    return object_end(reader, object, vector_is_zero(object.as.cylinder.axis) ? 0 : object.as.cylinder.radius,
                      offset);
}

// Adds cylinders between successive points, and a sphere at each point.
bool dat_polycylinder(DatReader *reader)
{
    const size_t offset = reader->line.start;
    unsigned count;
    double radius;
    OWNED ARRAY_OF(Vector3) points = {0};
    if (!dat_expect(reader, "points") || !item_count_read(reader, "points", &count)) return false;
    for (unsigned i = 0; i < count; i++) {
        Vector3 point;
        if (!dat_coordinates(reader, "points", &point)) return false;
        array_push(points, point);
    }
    uint32_t material;
    if (!dat_number(reader, "rad", &radius) || !dat_texture(reader, &material)) return false;
    if (!(radius > 0)) dat_warn(reader, offset, "a polycylinder without a radius is not shown");
    for (size_t i = 0; radius > 0 && i < points.count; i++) {
        const Vector3 point = points.items[i];
        const Vector3 axis = i > 0 ? vector_subtract(points.items[i - 1], point) : (Vector3){0, 0, 0};
        const Object sphere = {.type = SHAPE_SPHERE,
                               .material = material,
                               .as.sphere = {point, radius, false}},
                     cylinder = {
                         .type = SHAPE_CYLINDER,
                         .material = material,
                         .as.cylinder = {.from = point, .axis = axis, .radius = radius, .finite = true}};
        array_push(reader->scene->objects, sphere);
        if (!vector_is_zero(axis)) array_push(reader->scene->objects, cylinder);
    }
    return true;
}

static void mesh_object_add(DatReader *reader, Mesh *mesh, uint32_t material)
{
    const Object object = {
        .type = SHAPE_MESH, .material = material, .as.mesh.index = (uint32_t)reader->scene->meshes.count};
    array_push(reader->scene->meshes, *mesh);
    array_push(reader->scene->objects, object);
}

// Returns a triangle mesh of a ring with a hole. Its circles deviate by less than a ten-thousandth of their
// radius.
static Mesh ring_mesh(Vector3 center, Vector3 normal, double inner, double outer)
{
    enum { SEGMENTS = 256 };
    Mesh mesh = {.vertices = memory_allocate(2 * SEGMENTS, sizeof *mesh.vertices),
                 .vertex_count = 2 * SEGMENTS,
                 .triangles = memory_allocate(2 * SEGMENTS, sizeof *mesh.triangles),
                 .triangle_count = 2 * SEGMENTS};
    const Vector3 n = vector_normalize(normal);
    const Vector3 other = fabs(n.x) < 0.5 ? (Vector3){1, 0, 0} : (Vector3){0, 1, 0};
    const Vector3 u = vector_normalize(vector_cross(n, other)), v = vector_cross(n, u);
    for (uint32_t i = 0; i < SEGMENTS; i++) {
        const double angle = i * (2 * M_PI / SEGMENTS);
        const Vector3 toward =
            vector_add(vector_scale(u, portable_cosine(angle)), vector_scale(v, portable_sine(angle)));
        const uint32_t at = 2 * i, next = 2 * ((i + 1) % SEGMENTS);
        mesh.vertices[at] = vector_add(center, vector_scale(toward, inner));
        mesh.vertices[at + 1] = vector_add(center, vector_scale(toward, outer));
        memcpy(mesh.triangles[at], (uint32_t[3]){at, at + 1, next + 1}, sizeof mesh.triangles[at]);
        memcpy(mesh.triangles[at + 1], (uint32_t[3]){at, next + 1, next}, sizeof mesh.triangles[at]);
    }
    return mesh;
}

bool dat_ring(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.type = SHAPE_DISC};
    Vector3 center, normal;
    double inner, outer;
    if (!dat_vector(reader, "center", &center) || !dat_vector(reader, "normal", &normal) ||
        !dat_number(reader, "inner", &inner) || !dat_number(reader, "outer", &outer))
        return false;
    object.as.disc.center = center;
    object.as.disc.normal = normal;
    object.as.disc.radius = outer;
    const double width = vector_is_zero(normal) ? 0 : outer - fmax(inner, 0);
    if (inner <= 0 || width <= 0) return object_end(reader, object, width, offset);
    if (!dat_texture(reader, &object.material)) return false;
    Mesh mesh = ring_mesh(center, normal, inner, outer);
    mesh_object_add(reader, &mesh, object.material);
    return true;
}

bool dat_box(DatReader *reader)
{
    const size_t offset = reader->line.start;
    Object object = {.type = SHAPE_BOX};
    Vector3 a, b;
    if (!dat_vector(reader, "min", &a) || !dat_vector(reader, "max", &b)) return false;
    object.as.box.min = vector_min(a, b);
    object.as.box.max = vector_max(a, b);
    return object_end(reader, object, 1, offset);
}

static bool triangle_vertices_read(DatReader *reader, Object *object)
{
    Vector3 *vertices = object->as.triangle.vertices;
    return dat_vector(reader, "v0", &vertices[0]) && dat_vector(reader, "v1", &vertices[1]) &&
           dat_vector(reader, "v2", &vertices[2]);
}

static bool triangle_normals_read(DatReader *reader, Object *object)
{
    Vector3 *normals = object->as.triangle.normals;
    if (!dat_vector(reader, "n0", &normals[0]) || !dat_vector(reader, "n1", &normals[1]) ||
        !dat_vector(reader, "n2", &normals[2]))
        return false;
    object->as.triangle.smooth =
        !vector_is_zero(normals[0]) && !vector_is_zero(normals[1]) && !vector_is_zero(normals[2]);
    return true;
}

bool dat_triangle(DatReader *reader)
{
    Object object = {.type = SHAPE_TRIANGLE};
    return triangle_vertices_read(reader, &object) && object_end(reader, object, 1, 0);
}

bool dat_smooth_triangle(DatReader *reader)
{
    Object object = {.type = SHAPE_TRIANGLE};
    return triangle_vertices_read(reader, &object) && triangle_normals_read(reader, &object) &&
           object_end(reader, object, 1, 0);
}

// Returns the mean of the colors of a triangle's vertices.
static Color mean_color(DatReader *reader, size_t offset, const Color *a, const Color *b, const Color *c)
{
    if (!vectors_equal(*a, *b) || !vectors_equal(*a, *c))
        dat_warn(reader, offset, "triangles have the mean of the colors of their vertices");
    const Color mean = vector_scale(vector_add(vector_add(*a, *b), *c), 1.0 / 3);
    return vector_max(vectors_equal(*a, *b) && vectors_equal(*a, *c) ? *a : mean, vector_all(0));
}

// Adds a texture's material with another color, unless the last such material is the same. Returns its index.
static uint32_t colored_material_add(DatReader *reader, Word texture, Material material, Color color)
{
    ColoredMaterial *last = &reader->last_colored;
    if (last->texture.text && words_equal(last->texture, texture) && vectors_equal(last->color, color))
        return last->index;
    material.color = color;
    *last = (ColoredMaterial){texture, color, scene_add_material(reader->scene, &material, "")};
    return last->index;
}

// Reads the definition of a texture and sets *text to it.
static bool texture_text_read(DatReader *reader, Word *text, Material *material)
{
    const size_t offset = value_peek(&reader->line).offset;
    if (!dat_texture_body(reader, material)) return false;
    *text = (Word){reader->line.text + offset, offset, line_offset(&reader->line) - offset};
    return true;
}

bool dat_colored_triangle(DatReader *reader)
{
    static const char *const names[] = {"c0", "c1", "c2"};
    const size_t offset = reader->line.start;
    Object object = {.type = SHAPE_TRIANGLE};
    Color colors[3];
    Material material;
    Word texture;
    if (!triangle_vertices_read(reader, &object) || !triangle_normals_read(reader, &object)) return false;
    for (int i = 0; i < 3; i++)
        if (!dat_expect(reader, names[i]) || !line_vector(&reader->line, names[i], NULL, &colors[i]))
            return false;
    if (!texture_text_read(reader, &texture, &material)) return false;
    const Color color = mean_color(reader, offset, &colors[0], &colors[1], &colors[2]);
    object.material = colored_material_add(reader, texture, material, color);
    array_push(reader->scene->objects, object);
    return true;
}

// Holds a vertex array while it is read.
typedef struct {
    Mesh mesh;
    Color *colors; // one for each vertex, or NULL
    Word texture;  // of the material
    Material material;
    uint32_t material_index;
    struct {
        uint32_t (*items)[3];
        size_t count, capacity;
    } triangles;
    ARRAY_OF(uint32_t) materials;
} VertexArray;

// Reads one vector per vertex. Reports an error and returns NULL on failure.
static Vector3 *array_vectors_read(DatReader *reader, const char *name, unsigned count, bool are_colors)
{
    ARRAY_OF(Vector3) vectors = {0};
    array_reserve(vectors, 1);
    for (unsigned i = 0; i < count; i++) {
        Vector3 vector = {0};
        if (!(are_colors ? line_vector(&reader->line, name, NULL, &vector)
                         : dat_coordinates(reader, name, &vector))) {
            free(vectors.items);
            return NULL;
        }
        array_push(vectors, vector);
    }
    return vectors.items;
}

static void array_triangle_add(DatReader *reader, VertexArray *array, const uint32_t corners[3],
                               size_t offset)
{
    uint32_t material = array->material_index;
    if (array->colors)
        material = colored_material_add(reader, array->texture, array->material,
                                        mean_color(reader, offset, &array->colors[corners[0]],
                                                   &array->colors[corners[1]], &array->colors[corners[2]]));
    array_reserve(array->triangles, 1);
    memcpy(array->triangles.items[array->triangles.count++], corners, sizeof *array->triangles.items);
    array_push(array->materials, material);
}

// Reads the vertices of a strip, where each vertex after the second ends a triangle, or of `count`
// triangles.
static bool faces_read(DatReader *reader, VertexArray *array, bool is_strip)
{
    const size_t offset = reader->line.start;
    const char *name = is_strip ? "tristrip" : "trimesh";
    unsigned count;
    if (!item_count_read(reader, name, &count)) return false;
    uint32_t corners[3] = {0};
    const size_t index_count = (is_strip ? 1 : 3) * (size_t)count;
    for (size_t i = 0; i < index_count; i++) {
        unsigned index;
        const size_t index_offset = value_peek(&reader->line).offset;
        if (!item_count_read(reader, name, &index)) return false;
        if (index >= array->mesh.vertex_count)
            return report_error(&reader->report, index_offset,
                                "a triangle names vertex %u (counted from 0), but the array has only %zu",
                                index, array->mesh.vertex_count);
        if (is_strip) {
            corners[0] = corners[1];
            corners[1] = corners[2];
            corners[2] = index;
        } else {
            corners[i % 3] = index;
        }
        const bool is_odd = is_strip && i % 2 == 1;
        const uint32_t turned[3] = {corners[is_odd], corners[!is_odd], corners[2]};
        if (is_strip ? i >= 2 : i % 3 == 2) array_triangle_add(reader, array, turned, offset);
    }
    return true;
}

static bool array_parts_read(DatReader *reader, VertexArray *array)
{
    unsigned count;
    if (!dat_expect(reader, "numverts") || !item_count_read(reader, "numverts", &count) ||
        !dat_expect(reader, "coords"))
        return false;
    array->mesh.vertex_count = count;
    array->mesh.vertices = array_vectors_read(reader, "coords", count, false);
    if (!array->mesh.vertices || !dat_expect(reader, "normals")) return false;
    array->mesh.normals = array_vectors_read(reader, "normals", count, false);
    if (!array->mesh.normals) return false;
    for (unsigned i = 0; i < count; i++)
        array->mesh.normals[i] = vector_normalize(array->mesh.normals[i]);
    while (!dat_skip(reader, "end_vertexarray")) {
        if (dat_skip(reader, "colors")) {
            free(array->colors);
            array->colors = array_vectors_read(reader, "colors", count, true);
            if (!array->colors) return false;
        } else if (dat_skip(reader, "texture")) {
            if (!texture_text_read(reader, &array->texture, &array->material)) return false;
            array->material_index = scene_add_material(reader->scene, &array->material, "");
        } else if (dat_skip(reader, "tristrip")) {
            if (!faces_read(reader, array, true)) return false;
        } else if (dat_skip(reader, "trimesh")) {
            if (!faces_read(reader, array, false)) return false;
        } else {
            return dat_expect(reader, "end_vertexarray");
        }
    }
    return true;
}

bool dat_vertex_array(DatReader *reader)
{
    VertexArray array = {.texture.text = "", .material = dat_texture_default()};
    array.material_index = scene_add_material(reader->scene, &array.material, "");
    const bool read = array_parts_read(reader, &array);
    array.mesh.triangles = array.triangles.items;
    array.mesh.materials = array.materials.items;
    array.mesh.triangle_count = array.triangles.count;
    if (read && array.mesh.triangle_count > 0) {
        mesh_join_vertices(&array.mesh);
        mesh_object_add(reader, &array.mesh, array.material_index);
    } else {
        mesh_free(&array.mesh);
    }
    free(array.colors);
    return read;
}
