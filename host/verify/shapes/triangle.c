#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

#include <math.h>

// Returns a lower bound, in double, on how far the ray's line passes outside a bounding sphere; 0 or less
// near it.
static double sphere_clearance(const ReferenceRay *ray, Vector3 center, double radius)
{
    Vector3 toward = vector_subtract(center, quad3_rounded(ray->origin));
    Vector3 direction = quad3_rounded(ray->direction);
    double t = vector_dot(toward, direction) / vector_dot(direction, direction);
    double distance = vector_length(vector_subtract(toward, vector_scale(direction, t)));
    double numbers = vector_length(toward) + vector_length(center);
    return distance - radius - 1e-12 * (numbers + radius);
}

static Quad determinant(Quad3 a, Quad3 b, Quad3 c)
{
    return a.x * (b.y * c.z - c.y * b.z) - b.x * (a.y * c.z - c.y * a.z) + c.x * (a.y * b.z - b.y * a.z);
}

static double triangle_longest_side(const Vector3 corners[3])
{
    double longest = 0;
    for (int i = 0; i < 3; i++)
        longest = fmax(longest, vector_length(vector_subtract(corners[(i + 1) % 3], corners[i])));
    return longest;
}

// Solves  u (b - a) + v (c - a) - t d = o - a  by Cramer's rule.
static void hit_triangle(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    const Vector3 *vertices = object->as.triangle.vertices;
    double clearance = sphere_clearance(ray, vertices[0], triangle_longest_side(vertices));
    if (clearance > 0) {
        hit_reduce_margin(hit, clearance);
        return;
    }
    Quad3 corners[3];
    for (int i = 0; i < 3; i++)
        corners[i] = quad3(vertices[i]);
    Quad3 first = quad3_subtract(corners[1], corners[0]), second = quad3_subtract(corners[2], corners[0]);
    Quad3 back = quad3_scale(ray->direction, -1), from = quad3_subtract(ray->origin, corners[0]);
    Quad3 normal = quad3_cross(first, second);
    for (int i = 0; i < 3; i++)
        hit_reduce_margin(
            hit, 2 * line_distance(ray, corners[i], quad3_subtract(corners[(i + 1) % 3], corners[i])));
    Quad whole = determinant(first, second, back);
    if (whole == 0) return;
    Quad u = determinant(from, second, back) / whole;
    Quad v = determinant(first, from, back) / whole;
    Quad t = determinant(first, second, from) / whole;
    if (u < 0 || v < 0 || u + v > 1) return;

    hit_keep_nearest(hit, ray, t, normal, UNBOUNDED);
    if (!object->as.triangle.smooth || !hit->found) return;
    // The vertices' unit normals, turned to the side from which the flat face is seen.
    Quad weights[3] = {1 - u - v, u, v};
    Quad3 smooth = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        smooth =
            quad3_add(smooth, quad3_scale(quad3_unit(quad3(object->as.triangle.normals[i])), weights[i]));
    if (quad3_dot(smooth, hit->normal) < 0) smooth = quad3_scale(smooth, -1);
    hit->shading_normal = quad3_unit(smooth);
}

// Measures the triangle's plane.
static void surface_triangle(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    const Vector3 *vertices = object->as.triangle.vertices;
    Quad3 a = quad3(vertices[0]);
    Quad3 normal = quad3_triangle_normal(a, quad3(vertices[1]), quad3(vertices[2]));
    Quad area = quad3_length(normal);
    normal = quad3_scale(normal, 1 / area);
    double longest = triangle_longest_side(vertices);
    surface_measure(surface, vertices[0], longest, longest);
    surface->normal_condition = longest * longest / (double)area;
    surface_add(surface, quad3_dot(quad3_subtract(point, a), normal), normal, UNBOUNDED);
}

const ReferenceShape reference_triangle = {hit_triangle, surface_triangle, 18};

enum { TRIANGLE_FLAT, TRIANGLE_SMOOTH };

static void triangle_randomize(RandomShape *made, unsigned form, Random *random)
{
    Vector3 *vertices = made->object.as.triangle.vertices, *normals = made->object.as.triangle.normals;
    for (int i = 0; i < 3; i++)
        vertices[i] = vector_add(made->center, vector_scale(random_unit_vector(random), made->radius));
    made->axis = vector_subtract(vertices[1], vertices[0]);
    if (form != TRIANGLE_SMOOTH) return;
    Vector3 normal = vector_normalize(vector_cross(made->axis, vector_subtract(vertices[2], vertices[0])));
    made->object.as.triangle.smooth = true;
    for (int i = 0; i < 3; i++)
        normals[i] = vector_add(normal, vector_scale(random_in_sphere(random), 0.5));
}

const RandomForms triangle_forms = {{"triangle", "smooth triangle"}, triangle_randomize};
