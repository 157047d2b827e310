#include "host/scene/polygon.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include <float.h>
#include <stdlib.h>
#include <string.h>

// Multiplies the orientation's terms out, each product an exact pair, and adds them up without loss as an
// expansion whose last nonzero component has its sign (Shewchuk, Adaptive precision floating-point arithmetic
// and fast robust geometric predicates, Discrete & Computational Geometry 18, 1997, section 2.4).
static int orientation_exact(const double a[2], const double b[2], const double c[2])
{
    const double factors[6][2] = {{a[0], b[1]},  {-a[1], b[0]}, {b[0], c[1]},
                                  {-b[1], c[0]}, {c[0], a[1]},  {-c[1], a[0]}};
    double expansion[12] = {0};
    for (size_t i = 0; i < 6; i++) {
        double product = factors[i][0] * factors[i][1];
        double terms[2] = {fma(factors[i][0], factors[i][1], -product), product};
        for (size_t term = 0; term < 2; term++) {
            size_t length = 2 * i + term;
            double carried = terms[term];
            for (size_t k = 0; k < length; k++) {
                ExactSum added = two_sum(carried, expansion[k]);
                expansion[k] = added.error;
                carried = added.sum;
            }
            expansion[length] = carried;
        }
    }
    for (size_t k = 12; k-- > 0;) {
        if (expansion[k] != 0) return expansion[k] > 0 ? 1 : -1;
    }
    return 0;
}

int plane_orientation(const double a[2], const double b[2], const double c[2])
{
    double left = (a[0] - c[0]) * (b[1] - c[1]), right = (a[1] - c[1]) * (b[0] - c[0]);
    double area = left - right;
    // the bound on its error: Shewchuk 1997, section 4.3
    double bound = (3 + 8 * DBL_EPSILON) * (DBL_EPSILON / 2) * (fabs(left) + fabs(right));
    if (area > bound) return 1;
    if (area < -bound) return -1;
    return orientation_exact(a, b, c);
}

// Scales values by a power of two, which changes no sign, so that products of their products neither vanish
// nor overflow.
static void scale_to_middle(double values[3])
{
    int exponent;
    frexp(fmax(fabs(values[0]), fmax(fabs(values[1]), fabs(values[2]))), &exponent);
    for (int i = 0; i < 3; i++)
        values[i] = ldexp(values[i], 400 - exponent);
}

Vector3 triangle_normal_signs(Vector3 a, Vector3 b, Vector3 c)
{
    double axes[3][3] = {{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}}, signs[3];
    for (int axis = 0; axis < 3; axis++)
        scale_to_middle(axes[axis]);
    for (int axis = 0; axis < 3; axis++) {
        const double *u = axes[(axis + 1) % 3], *v = axes[(axis + 2) % 3];
        signs[axis] =
            plane_orientation((double[]){u[0], v[0]}, (double[]){u[1], v[1]}, (double[]){u[2], v[2]});
    }
    return (Vector3){signs[0], signs[1], signs[2]};
}

// The remaining polygon: a ring of corners, projected to a coordinate plane so that it turns left.
typedef struct {
    double (*points)[2];
    uint32_t *next, *previous;
    bool *is_ear;
    bool touching; // ears may have other corners on their edges
    uint32_t at;   // any corner of the ring
    size_t count;  // left in the ring
} Ring;

// Returns twice the area of the polygon's projection to each coordinate plane (Newell's method: Sutherland,
// Sproull and Schumacker, A characterization of ten hidden-surface algorithms, 1974), relative to the first
// corner.
static Vector3 polygon_normal(const Vector3 *corners, size_t count)
{
    Vector3 normal = {0, 0, 0};
    for (size_t i = 1; i + 1 < count; i++) {
        Vector3 a = vector_subtract(corners[i], corners[0]), b = vector_subtract(corners[i + 1], corners[0]);
        normal = vector_add(normal, vector_cross(a, b));
    }
    return normal;
}

