#include "host/verify/families.h"

#include "host/base/array.h"
#include "host/base/random.h"
#include <math.h>
#include <string.h>

#ifdef __clang__
#pragma STDC FP_CONTRACT OFF // gcc contracts nothing at -std=c11
#endif

const Vector3 far_sphere_center = {148376, 1234, -223423};

// Returns the number from 0 to 1 that random bits stand for.
static double unit_interval(uint64_t bits)
{
    return (double)(bits >> 11) * 0x1p-53;
}

double sample_number(unsigned seed, uint64_t index, unsigned dimension)
{
    return unit_interval(random_mix((((uint64_t)seed << 40) + index * 32 + dimension + 1) * RANDOM_STEP));
}

double sample_symmetric(unsigned seed, uint64_t index, unsigned dimension)
{
    return 2 * sample_number(seed, index, dimension) - 1;
}

static unsigned sample_choice(unsigned seed, uint64_t index, unsigned dimension, unsigned count)
{
    return (unsigned)(sample_number(seed, index, dimension) * count);
}

static Vector3 unit_vector(Vector3 a)
{
    double length = sqrt(vector_dot(a, a));
    return (Vector3){a.x / length, a.y / length, a.z / length};
}

Vector3 sample_in_cube(unsigned seed, uint64_t index, unsigned first_dimension)
{
    return (Vector3){sample_symmetric(seed, index, first_dimension),
                     sample_symmetric(seed, index, first_dimension + 1),
                     sample_symmetric(seed, index, first_dimension + 2)};
}

Vector3 sample_unit_vector(unsigned seed, uint64_t index, unsigned first_dimension)
{
    return unit_vector(sample_in_cube(seed, index, first_dimension));
}

// Returns a x + b y + from.
static Vector3 vectors_combine(double a, Vector3 x, double b, Vector3 y, Vector3 from)
{
    return vector_add(vector_add(vector_scale(x, a), vector_scale(y, b)), from);
}

const Vector3 sliver_corners[3] = {{1, 2, 3}, {8.5, 5.7, -4.5}, {7.5, 5.8, -3.6}};

static TraceRay ray_along(Vector3 origin, Vector3 direction)
{
    return (TraceRay){origin, direction, 0, INFINITY};
}

static TraceRay ray_toward(Vector3 origin, Vector3 target)
{
    return ray_along(origin, vector_subtract(target, origin));
}

// Computes a point of the unit circle by its rational parametrization.
static void circle_point(double turn, double *cosine, double *sine)
{
    unsigned quarter = (unsigned)(turn * 4);
    double w = turn * 4 - quarter;
    double c = (1 - w * w) / (1 + w * w), s = 2 * w / (1 + w * w);
    const double cosines[] = {c, -s, -c, s}, sines[] = {s, c, -s, -c};
    *cosine = cosines[quarter];
    *sine = sines[quarter];
}

// Seeds are the cases' numbers, plus 10 for C, 20 for T and 30 for M.

TraceRay family_disc_rim(uint64_t i)
{
    static const double distances[] = {5, 500, 5e4};
    const Vector3 center = {10, 20, 30};
    Vector3 e = unit_vector((Vector3){1, -1, 0}), f = unit_vector((Vector3){1, 1, -2});
    Vector3 away = sample_unit_vector(3, i, 0);
    unsigned steps = 1 + sample_choice(3, i, 3, 64);
    double side = sample_number(3, i, 4) < 0.5 ? 1 : -1;
    double radius = 2 * (1 + side * steps * 0x1p-22);
    double c, s;
    circle_point(sample_number(3, i, 5), &c, &s);
    Vector3 target = vectors_combine(radius * c, e, radius * s, f, center);
    return ray_toward(vector_add(vector_scale(away, distances[i % 3]), center), target);
}

// Aims at a point on an edge, a corner and a point in a face of the room, in turn.
TraceRay family_in_room(uint64_t i)
{
    unsigned axis = sample_choice(5, i, 0, 3);
    double target[3];
    for (unsigned k = 0; k < 3; k++)
        target[k] = sample_number(5, i, 1 + k) < 0.5 ? 1 : -1;
    if (i % 3 != 1) target[axis] = sample_symmetric(5, i, 4);
    if (i % 3 == 2) target[(axis + 1) % 3] = sample_symmetric(5, i, 5);
    return ray_toward((Vector3){0.1, 0.2, 0.3}, vector_from(target));
}

