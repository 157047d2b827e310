// Finds triangles that share an edge, and the exact signs of their positions relative to each other.
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/stages.h"
#include "host/scene/mesh.h"
#include "host/scene/quad.h"
#include <stdlib.h>
#include <string.h>

#define NONE UINT32_MAX

typedef struct {
    const Scene *scene;
    bool has_normals; // of vertices
    Mesh all;         // triangles, with equal vertices joined
    uint32_t *ids;
    uint32_t *owners;    // of each triangle, the index of its object
    uint32_t *first_ids; // of each object
    uint32_t *across; // of each half-edge, 3 triangle + corner opposite: the other one of its edge, or NONE
    TriangleNeighbors *neighbors;
} Triangles;

static MeshTriangle object_triangle(const Scene *scene, const Object *object, size_t part)
{
    if (object->type == SHAPE_MESH)
        return mesh_triangle_at(&scene->meshes.items[object->as.mesh.index], object, part);
    MeshTriangle triangle;
    memcpy(triangle.vertices, object->as.triangle.vertices, sizeof triangle.vertices);
    for (int i = 0; i < 3; i++)
        triangle.normals[i] = vector_normalize(object->as.triangle.normals[i]);
    return triangle;
}

// Appends the triangles of an instance, or a triangle, whose ids follow each other.
static void separate_triangles_add(Triangles *triangles, const Object *object, uint32_t first_id)
{
    Mesh *all = &triangles->all;
    const size_t count = object_primitive_count(triangles->scene, object);
    for (size_t i = 0; i < count; i++, all->triangle_count++) {
        const MeshTriangle placed = object_triangle(triangles->scene, object, i);
        triangles->ids[all->triangle_count] = first_id + (uint32_t)i;
        for (int k = 0; k < 3; k++) {
            all->triangles[all->triangle_count][k] = (uint32_t)all->vertex_count;
            all->vertices[all->vertex_count++] = placed.vertices[k];
        }
    }
}

// Appends the vertices and triangles of a mesh that is not an instance.
static void mesh_triangles_add(Triangles *triangles, const Mesh *mesh, uint32_t first_id)
{
    Mesh *all = &triangles->all;
    memcpy(all->vertices + all->vertex_count, mesh->vertices, mesh->vertex_count * sizeof *mesh->vertices);
    for (size_t i = 0; i < mesh->triangle_count; i++, all->triangle_count++) {
        triangles->ids[all->triangle_count] = first_id + (uint32_t)i;
        for (int k = 0; k < 3; k++)
            all->triangles[all->triangle_count][k] = (uint32_t)all->vertex_count + mesh->triangles[i][k];
    }
    all->vertex_count += mesh->vertex_count;
}

static Triangles triangles_open(const Scene *scene)
{
    size_t count = 0, vertex_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const bool is_mesh = object->type == SHAPE_MESH;
        if (!is_mesh && object->type != SHAPE_TRIANGLE) continue;
        const size_t triangle_count = object_primitive_count(scene, object);
        const bool has_vertices = is_mesh && !object->as.mesh.is_instance;
        count += triangle_count;
        vertex_count +=
            has_vertices ? scene->meshes.items[object->as.mesh.index].vertex_count : 3 * triangle_count;
    }
    Triangles triangles = {.scene = scene,
                           .ids = memory_allocate(count, sizeof *triangles.ids),
                           .owners = memory_allocate(count, sizeof *triangles.owners),
                           .first_ids = memory_allocate(scene->objects.count, sizeof *triangles.first_ids)};
    triangles.all.vertices = memory_allocate(vertex_count, sizeof *triangles.all.vertices);
    triangles.all.triangles = memory_allocate(count, sizeof *triangles.all.triangles);
    uint32_t id = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const Mesh *mesh = object->type == SHAPE_MESH ? &scene->meshes.items[object->as.mesh.index] : NULL;
        const size_t first = triangles.all.triangle_count;
        triangles.first_ids[i] = id;
        if (mesh && !object->as.mesh.is_instance)
            mesh_triangles_add(&triangles, mesh, id);
        else if (mesh || object->type == SHAPE_TRIANGLE)
            separate_triangles_add(&triangles, object, id);
        for (size_t k = first; k < triangles.all.triangle_count; k++)
            triangles.owners[k] = (uint32_t)i;
        id += (uint32_t)object_primitive_count(scene, object);
    }
    mesh_join_vertices(&triangles.all);
    return triangles;
}