// Drops the coordinate in which the normal is largest; swaps the others where the polygon would turn right.
static void project_to_plane(double (*points)[2], const Vector3 *corners, size_t count, Vector3 normal)
{
    double x = fabs(normal.x), y = fabs(normal.y), z = fabs(normal.z);
    for (size_t i = 0; i < count; i++) {
        const Vector3 *p = &corners[i];
        double u = p->x, v = p->y;
        bool swapped = normal.z < 0;
        if (x >= y && x >= z) {
            u = p->y;
            v = p->z;
            swapped = normal.x < 0;
        } else if (y >= z) {
            u = p->z;
            v = p->x;
            swapped = normal.y < 0;
        }
        points[i][0] = swapped ? v : u;
        points[i][1] = swapped ? u : v;
    }
}

static bool points_equal(const double a[2], const double b[2])
{
    return a[0] == b[0] && a[1] == b[1];
}

static int ring_turn(const Ring *ring, uint32_t corner)
{
    return plane_orientation(ring->points[ring->previous[corner]], ring->points[corner],
                             ring->points[ring->next[corner]]);
}

// Returns whether a point lies in a triangle that turns left, or on its edges where they count. The
// triangle's corners do not.
static bool triangle_holds(const double *a, const double *b, const double *c, const double *point,
                           bool edges_count)
{
    if (point[0] < fmin(a[0], fmin(b[0], c[0])) || point[0] > fmax(a[0], fmax(b[0], c[0])) ||
        point[1] < fmin(a[1], fmin(b[1], c[1])) || point[1] > fmax(a[1], fmax(b[1], c[1])))
        return false;
    if (points_equal(point, a) || points_equal(point, b) || points_equal(point, c)) return false;
    int lowest = edges_count ? 0 : 1;
    return plane_orientation(a, b, point) >= lowest && plane_orientation(b, c, point) >= lowest &&
           plane_orientation(c, a, point) >= lowest;
}

// Returns whether the corner can be cut off: it turns left, and nothing of the polygon lies in its triangle.
static bool corner_is_ear(const Ring *ring, uint32_t corner)
{
    if (ring_turn(ring, corner) <= 0) return false;
    uint32_t before = ring->previous[corner], after = ring->next[corner];
    for (uint32_t other = ring->next[after]; other != before; other = ring->next[other]) {
        if (triangle_holds(ring->points[before], ring->points[corner], ring->points[after],
                           ring->points[other], !ring->touching))
            return false;
    }
    return true;
}

// Returns whether the corner coincides with a neighbor, or the edge runs back on itself there.
static bool corner_is_spike(const Ring *ring, uint32_t corner)
{
    const double *before = ring->points[ring->previous[corner]], *after = ring->points[ring->next[corner]];
    const double *point = ring->points[corner];
    if (points_equal(point, before) || points_equal(point, after)) return true;
    if (ring_turn(ring, corner) != 0) return false;
    size_t axis = point[0] != before[0] ? 0 : 1;
    return (before[axis] < point[axis]) == (after[axis] < point[axis]);
}

static void ring_classify(Ring *ring)
{
    uint32_t corner = ring->at;
    do {
        ring->is_ear[corner] = corner_is_ear(ring, corner);
        corner = ring->next[corner];
    } while (corner != ring->at);
}

static void ring_unlink(Ring *ring, uint32_t corner)
{
    ring->next[ring->previous[corner]] = ring->next[corner];
    ring->previous[ring->next[corner]] = ring->previous[corner];
    ring->at = ring->next[corner];
    ring->count--;
}

// Removes a corner. Only its neighbors can become ears by that, or cease to be (Eberly, Triangulation by ear
// clipping, 2002).
static void ring_remove(Ring *ring, uint32_t corner)
{
    uint32_t before = ring->previous[corner], after = ring->next[corner];
    ring_unlink(ring, corner);
    ring->is_ear[before] = corner_is_ear(ring, before);
    ring->is_ear[after] = corner_is_ear(ring, after);
}

