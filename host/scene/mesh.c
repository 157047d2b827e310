#include "host/scene/mesh.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/scene/polygon.h"

#include <stdlib.h>
#include <string.h>

void mesh_free(Mesh *mesh)
{
    free(mesh->vertices);
    free(mesh->normals);
    free(mesh->uvs);
    free(mesh->triangles);
    free(mesh->materials);
    free(mesh->path);
    *mesh = (Mesh){0};
}

// Multiplies by 2^64 over the golden ratio (Knuth, The Art of Computer Programming 3, 6.4) and folds.
static uint64_t hash_mix(uint64_t hash, double number)
{
    double positive_zero = number + 0.0;
    uint64_t bits;
    memcpy(&bits, &positive_zero, sizeof bits);
    hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 29;
}

static uint64_t vector_hash(uint64_t hash, Vector3 v)
{
    return hash_mix(hash_mix(hash_mix(hash, v.x), v.y), v.z);
}

static uint64_t vertex_hash(const Mesh *mesh, size_t index)
{
    uint64_t hash = vector_hash(0, mesh->vertices[index]);
    if (mesh->normals) hash = vector_hash(hash, mesh->normals[index]);
    if (mesh->uvs) hash = hash_mix(hash_mix(hash, mesh->uvs[index][0]), mesh->uvs[index][1]);
    return hash * 0x9e3779b97f4a7c15u >> 32;
}

static bool vertices_equal(const Mesh *mesh, size_t a, size_t b)
{
    return vectors_equal(mesh->vertices[a], mesh->vertices[b]) &&
           (!mesh->normals || vectors_equal(mesh->normals[a], mesh->normals[b])) &&
           (!mesh->uvs || (mesh->uvs[a][0] == mesh->uvs[b][0] && mesh->uvs[a][1] == mesh->uvs[b][1]));
}

static void vertex_move(Mesh *mesh, size_t to, size_t from)
{
    mesh->vertices[to] = mesh->vertices[from];
    if (mesh->normals) mesh->normals[to] = mesh->normals[from];
    if (mesh->uvs) memcpy(mesh->uvs[to], mesh->uvs[from], sizeof *mesh->uvs);
}

static const uint32_t none = UINT32_MAX;

// Moves the vertices that stay forward in place. `joined[i]`, none where vertex i is not used, becomes the
// new index.
static size_t vertices_join(Mesh *mesh, uint32_t *joined)
{
    size_t slot_count = 16;
    while (slot_count < 2 * mesh->vertex_count)
        slot_count *= 2;
    OWNED uint32_t *slots = memory_allocate(slot_count, sizeof *slots);
    memset(slots, 0xff, slot_count * sizeof *slots);
    size_t kept = 0;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        if (joined[i] == none) continue;
        size_t slot = (size_t)vertex_hash(mesh, i) & (slot_count - 1);
        while (slots[slot] != none && !vertices_equal(mesh, slots[slot], i))
            slot = (slot + 1) & (slot_count - 1);
        if (slots[slot] == none) {
            vertex_move(mesh, kept, i);
            slots[slot] = (uint32_t)kept++;
        }
        joined[i] = slots[slot];
    }
    return kept;
}

void mesh_join_vertices(Mesh *mesh)
{
    if (mesh->vertex_count == 0) return;
    OWNED uint32_t *joined = memory_allocate(mesh->vertex_count, sizeof *joined);
    memset(joined, 0xff, mesh->vertex_count * sizeof *joined);
    for (size_t i = 0; i < mesh->triangle_count; i++)
        for (int corner = 0; corner < 3; corner++)
            joined[mesh->triangles[i][corner]] = 0;
    mesh->vertex_count = vertices_join(mesh, joined);
    for (size_t i = 0; i < mesh->triangle_count; i++)
        for (int corner = 0; corner < 3; corner++)
            mesh->triangles[i][corner] = joined[mesh->triangles[i][corner]];
    mesh->vertices = memory_resize(mesh->vertices, mesh->vertex_count, sizeof *mesh->vertices);
    if (mesh->normals)
        mesh->normals = memory_resize(mesh->normals, mesh->vertex_count, sizeof *mesh->normals);
    if (mesh->uvs) mesh->uvs = memory_resize(mesh->uvs, mesh->vertex_count, sizeof *mesh->uvs);
}

static void corners_of(const Mesh *mesh, size_t triangle, Vector3 corners[3])
{
    for (int i = 0; i < 3; i++)
        corners[i] = mesh->vertices[mesh->triangles[triangle][i]];
}

