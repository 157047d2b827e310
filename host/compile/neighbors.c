// Triangles that share an edge, and how they lie to each other, by exact signs.
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include "host/scene/quad.h"
#include <stdlib.h>
#include <string.h>

#define NONE UINT32_MAX

// Equal points have one number.
typedef struct {
    Vector3 *points;
    uint32_t *slots; // a hash table of numbers; its size is a power of two
    size_t count, slot_count;
} PointSet;

typedef struct {
    PointSet set;
    uint32_t (*corners)[3]; // of each triangle, numbers of points
    uint32_t *ids;
    size_t count;
    uint32_t *across; // of each half-edge, 3 triangle + corner opposite: the other one of its edge, or NONE
    TriangleNeighbors *neighbors;
} Triangles;

static uint32_t point_number(PointSet *set, Vector3 point)
{
    point = vector_add(point, (Vector3){0, 0, 0}); // no negative zeros
    const size_t last = set->slot_count - 1;
    size_t slot = hash_bytes(HASH_START, &point, sizeof point) & last;
    while (set->slots[slot] != NONE && !vectors_equal(set->points[set->slots[slot]], point))
        slot = (slot + 1) & last;
    if (set->slots[slot] == NONE) {
        set->slots[slot] = (uint32_t)set->count;
        set->points[set->count++] = point;
    }
    return set->slots[slot];
}

static PointSet point_set_open(size_t capacity)
{
    PointSet set = {.slot_count = 2};
    while (set.slot_count < 2 * capacity)
        set.slot_count *= 2;
    set.points = memory_allocate(capacity, sizeof *set.points);
    set.slots = memory_allocate(set.slot_count, sizeof *set.slots);
    memset(set.slots, 0xff, set.slot_count * sizeof *set.slots);
    return set;
}

static void mesh_add(Triangles *triangles, const Mesh *mesh, uint32_t first_id)
{
    uint32_t *numbers = memory_allocate(mesh->vertex_count, sizeof *numbers);
    for (size_t i = 0; i < mesh->vertex_count; i++)
        numbers[i] = point_number(&triangles->set, mesh->vertices[i]);
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        triangles->ids[triangles->count] = first_id + (uint32_t)i;
        for (int k = 0; k < 3; k++)
            triangles->corners[triangles->count][k] = numbers[mesh->triangles[i][k]];
        triangles->count++;
    }
    free(numbers);
}

static Triangles triangles_open(const Scene *scene)
{
    size_t count = 0, points = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const bool is_mesh = object->kind == SHAPE_MESH;
        if (!is_mesh && object->kind != SHAPE_TRIANGLE) continue;
        count += object_primitive_count(scene, object);
        points += is_mesh ? scene->meshes.items[object->as.mesh.index].vertex_count : 3;
    }
    Triangles triangles = {.set = point_set_open(points)};
    triangles.corners = memory_allocate(count, sizeof *triangles.corners);
    triangles.ids = memory_allocate(count, sizeof *triangles.ids);
    uint32_t id = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (object->kind == SHAPE_MESH) {
            mesh_add(&triangles, &scene->meshes.items[object->as.mesh.index], id);
        } else if (object->kind == SHAPE_TRIANGLE) {
            for (int k = 0; k < 3; k++)
                triangles.corners[triangles.count][k] =
                    point_number(&triangles.set, object->as.triangle.vertices[k]);
            triangles.ids[triangles.count++] = id;
        }
        id += (uint32_t)object_primitive_count(scene, object);
    }
    return triangles;
}

static void triangles_close(Triangles *triangles)
{
    free(triangles->set.points);
    free(triangles->set.slots);
    free(triangles->corners);
    free(triangles->ids);
    free(triangles->across);
}

// The points of the edge opposite a corner, the lower number first.
typedef struct {
    uint32_t low, high, half_edge;
} Edge;

static Edge edge_of(const Triangles *triangles, uint32_t half_edge)
{
    const uint32_t *corners = triangles->corners[half_edge / 3], k = half_edge % 3;
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
    const size_t count = 3 * triangles->count;
    Edge *edges = memory_allocate(count, sizeof *edges);
    uint32_t *ends = memory_allocate_zeroed(triangles->set.count + 1, sizeof *ends); // by the lower point
    triangles->across = memory_allocate(count, sizeof *triangles->across);
    memset(triangles->across, 0xff, count * sizeof *triangles->across);
    for (uint32_t i = 0; i < count; i++)
        ends[edge_of(triangles, i).low + 1]++;
    for (size_t i = 0; i < triangles->set.count; i++)
        ends[i + 1] += ends[i];
    for (uint32_t i = 0; i < count; i++) {
        const Edge edge = edge_of(triangles, i);
        edges[ends[edge.low]++] = edge;
    }
    for (size_t begin = 0, point = 0; point < triangles->set.count; begin = ends[point++]) {
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
    free(edges);
    free(ends);
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

// The side of a triangle's plane that a point is on, exact or UNKNOWN. The bound of the determinant in double
// is that of Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates,
// Discrete & Computational Geometry 18, 1997, section 4.3, with room to spare.
static Side side_of(const Triangles *triangles, const uint32_t *corners, uint32_t point)
{
    const Vector3 *a = &triangles->set.points[corners[0]], *b = &triangles->set.points[corners[1]],
                  *c = &triangles->set.points[corners[2]], *p = &triangles->set.points[point];
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

static void sides_find(void *context, size_t begin, size_t end)
{
    const Triangles *triangles = context;
    for (size_t i = begin; i < end; i++) {
        uint32_t found[4] = {NO_NEIGHBOR, NO_NEIGHBOR, NO_NEIGHBOR, 0};
        for (uint32_t k = 0; k < 3; k++) {
            const uint32_t across = triangles->across[3 * i + k];
            if (across == NONE) continue;
            const uint32_t *own = triangles->corners[i], *others = triangles->corners[across / 3];
            const Side of_neighbor = side_of(triangles, own, others[across % 3]),
                       of_this = side_of(triangles, others, own[k]);
            uint32_t sides = 0;
            if (of_this == BEHIND) sides |= NEIGHBOR_HAS_THIS_BEHIND;
            if (of_neighbor == IN_FRONT) sides |= NEIGHBOR_IN_FRONT;
            if (of_neighbor == BEHIND) sides |= NEIGHBOR_BEHIND;
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
        settings->certifies && compiled->arrays[FLAT_FIRST_SHAPE + KIND_TRIANGLES].count > 0;
    flat_array_renew(compiled, FLAT_TRIANGLE_NEIGHBORS, is_wanted ? compiled->arrays[FLAT_OBJECTS].count : 0);
    if (!is_wanted) return;
    Triangles triangles = triangles_open(scene);
    edges_match(&triangles);
    triangles.neighbors = compiled->arrays[FLAT_TRIANGLE_NEIGHBORS].items;
    parallel_run(triangles.count, FLAT_RANGE_MIN, sides_find, &triangles);
    triangles_close(&triangles);
}