static void triangles_close(Triangles *triangles)
{
    mesh_free(&triangles->all);
    free(triangles->ids);
    free(triangles->owners);
    free(triangles->first_ids);
    free(triangles->across);
}

// The points of the edge opposite a corner, the lower number first.
typedef struct {
    uint32_t low, high, half_edge;
} Edge;

static Edge edge_of(const Triangles *triangles, uint32_t half_edge)
{
    const uint32_t *corners = triangles->all.triangles[half_edge / 3], k = half_edge % 3;
    const uint32_t one = corners[(k + 1) % 3], other = corners[(k + 2) % 3];
    return one < other ? (Edge){one, other, half_edge} : (Edge){other, one, half_edge};
}

static int compare_high(const void *one, const void *other)
{
    const Edge *a = one, *b = other;
    return (a->high > b->high) - (a->high < b->high);
}

// Sets `across` for the edges that exactly two triangles share.
static void edges_match(Triangles *triangles)
{
    const size_t count = 3 * triangles->all.triangle_count;
    OWNED Edge *edges = memory_allocate(count, sizeof *edges);
    OWNED uint32_t *ends =
        memory_allocate_zeroed(triangles->all.vertex_count + 1, sizeof *ends); // by the lower point
    triangles->across = memory_allocate(count, sizeof *triangles->across);
    memset(triangles->across, 0xff, count * sizeof *triangles->across);
    for (uint32_t i = 0; i < count; i++)
        ends[edge_of(triangles, i).low + 1]++;
    for (size_t i = 0; i < triangles->all.vertex_count; i++)
        ends[i + 1] += ends[i];
    for (uint32_t i = 0; i < count; i++) {
        const Edge edge = edge_of(triangles, i);
        edges[ends[edge.low]++] = edge;
    }
    for (size_t begin = 0, point = 0; point < triangles->all.vertex_count; begin = ends[point++]) {
        const size_t end = ends[point];
        qsort(edges + begin, end - begin, sizeof *edges, compare_high);
        for (size_t i = begin; i < end;) {
            size_t next = i + 1;
            while (next < end && edges[next].high == edges[i].high)
                next++;
            if (next - i == 2) {
                triangles->across[edges[i].half_edge] = edges[i + 1].half_edge;
                triangles->across[edges[i + 1].half_edge] = edges[i].half_edge;
            }
            i = next;
        }
    }
}

typedef enum { BEHIND = -1, WITHIN, IN_FRONT, UNKNOWN } Side;

static Side side_of_quad(const Vector3 *a, const Vector3 *b, const Vector3 *c, const Vector3 *point)
{
    const Quad3 ab = quad3_subtract(quad3(*b), quad3(*a)), ac = quad3_subtract(quad3(*c), quad3(*a)),
                ap = quad3_subtract(quad3(*point), quad3(*a));
    const Quad volume = quad3_dot(quad3_cross(ab, ac), ap);
    const Quad size = quad_absolute(ab.x) + quad_absolute(ab.y) + quad_absolute(ab.z),
               other = quad_absolute(ac.x) + quad_absolute(ac.y) + quad_absolute(ac.z),
               away = quad_absolute(ap.x) + quad_absolute(ap.y) + quad_absolute(ap.z);
    const Quad error = size * other * away * 0x1p-58; // enough where Quad has 64 bits
    return volume > error ? IN_FRONT : volume < -error ? BEHIND : UNKNOWN;
}

// Returns the side of a triangle's plane that a point is on, exact or UNKNOWN. The bound of the determinant
// in double is that of Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric
// predicates, Discrete & Computational Geometry 18, 1997, section 4.3, with some slack.
static Side side_of(const Triangles *triangles, const uint32_t *corners, uint32_t point)
{
    const Vector3 *a = &triangles->all.vertices[corners[0]], *b = &triangles->all.vertices[corners[1]],
                  *c = &triangles->all.vertices[corners[2]], *p = &triangles->all.vertices[point];
    const Vector3 ab = vector_subtract(*b, *a), ac = vector_subtract(*c, *a), ap = vector_subtract(*p, *a);
    const double x1 = ab.y * ac.z, x2 = ab.z * ac.y, y1 = ab.z * ac.x, y2 = ab.x * ac.z, z1 = ab.x * ac.y,
                 z2 = ab.y * ac.x;
    const double volume = (x1 - x2) * ap.x + (y1 - y2) * ap.y + (z1 - z2) * ap.z;
    const double size = (fabs(x1) + fabs(x2)) * fabs(ap.x) + (fabs(y1) + fabs(y2)) * fabs(ap.y) +
                        (fabs(z1) + fabs(z2)) * fabs(ap.z);
    if (!(size > 0x1p-900)) return UNKNOWN; // products may have vanished
    const double error = 0x1p-49 * size;
    if (volume > error) return IN_FRONT;
    if (volume < -error) return BEHIND;
    return side_of_quad(a, b, c, p);
}