// Returns the angle between two vectors, 0 where one is zero. Uses arithmetic alone, since atan2 differs in
// the last bit between processors. An angle of at most a quarter turn is halved three times, by
//     tan(x / 2) = opposite / (adjacent + hypotenuse),
// which leaves a tangent of at most 0.2, whose series ends soon.
static double angle_between(Vector3 a, Vector3 b)
{
    const double opposite = vector_length(vector_cross(a, b)), along = vector_dot(a, b);
    if (opposite == 0) return along < 0 ? M_PI : 0;
    double adjacent = fabs(along);
    for (int halving = 0; halving < 3; halving++)
        adjacent += hypotenuse(opposite, adjacent);
    const double tangent = opposite / adjacent, square = tangent * tangent;
    double series = 0;
    for (int odd = 23; odd > 0; odd -= 2)
        series = 1.0 / odd - square * series;
    const double angle = 8 * tangent * series;
    return along < 0 ? M_PI - angle : angle;
}

// The contribution of a triangle to the normals of its vertices.
typedef struct {
    Vector3 unit;
    double angles[3];
} NormalPart;

typedef struct {
    const Mesh *mesh;
    size_t first; // triangle
    NormalPart *parts;
} NormalParts;

static void parts_make(void *context, size_t begin, size_t end)
{
    const NormalParts *parts = context;
    for (size_t i = begin; i < end; i++) {
        Vector3 corners[3];
        corners_of(parts->mesh, parts->first + i, corners);
        NormalPart *part = &parts->parts[i];
        part->unit = vector_normalize(triangle_normal(corners[0], corners[1], corners[2]));
        for (int corner = 0; corner < 3; corner++)
            part->angles[corner] = angle_between(vector_subtract(corners[(corner + 1) % 3], corners[corner]),
                                                 vector_subtract(corners[(corner + 2) % 3], corners[corner]));
    }
}

// Weights by the angle at the vertex, which makes the normal independent of how a polygon was cut into
// triangles (Thuermer, Wuethrich, Computing vertex normals from polygonal facets, Journal of Graphics Tools
// 3(1), 1998). Threads make the triangles' parts, some at a time, which are added in order, so the sums are
// the same on any machine.
void mesh_make_normals(Mesh *mesh)
{
    enum { PARTS_MAX = 1 << 16, PARTS_OF_THREAD_MIN = 1 << 10 };
    free(mesh->normals);
    mesh->normals = memory_allocate_zeroed(mesh->vertex_count, sizeof *mesh->normals);
    NormalParts parts = {.mesh = mesh, .parts = memory_allocate(PARTS_MAX, sizeof *parts.parts)};
    for (; parts.first < mesh->triangle_count; parts.first += PARTS_MAX) {
        const size_t left = mesh->triangle_count - parts.first, count = left < PARTS_MAX ? left : PARTS_MAX;
        parallel_run(count, PARTS_OF_THREAD_MIN, parts_make, &parts);
        for (size_t i = 0; i < 3 * count; i++) {
            const NormalPart *part = &parts.parts[i / 3];
            Vector3 *normal = &mesh->normals[mesh->triangles[parts.first + i / 3][i % 3]];
            *normal = vector_add(*normal, vector_scale(part->unit, part->angles[i % 3]));
        }
    }
    free(parts.parts);
    for (size_t i = 0; i < mesh->vertex_count; i++)
        mesh->normals[i] = vector_normalize(mesh->normals[i]);
}

MeshTriangle mesh_triangle_at(const Mesh *mesh, const Object *object, size_t part)
{
    MeshTriangle triangle = {.normals = {{0}}};
    const uint32_t *corners = mesh->triangles[part];
    for (int i = 0; i < 3; i++) {
        triangle.vertices[i] = mesh->vertices[corners[i]];
        if (mesh->normals) triangle.normals[i] = mesh->normals[corners[i]];
    }
    if (object->as.mesh.is_instance)
        affine_triangle(&object->as.mesh.transform, triangle.vertices, triangle.normals);
    return triangle;
}

const uint32_t *mesh_materials(const Mesh *mesh, const Object *object)
{
    return object->as.mesh.has_own_material ? NULL : mesh->materials;
}

Bounds mesh_vertex_bounds(const Mesh *mesh)
{
    Bounds bounds = bounds_empty();
    for (size_t i = 0; i < mesh->vertex_count; i++)
        bounds = bounds_join(bounds, (Bounds){mesh->vertices[i], mesh->vertices[i]});
    return bounds;
}

Bounds mesh_object_bounds(const Mesh *mesh, const Object *object)
{
    if (!object->as.mesh.is_instance) return mesh_vertex_bounds(mesh);
    Bounds all = bounds_empty();
    for (unsigned i = 0; i < 8 && mesh->vertex_count > 0; i++) {
        const Vector3 corner = affine_point(&object->as.mesh.transform, bounds_corner(mesh->bounds, i));
        all = bounds_join(all, (Bounds){corner, corner});
    }
    return all;
}

size_t mesh_degenerate_count(const Mesh *mesh)
{
    size_t count = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        Vector3 corners[3];
        corners_of(mesh, i, corners);
        count += !triangle_has_area(corners[0], corners[1], corners[2]);
    }
    return count;
}