// Alternates rays from inside toward a rim with rays from outside slightly inward of it, so that none miss.
TraceRay family_cylinder_rim(uint64_t i)
{
    const Vector3 base = {5, 5, 5}, axis = {1.0 / 3, 2.0 / 3, 2.0 / 3};
    const Vector3 e = {2.0 / 3, 1.0 / 3, -2.0 / 3}, f = {2.0 / 3, -2.0 / 3, 1.0 / 3};
    bool outside = i % 2 == 1;
    double inset = outside ? 1e-5 : 0;
    double height = sample_number(14, i, 0) < 0.5 ? inset : 2 - inset;
    double c, s;
    circle_point(sample_number(14, i, 1), &c, &s);
    double radius = 1 - inset;
    Vector3 target =
        vector_add(vectors_combine(radius * c, e, radius * s, f, vector_scale(axis, height)), base);
    Vector3 inner = vector_add(axis, base);
    if (!outside) return ray_toward(inner, target);
    Vector3 away = sample_unit_vector(14, i, 2);
    return ray_toward(vector_add(vector_scale(away, 5), inner), target);
}

TraceRay family_along_torus_axis(uint64_t i)
{
    Vector3 origin = {1.3 * sample_symmetric(22, i, 0), 1.3 * sample_symmetric(22, i, 1), 10};
    return ray_along(origin, (Vector3){0, 0, -1});
}

TraceRay family_across_torus(uint64_t i)
{
    Vector3 origin = {-5, 1.3 * sample_symmetric(23, i, 0), 1e-6 * sample_symmetric(23, i, 1)};
    return ray_along(origin, (Vector3){1, 0, 0});
}

TraceRay family_near_sliver(uint64_t i)
{
    const Vector3 a = sliver_corners[0];
    Vector3 ab = vector_subtract(sliver_corners[1], a), ac = vector_subtract(sliver_corners[2], a);
    Vector3 n = unit_vector(vector_cross(ab, ac));
    Vector3 e = unit_vector(ab), f = vector_cross(n, e);
    double c, s;
    circle_point(sample_number(34, i, 0), &c, &s);
    const double grazing = 0.009076; // the tangent of 0.52 degrees
    Vector3 direction = unit_vector(vectors_combine(c, e, s, f, vector_scale(n, grazing)));
    Vector3 target = vectors_combine(sample_number(34, i, 1), ab, 0.3 * sample_symmetric(34, i, 2), ac, a);
    return ray_along(vector_add(vector_scale(direction, -100), target), direction);
}

void scene_add_triangle(Scene *scene, const Vector3 vertices[3])
{
    Object object = {.type = SHAPE_TRIANGLE};
    memcpy(object.as.triangle.vertices, vertices, sizeof object.as.triangle.vertices);
    array_push(scene->objects, object);
}

// Returns corner i, whose coordinates have the signs of the bits of i.
static Vector3 room_corner(unsigned i)
{
    return (Vector3){i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1};
}