static MeshTriangle triangle_at(const Triangles *triangles, size_t index)
{
    const uint32_t owner = triangles->owners[index];
    return object_triangle(triangles->scene, &triangles->scene->objects.items[owner],
                           triangles->ids[index] - triangles->first_ids[owner]);
}

// Returns whether triangle_lift (kernels/shapes/triangle_normals.h) moves points of the neighbor, seen from
// its front, away from the plane of this triangle on a side of it, 1 in front or -1 behind: whether the
// neighbor's normals, turned to its front, point there by more than roundings.
static bool lifts_away(const Triangles *triangles, size_t this, size_t neighbor, double side)
{
    const MeshTriangle plane = triangle_at(triangles, this), lifted = triangle_at(triangles, neighbor);
    const Vector3 normal = triangle_normal(plane.vertices[0], plane.vertices[1], plane.vertices[2]),
                  front = triangle_normal(lifted.vertices[0], lifted.vertices[1], lifted.vertices[2]);
    for (int i = 0; i < 3; i++) {
        const double facing = vector_dot(lifted.normals[i], front) > 0 ? side : -side;
        if (!(facing * vector_dot(lifted.normals[i], normal) > 1e-5)) return false;
    }
    return true;
}

static void sides_find(void *context, size_t begin, size_t end)
{
    const Triangles *triangles = context;
    for (size_t i = begin; i < end; i++) {
        uint32_t found[4] = {NO_NEIGHBOR, NO_NEIGHBOR, NO_NEIGHBOR, 0};
        for (uint32_t k = 0; k < 3; k++) {
            const uint32_t across = triangles->across[3 * i + k];
            if (across == NONE) continue;
            const uint32_t *corners = triangles->all.triangles[i],
                           *other_corners = triangles->all.triangles[across / 3];
            const Side of_neighbor = side_of(triangles, corners, other_corners[across % 3]),
                       of_this = side_of(triangles, other_corners, corners[k]);
            uint32_t sides = 0;
            if (of_this == BEHIND) sides |= NEIGHBOR_HAS_THIS_BEHIND;
            if (of_neighbor == IN_FRONT) sides |= NEIGHBOR_IN_FRONT;
            if (of_neighbor == BEHIND) sides |= NEIGHBOR_BEHIND;
            if (triangles->has_normals && (of_neighbor == IN_FRONT || of_neighbor == BEHIND) &&
                lifts_away(triangles, i, across / 3, of_neighbor))
                sides |= NEIGHBOR_LIFTS_AWAY;
            if (sides == 0) continue;
            found[k] = triangles->ids[across / 3];
            found[3] |= sides << (NEIGHBOR_SIDES_BITS * k);
        }
        triangles->neighbors[triangles->ids[i]].ids_sides = (uint4){found[0], found[1], found[2], found[3]};
    }
}

void neighbors_find(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings)
{
    const bool is_wanted =
        settings->certifies && compiled->arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES].count > 0;
    flat_array_renew(compiled, FLAT_TRIANGLE_NEIGHBORS, is_wanted ? compiled->arrays[FLAT_OBJECTS].count : 0);
    if (!is_wanted) return;
    Triangles triangles = triangles_open(scene);
    triangles.has_normals = compiled->arrays[FLAT_TRIANGLE_NORMALS].count > 0;
    edges_match(&triangles);
    triangles.neighbors = compiled->arrays[FLAT_TRIANGLE_NEIGHBORS].items;
    parallel_run(triangles.all.triangle_count, FLAT_RANGE_MIN, sides_find, &triangles);
    triangles_close(&triangles);
}