static void ring_clip(Ring *ring, uint32_t corner, PolygonTriangles *triangles)
{
    array_reserve(*triangles, 1);
    uint32_t *triangle = triangles->items[triangles->count++];
    triangle[0] = ring->previous[corner];
    triangle[1] = corner;
    triangle[2] = ring->next[corner];
    ring_remove(ring, corner);
}

// Finds the first ear from `at` on. Returns false if there is none.
static bool ring_find_ear(const Ring *ring, uint32_t *ear)
{
    *ear = ring->at;
    for (size_t i = 0; i < ring->count; i++, *ear = ring->next[*ear]) {
        if (ring->is_ear[*ear]) return true;
    }
    return false;
}

static bool ring_find_spike(const Ring *ring, uint32_t *spike)
{
    *spike = ring->at;
    for (size_t i = 0; i < ring->count; i++, *spike = ring->next[*spike]) {
        if (corner_is_spike(ring, *spike)) return true;
    }
    return false;
}

// Goes round until no corner is a spike, because removing one may leave another before it.
static void ring_remove_spikes(Ring *ring)
{
    uint32_t corner = ring->at;
    for (size_t unseen = ring->count; unseen > 0 && ring->count > 3; unseen--) {
        bool is_spike = corner_is_spike(ring, corner);
        uint32_t next = is_spike ? ring->previous[corner] : ring->next[corner];
        if (is_spike) {
            ring_unlink(ring, corner);
            unseen += 2;
        }
        corner = next;
    }
}

static Ring ring_open(const Vector3 *corners, size_t count, Vector3 normal)
{
    Ring ring = {
        .points = memory_allocate(count, sizeof *ring.points),
        .next = memory_allocate(count, sizeof *ring.next),
        .previous = memory_allocate(count, sizeof *ring.previous),
        .is_ear = memory_allocate(count, sizeof *ring.is_ear),
        .count = count,
    };
    project_to_plane(ring.points, corners, count, normal);
    for (size_t i = 0; i < count; i++) {
        ring.next[i] = (uint32_t)((i + 1) % count);
        ring.previous[i] = (uint32_t)((i + count - 1) % count);
    }
    return ring;
}

static void ring_close(Ring *ring)
{
    free(ring->points);
    free(ring->next);
    free(ring->previous);
    free(ring->is_ear);
}

// Cuts off ears one by one: every simple polygon has two (Meisters, Polygons have ears, American Mathematical
// Monthly 82, 1975), and two without another corner on their edges.
static PolygonStatus ring_cut(Ring *ring, PolygonTriangles *triangles)
{
    PolygonStatus status = POLYGON_CUT;
    ring_remove_spikes(ring);
    ring_classify(ring);
    while (ring->count > 3) {
        uint32_t corner;
        if (ring_find_ear(ring, &corner)) {
            ring_clip(ring, corner, triangles);
        } else if (!ring->touching) {
            ring->touching = true;
            ring_classify(ring);
        } else if (ring_find_spike(ring, &corner)) {
            ring_remove(ring, corner);
        } else {
            status = POLYGON_CROSSED;
            ring_clip(ring, corner, triangles);
        }
    }
    int turn = ring_turn(ring, ring->at);
    if (turn < 0 && triangles->count) status = POLYGON_CROSSED;
    if (turn != 0) ring_clip(ring, ring->at, triangles);
    return triangles->count ? status : POLYGON_WITHOUT_AREA;
}

PolygonStatus polygon_triangulate(const Vector3 *corners, size_t count, PolygonTriangles *triangles)
{
    triangles->count = 0;
    Vector3 normal = polygon_normal(corners, count);
    if (count == 3 && vector_is_zero(normal) && triangle_has_area(corners[0], corners[1], corners[2])) {
        array_reserve(*triangles, 1);
        memcpy(triangles->items[triangles->count++], (uint32_t[]){0, 1, 2}, sizeof *triangles->items);
        return POLYGON_CUT;
    }
    if (vector_is_zero(normal)) return POLYGON_WITHOUT_AREA;
    __attribute__((cleanup(ring_close))) Ring ring = ring_open(corners, count, normal);
    return ring_cut(&ring, triangles);
}