void scene_triangle_room(Scene *scene)
{
    static const unsigned faces[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
    for (size_t i = 0; i < 6; i++) {
        const unsigned *face = faces[i];
        Vector3 a = room_corner(face[0]), b = room_corner(face[1]);
        Vector3 c = room_corner(face[2]), d = room_corner(face[3]);
        scene_add_triangle(scene, (Vector3[]){a, b, c});
        scene_add_triangle(scene, (Vector3[]){a, c, d});
    }
}

// Moves a vertex off the unit sphere by up to 20 %. A hash of its coordinates seeds the offset, so all
// triangles that share the vertex agree.
static Vector3 vertex_displace(Vector3 vertex)
{
    const double parts[] = {vertex.x + 0.0, vertex.y + 0.0, vertex.z + 0.0};
    uint64_t state = 31;
    for (size_t k = 0; k < 3; k++) {
        uint64_t bits;
        memcpy(&bits, &parts[k], sizeof bits);
        state = random_mix(state + bits);
    }
    double size = 1 + 0.2 * (2 * unit_interval(state) - 1);
    return vector_scale(vertex, size);
}

typedef struct {
    Vector3 corners[3];
} TriangleCorners;

// Returns one of the 4^depth parts of a spherical triangle, which pairs of bits of `path` select.
static TriangleCorners icosphere_part(TriangleCorners whole, unsigned depth, unsigned path)
{
    while (depth-- > 0) {
        Vector3 a = whole.corners[0], b = whole.corners[1], c = whole.corners[2];
        Vector3 ab = unit_vector(vector_add(a, b)), bc = unit_vector(vector_add(b, c)),
                ca = unit_vector(vector_add(c, a));
        const TriangleCorners parts[] = {{{a, ab, ca}}, {{ab, b, bc}}, {{ca, bc, c}}, {{ab, bc, ca}}};
        whole = parts[path >> (2 * depth) & 3];
    }
    return (TriangleCorners){{vertex_displace(whole.corners[0]), vertex_displace(whole.corners[1]),
                              vertex_displace(whole.corners[2])}};
}

enum {
    ICOSPHERE_DEPTH = 5,
    ICOSPHERE_PARTS = 1 << 2 * ICOSPHERE_DEPTH,
    ICOSPHERE_COUNT = 20 * ICOSPHERE_PARTS
};

static Vector3 icosahedron_corner(unsigned i)
{
    double g = (1 + sqrt(5)) / 2;
    double one = i & 1 ? 1 : -1, golden = i & 2 ? -g : g;
    if (i < 4) return unit_vector((Vector3){one, golden, 0});
    if (i < 8) return unit_vector((Vector3){0, one, golden});
    return unit_vector((Vector3){golden, 0, one});
}

static TriangleCorners icosphere_triangle(unsigned index)
{
    static const unsigned char faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                               {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                               {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                               {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const unsigned char *face = faces[index / ICOSPHERE_PARTS];
    TriangleCorners whole = {
        {icosahedron_corner(face[0]), icosahedron_corner(face[1]), icosahedron_corner(face[2])}};
    return icosphere_part(whole, ICOSPHERE_DEPTH, index % ICOSPHERE_PARTS);
}

void scene_icosphere(Scene *scene)
{
    for (unsigned i = 0; i < ICOSPHERE_COUNT; i++)
        scene_add_triangle(scene, icosphere_triangle(i).corners);
}

// Starts from 100 points less than 0.3 from the center, so within the mesh, and aims at points on edges (two
// of five), at vertices (two) and at points in faces (one).
TraceRay family_from_within(uint64_t i)
{
    unsigned point = sample_choice(31, i, 0, 100);
    Vector3 origin = vector_scale(sample_in_cube(32, point, 0), 0.17);
    TriangleCorners triangle = icosphere_triangle(sample_choice(31, i, 1, ICOSPHERE_COUNT));
    unsigned first = sample_choice(31, i, 2, 3);
    Vector3 a = triangle.corners[first], b = triangle.corners[(first + 1) % 3],
            c = triangle.corners[(first + 2) % 3];
    double u = 0, v = 0;
    if (i % 5 < 2 || i % 5 == 4) u = sample_number(31, i, 3);
    if (i % 5 == 4) v = (1 - u) * sample_number(31, i, 4);
    return ray_toward(origin, vectors_combine(u, vector_subtract(b, a), v, vector_subtract(c, a), a));
}

void scene_far_sphere(Scene *scene)
{
    enum { ROWS = 50, COLUMNS = 50 };
    Vector3 points[ROWS + 1][COLUMNS];
    for (unsigned row = 0; row <= ROWS; row++)
        for (unsigned column = 0; column < COLUMNS; column++) {
            double down = M_PI * row / ROWS, around = 2 * M_PI * column / COLUMNS;
            double across = row % ROWS == 0 ? 0 : sin(down);
            Vector3 out = {across * cos(around), cos(down), across * sin(around)};
            points[row][column] = vector_add(far_sphere_center, vector_scale(out, 2));
        }
    for (unsigned row = 0; row < ROWS; row++)
        for (unsigned column = 0; column < COLUMNS; column++) {
            unsigned next = (column + 1) % COLUMNS;
            Vector3 a = points[row][column], b = points[row][next];
            Vector3 c = points[row + 1][next], d = points[row + 1][column];
            if (row > 0) scene_add_triangle(scene, (Vector3[]){a, b, c});
            if (row + 1 < ROWS) scene_add_triangle(scene, (Vector3[]){a, c, d});
        }
}
