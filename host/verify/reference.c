#include "host/verify/reference.h"

#include <math.h>

#define UNBOUNDED ((Quad)LDBL_MAX)

ReferenceRay reference_ray(Vector3 origin, Vector3 direction)
{
    return (ReferenceRay){quad3(origin), quad3(direction), 0, (Quad)FLT_MAX};
}

static void round_number(double *number)
{
    volatile float single = (float)*number; // volatile: see host/compile/rounding.c
    *number = (double)single;
}

static void round_numbers(double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++)
        round_number(&numbers[i]);
}

ReferenceRay reference_ray_rounded(Vector3 origin, Vector3 direction)
{
    round_numbers(&origin.x, 3);
    round_numbers(&direction.x, 3);
    return reference_ray(origin, direction);
}

Quad3 reference_point(const ReferenceRay *ray, Quad t)
{
    return quad3_add(ray->origin, quad3_scale(ray->direction, t));
}

double reference_ulp(Quad value, int significant_bits)
{
    int exponent;
    frexpl((long double)value, &exponent);
    return ldexp(1, exponent - significant_bits);
}

double reference_distance(Vector3 a, Quad3 b)
{
    return (double)quad3_length(quad3_subtract(quad3(a), b));
}

Quad reference_highlight(Quad3 normal, Quad3 to_light, Quad3 to_eye, double shininess)
{
    Quad facing = quad3_dot(normal, to_light);
    if (facing <= 0) return 0;
    Quad alignment = quad3_dot(quad3_subtract(quad3_scale(normal, 2 * facing), to_light), to_eye);
    return powl(alignment > 0 ? (long double)alignment : 0, shininess);
}

static void margin_reduce(ReferenceHit *hit, Quad margin)
{
    hit->margin = quad_minimum(hit->margin, quad_absolute(margin));
}

// Takes the crossing at `t` if it is the nearest so far. `normal` points outward; it need not be unit.
//
// A hit begins to count where the ray's start lies on the surface: the margin is twice the start's height
// over the tangent plane of the hit.
static void offer(ReferenceHit *hit, const ReferenceRay *ray, Quad t, Quad3 normal, Quad curvature_radius)
{
    if (hit->found && t >= hit->t) return;
    Quad inverse = 1 / quad3_length(normal), approach = -quad3_dot(normal, ray->direction) * inverse;
    margin_reduce(hit, 2 * (t - ray->tmin) * approach);
    if (!(t > ray->tmin && t < ray->tmax)) return;
    hit->found = true;
    hit->object = 0;
    hit->t = t;
    hit->normal = quad3_scale(normal, approach < 0 ? -inverse : inverse);
    hit->shading_normal = hit->normal;
    hit->entering = approach >= 0;
    hit->cosine = quad_absolute(approach) / quad3_length(ray->direction);
    hit->curvature_radius = curvature_radius;
}

static void surface_measure(ReferenceSurface *surface, Vector3 center, double bounding_radius,
                            double feature_radius)
{
    surface->center = center;
    surface->bounding_radius = bounding_radius;
    surface->feature_radius = feature_radius;
}

static void surface_add(ReferenceSurface *surface, Quad distance, Quad3 normal, Quad curvature_radius)
{
    surface->sheets[surface->count++] = (ReferenceSheet){quad_absolute(distance), normal, curvature_radius};
}

// How far a number is outside an interval.
static Quad outside(Quad value, Quad low, Quad high)
{
    return value < low ? low - value : value > high ? value - high : 0;
}

static Quad diagonal(Quad a, Quad b)
{
    return a == 0 ? quad_absolute(b) : b == 0 ? quad_absolute(a) : quad_root(a * a + b * b);
}

static Quad point_line_distance(Quad3 point, Quad3 on_line, Quad3 direction)
{
    return quad3_length(quad3_cross(quad3_subtract(point, on_line), direction)) / quad3_length(direction);
}

// Between the ray's line and another, both infinite.
static Quad line_distance(const ReferenceRay *ray, Quad3 on_line, Quad3 direction)
{
    Quad3 across = quad3_cross(ray->direction, direction);
    if (quad3_dot(across, across) == 0) return point_line_distance(ray->origin, on_line, direction);
    return quad_absolute(quad3_dot(quad3_subtract(ray->origin, on_line), quad3_unit(across)));
}

// Solves A t^2 + 2 B t + C = 0; returns how many roots there are. A root that far away is what roundings left
// of an A that is 0.
static int quadratic_roots(Quad a, Quad b, Quad c, Quad roots[2])
{
    Quad discriminant = b * b - a * c;
    if (discriminant < 0 || (a == 0 && b == 0)) return 0;
    Quad root = quad_root(discriminant);
    Quad sum = b < 0 ? root - b : -b - root;
    roots[0] = sum == 0 ? 0 : c / sum;
    if (quad_absolute(sum) > (Quad)1e25L * quad_absolute(a)) return 1;
    roots[1] = sum / a;
    return 2;
}

static void hit_sphere(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad radius = object->as.sphere.radius;
    Quad3 from_center = quad3_subtract(ray->origin, quad3(object->as.sphere.center));
    Quad a = quad3_dot(ray->direction, ray->direction);
    Quad b = quad3_dot(from_center, ray->direction);
    Quad c = quad3_dot(from_center, from_center) - radius * radius;
    margin_reduce(hit, (b * b / a - c) / radius); // (r^2 - l^2) / r, l the line's distance from the center
    Quad roots[2];
    int count = quadratic_roots(a, b, c, roots);
    for (int i = 0; i < count; i++) {
        Quad3 normal = quad3_add(from_center, quad3_scale(ray->direction, roots[i]));
        if (object->as.sphere.only_inside && quad3_dot(normal, ray->direction) < 0) continue;
        offer(hit, ray, roots[i], normal, radius);
    }
}

static void surface_sphere(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    double radius = object->as.sphere.radius;
    Quad3 from_center = quad3_subtract(point, quad3(object->as.sphere.center));
    Quad distance = quad3_length(from_center);
    surface_measure(surface, object->as.sphere.center, radius, radius);
    surface_add(surface, distance - radius, quad3_scale(from_center, 1 / distance), radius);
}

// Where a ray crosses the plane through `point`; false if it is parallel.
static bool plane_crossing(const ReferenceRay *ray, Quad3 point, Quad3 normal, Quad *t)
{
    Quad approach = quad3_dot(ray->direction, normal);
    if (approach == 0) return false;
    *t = quad3_dot(quad3_subtract(point, ray->origin), normal) / approach;
    return true;
}

static Quad plane_cosine(const ReferenceRay *ray, Quad3 normal)
{
    return quad_absolute(quad3_dot(quad3_unit(ray->direction), quad3_unit(normal)));
}

static void hit_plane(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 point = quad3(object->as.plane.point), normal = quad3(object->as.plane.normal);
    // The ray has to turn by this angle to be parallel, which moves it so much at the distance of `point`.
    margin_reduce(hit, plane_cosine(ray, normal) * quad3_length(quad3_subtract(point, ray->origin)));
    // Twice the height of the ray's start: on the plane itself the hit ends.
    margin_reduce(hit, 2 * quad3_dot(quad3_unit(normal), quad3_subtract(point, ray->origin)));
    Quad t;
    if (plane_crossing(ray, point, normal, &t)) offer(hit, ray, t, normal, UNBOUNDED);
}

static void surface_plane(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    Quad3 normal = quad3_unit(quad3(object->as.plane.normal));
    Quad height = quad3_dot(quad3_subtract(point, quad3(object->as.plane.point)), normal);
    surface_measure(surface, object->as.plane.point, 0, 0);
    surface_add(surface, height, normal, UNBOUNDED);
}

// Twice the distance from the rim, within the plane, is about (d^2 / r^2 - 1) r. Between the ray's line and
// the rim's nearest tangent it is shorter by approach / spread.
static void hit_disc_at(Quad3 center, Quad3 normal, Quad radius, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad t;
    if (radius <= 0 || !plane_crossing(ray, center, normal, &t)) return;
    Quad3 from_center = quad3_subtract(reference_point(ray, t), center);
    Quad excess = quad3_dot(from_center, from_center) / (radius * radius) - 1;
    Quad3 across = quad3_cross(ray->direction, quad3_unit(quad3_cross(normal, from_center)));
    Quad approach = quad3_dot(ray->direction, quad3_unit(normal)), spread = quad3_length(across);
    margin_reduce(hit, excess * radius * (spread > 0 ? approach / spread : 1));
    if (excess <= 0) offer(hit, ray, t, normal, UNBOUNDED);
}

static void hit_disc(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 center = quad3(object->as.disc.center), normal = quad3(object->as.disc.normal);
    // Seen edge on, a disc is there or not by the sign of the height of the eye over it.
    margin_reduce(hit, plane_cosine(ray, normal) * quad3_length(quad3_subtract(center, ray->origin)));
    hit_disc_at(center, normal, object->as.disc.radius, ray, hit);
}

static void surface_disc(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    double radius = object->as.disc.radius;
    Quad3 from_center = quad3_subtract(point, quad3(object->as.disc.center));
    Quad3 normal = quad3_unit(quad3(object->as.disc.normal));
    Quad height = quad3_dot(from_center, normal);
    Quad off = quad3_length(quad3_subtract(from_center, quad3_scale(normal, height)));
    surface_measure(surface, object->as.disc.center, radius, radius);
    surface_add(surface, diagonal(height, outside(off, 0, radius)), normal, UNBOUNDED);
}

static void hit_box(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Vector3 corners[2] = {object->as.box.min, object->as.box.max};
    const Quad low[3] = {corners[0].x, corners[0].y, corners[0].z};
    const Quad high[3] = {corners[1].x, corners[1].y, corners[1].z};
    // along an axis a hit is a comparison of given numbers, and nothing is open
    bool along_axis = (ray->direction.x == 0) + (ray->direction.y == 0) + (ray->direction.z == 0) == 2;
    for (int axis = 0; axis < 3; axis++) {
        Quad3 along = {axis == 0, axis == 1, axis == 2};
        for (int side = 0; side < 2; side++) {
            Quad t;
            if (!plane_crossing(ray, quad3(corners[side]), along, &t)) continue;
            Quad3 point = reference_point(ray, t);
            const Quad at[3] = {point.x, point.y, point.z};
            int next = (axis + 1) % 3, last = (axis + 2) % 3;
            if (at[next] >= low[next] && at[next] <= high[next] && at[last] >= low[last] &&
                at[last] <= high[last])
                offer(hit, ray, t, quad3_scale(along, side ? 1 : -1), UNBOUNDED);
        }
        for (int edge = 0; edge < 4 && !along_axis; edge++) {
            Vector3 y_and_z = {corners[0].x, corners[edge & 1].y, corners[edge >> 1].z};
            Vector3 z_and_x = {corners[edge & 1].x, corners[0].y, corners[edge >> 1].z};
            Vector3 x_and_y = {corners[edge & 1].x, corners[edge >> 1].y, corners[0].z};
            Vector3 on_edge = axis == 0 ? y_and_z : axis == 1 ? z_and_x : x_and_y;
            margin_reduce(hit, 2 * line_distance(ray, quad3(on_edge), along));
        }
    }
}

static void surface_box(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    const Vector3 min = object->as.box.min, max = object->as.box.max;
    const double low[] = {min.x, min.y, min.z}, high[] = {max.x, max.y, max.z};
    const Quad at[] = {point.x, point.y, point.z};
    Vector3 center = vector_scale(vector_add(object->as.box.min, object->as.box.max), 0.5);
    double size = vector_length(vector_subtract(object->as.box.max, object->as.box.min)) / 2;
    surface_measure(surface, center, size, size);
    for (int axis = 0; axis < 3; axis++) {
        int next = (axis + 1) % 3, last = (axis + 2) % 3;
        Quad beside =
            diagonal(outside(at[next], low[next], high[next]), outside(at[last], low[last], high[last]));
        Quad3 normal = {axis == 0, axis == 1, axis == 2};
        surface_add(surface, diagonal(at[axis] - low[axis], beside), normal, UNBOUNDED);
        surface_add(surface, diagonal(at[axis] - high[axis], beside), normal, UNBOUNDED);
    }
}

// A cylinder or cone: radius `base` at `from`, growing by `slope` along the unit axis, up to `height` if it
// is finite; an infinite cone has both nappes.
typedef struct {
    Quad3 from, axis;
    Quad base, slope, height;
    bool finite, caps, only_inside;
} Revolution;

static Revolution revolution_of(const Object *object)
{
    bool is_cylinder = object->kind == SHAPE_CYLINDER;
    Quad3 axis = quad3(is_cylinder ? object->as.cylinder.axis : object->as.cone.axis);
    Quad height = quad3_length(axis);
    axis = quad3_scale(axis, 1 / height);
    if (is_cylinder)
        return (Revolution){.from = quad3(object->as.cylinder.from),
                            .axis = axis,
                            .base = object->as.cylinder.radius,
                            .height = height,
                            .finite = object->as.cylinder.finite,
                            .caps = object->as.cylinder.caps,
                            .only_inside = object->as.cylinder.only_inside};
    Quad first = object->as.cone.radius[0], second = object->as.cone.radius[1];
    bool finite = object->as.cone.finite;
    return (Revolution){.from = quad3(object->as.cone.from),
                        .axis = axis,
                        .base = finite ? first : 0,
                        .slope = finite ? (second - first) / height : object->as.cone.slope,
                        .height = height,
                        .finite = finite,
                        .caps = object->as.cone.caps,
                        .only_inside = object->as.cone.only_inside};
}

static void hit_side(const Revolution *body, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 across = quad3_perpendicular(body->axis), beside = quad3_cross(body->axis, across);
    Quad3 from = quad3_subtract(ray->origin, body->from);
    Quad3 p = {quad3_dot(from, across), quad3_dot(from, beside), quad3_dot(from, body->axis)};
    Quad3 q = {quad3_dot(ray->direction, across), quad3_dot(ray->direction, beside),
               quad3_dot(ray->direction, body->axis)};
    // What the rounding of `across` leaves in a ray along the axis is not a direction.
    if (q.x * q.x + q.y * q.y < (Quad)1e-60L * q.z * q.z) q.x = q.y = 0;
    Quad radius = body->base + body->slope * p.z, growth = body->slope * q.z;
    Quad a = q.x * q.x + q.y * q.y - growth * growth;
    Quad b = p.x * q.x + p.y * q.y - radius * growth;
    Quad c = p.x * p.x + p.y * p.y - radius * radius;

    // With e the distance of the ray from the axis, seen along it, and s the radius of the body there,
    // the discriminant is proportional to s^2 - e^2.
    Quad steepness = quad_root(q.x * q.x + q.y * q.y);
    Quad3 outline = {radius * q.x - growth * p.x, radius * q.y - growth * p.y, 0};
    Quad silhouette = quad3_length(outline);
    if (steepness > 0 && silhouette > 0) margin_reduce(hit, (b * b - a * c) / (silhouette * steepness));
    if (body->slope != 0) {
        Quad apex = -body->base / body->slope;
        if (!body->finite || (apex >= 0 && apex <= body->height)) {
            Quad3 apex_point = quad3_add(body->from, quad3_scale(body->axis, apex));
            margin_reduce(hit, 2 * point_line_distance(apex_point, ray->origin, ray->direction));
        }
    }

    Quad roots[2];
    int count = quadratic_roots(a, b, c, roots);
    for (int i = 0; i < count; i++) {
        Quad x = p.x + roots[i] * q.x, y = p.y + roots[i] * q.y, z = p.z + roots[i] * q.z;
        Quad3 gradient = {x, y, -body->slope * (body->base + body->slope * z)};
        if (quad3_dot(gradient, gradient) == 0) gradient.z = -1;
        Quad3 normal = quad3_add(quad3_add(quad3_scale(across, gradient.x), quad3_scale(beside, gradient.y)),
                                 quad3_scale(body->axis, gradient.z));
        if (body->finite) {
            Quad cosine = plane_cosine(ray, normal);
            margin_reduce(hit, 2 * z * cosine);
            margin_reduce(hit, 2 * (body->height - z) * cosine);
            if (z < 0 || z > body->height) continue;
        }
        if (body->only_inside && quad3_dot(normal, ray->direction) < 0) continue;
        offer(hit, ray, roots[i], normal, quad_root(x * x + y * y));
    }
}

static void hit_revolution(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Revolution body = revolution_of(object);
    hit_side(&body, ray, hit);
    if (!body.finite || !body.caps) return;
    hit_disc_at(body.from, quad3_scale(body.axis, -1), body.base, ray, hit);
    hit_disc_at(quad3_add(body.from, quad3_scale(body.axis, body.height)), body.axis,
                body.base + body.slope * body.height, ray, hit);
}

// In the half-plane through the axis that holds the point: `along` the axis from the base, `off` it.
static void surface_revolution(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    Revolution body = revolution_of(object);
    Quad3 from = quad3_subtract(point, body.from), axis = body.axis;
    Quad along = quad3_dot(from, axis);
    if (!body.finite && body.slope != 0 && along < 0) {
        along = -along;
        axis = quad3_scale(axis, -1);
    }
    Quad3 across = quad3_subtract(from, quad3_scale(axis, along));
    Quad off = quad3_length(across), cosine = 1 / diagonal(1, body.slope); // of the side with the axis
    Quad3 radial = off > 0 ? quad3_scale(across, 1 / off) : axis;
    Quad end_radius = body.base + body.slope * body.height;
    double largest = (double)quad_maximum(body.base, end_radius), half = (double)body.height / 2;
    if (!body.finite) half = 0;
    Vector3 middle = vector_add(quad3_rounded(body.from), vector_scale(quad3_rounded(body.axis), half));
    surface_measure(surface, middle, hypot(largest, half), largest);

    Quad place = (along + body.slope * (off - body.base)) * cosine; // along the side's line
    Quad away = (off - body.base - body.slope * along) * cosine;    // from it
    Quad beyond = 0;
    if (body.finite) beyond = outside(place, 0, body.height / cosine);
    if (!body.finite && body.slope != 0) beyond = outside(place, 0, UNBOUNDED);
    Quad3 normal = quad3_scale(quad3_subtract(radial, quad3_scale(axis, body.slope)), cosine);
    surface_add(surface, diagonal(away, beyond), normal, quad_maximum(off, (Quad)1e-30L) / cosine);
    if (!body.finite || !body.caps) return;
    surface_add(surface, diagonal(along, outside(off, 0, body.base)), axis, UNBOUNDED);
    surface_add(surface, diagonal(along - body.height, outside(off, 0, end_radius)), axis, UNBOUNDED);
}

// How far the ray's line passes outside a bounding sphere, at least; in double, so at most 0 where it is
// near.
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

// Cramer's rule for  u (b - a) + v (c - a) - t d = o - a.
static void hit_triangle(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    const Vector3 *vertices = object->as.triangle.vertices;
    double clearance = sphere_clearance(ray, vertices[0], triangle_longest_side(vertices));
    if (clearance > 0) {
        margin_reduce(hit, clearance);
        return;
    }
    Quad3 corners[3];
    for (int i = 0; i < 3; i++)
        corners[i] = quad3(vertices[i]);
    Quad3 first = quad3_subtract(corners[1], corners[0]), second = quad3_subtract(corners[2], corners[0]);
    Quad3 back = quad3_scale(ray->direction, -1), from = quad3_subtract(ray->origin, corners[0]);
    Quad3 normal = quad3_cross(first, second);
    for (int i = 0; i < 3; i++)
        margin_reduce(hit,
                      2 * line_distance(ray, corners[i], quad3_subtract(corners[(i + 1) % 3], corners[i])));
    Quad whole = determinant(first, second, back);
    if (whole == 0) return;
    Quad u = determinant(from, second, back) / whole;
    Quad v = determinant(first, from, back) / whole;
    Quad t = determinant(first, second, from) / whole;
    if (u < 0 || v < 0 || u + v > 1) return;

    offer(hit, ray, t, normal, UNBOUNDED);
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

// The triangle's plane.
static void surface_triangle(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    const Vector3 *vertices = object->as.triangle.vertices;
    Quad3 a = quad3(vertices[0]);
    Quad3 normal = quad3_cross(quad3_subtract(quad3(vertices[1]), a), quad3_subtract(quad3(vertices[2]), a));
    Quad area = quad3_length(normal);
    normal = quad3_scale(normal, 1 / area);
    double longest = triangle_longest_side(vertices);
    surface_measure(surface, vertices[0], longest, longest);
    surface->normal_condition = longest * longest / (double)area;
    surface_add(surface, quad3_dot(quad3_subtract(point, a), normal), normal, UNBOUNDED);
}

static Quad polynomial_value(const Quad *coefficients, int degree, Quad x)
{
    Quad value = coefficients[degree];
    for (int i = degree - 1; i >= 0; i--)
        value = value * x + coefficients[i];
    return value;
}

// The zero between two places around which the polynomial only rises or only falls: Newton's method, and
// halving where that leaves the bracket.
static Quad polynomial_zero(const Quad *coefficients, const Quad *derivative, int degree, Quad before,
                            Quad after)
{
    bool rising = polynomial_value(coefficients, degree, before) < 0;
    Quad x = (before + after) / 2;
    for (int i = 0; i < 2 * QUAD_BITS; i++) {
        Quad value = polynomial_value(coefficients, degree, x);
        *((value < 0) == rising ? &before : &after) = x;
        Quad slope = polynomial_value(derivative, degree - 1, x), next = x;
        if (slope != 0) next = x - value / slope;
        if (next == x) break;
        if (!(next > before && next < after)) next = (before + after) / 2;
        if (next == before || next == after) break;
        x = next;
    }
    return x;
}

// Where a polynomial of degree 1..4 changes its sign between two places, ascending; returns how often. From
// one such place of its derivative to the next it only rises or only falls.
static int polynomial_zeros(const Quad *coefficients, int degree, Quad low, Quad high, Quad zeros[])
{
    Quad derivative[4], places[5] = {low};
    for (int i = 0; i < degree; i++)
        derivative[i] = (Quad)(i + 1) * coefficients[i + 1];
    int turn_count = degree > 1 ? polynomial_zeros(derivative, degree - 1, low, high, places + 1) : 0;
    places[turn_count + 1] = high;
    int count = 0;
    for (int i = 0; i <= turn_count; i++) {
        bool rising = polynomial_value(coefficients, degree, places[i]) < 0;
        if (rising == (polynomial_value(coefficients, degree, places[i + 1]) >= 0))
            zeros[count++] = polynomial_zero(coefficients, derivative, degree, places[i], places[i + 1]);
    }
    return count;
}

// Whether the ray's line certainly stays away from a torus' tube by an eighth of its radius: nothing of the
// tube is nearer to a place than its own distance from it. In double, for rays from not too far.
static bool torus_is_clear(const Object *object, const ReferenceRay *ray)
{
    const double major = object->as.torus.major, minor = object->as.torus.minor;
    Vector3 axis = vector_normalize(object->as.torus.axis);
    Vector3 from = vector_subtract(quad3_rounded(ray->origin), object->as.torus.center);
    Vector3 direction = vector_normalize(quad3_rounded(ray->direction));
    double middle = -vector_dot(from, direction), span = 2 * (major + minor);
    if (minor < 1e-10 * (vector_length(from) + vector_length(object->as.torus.center))) return false;
    for (double s = middle - span; s < middle + span;) {
        Vector3 p = vector_add(from, vector_scale(direction, s));
        double height = vector_dot(p, axis);
        double off = vector_length(vector_subtract(p, vector_scale(axis, height)));
        double clear = hypot(off - major, height) - minor;
        if (clear < minor / 4) return false;
        s += clear - minor / 8;
    }
    return true;
}

// In the frame of the axis, from the ray's closest approach to the center on: the zeros of
// (|p|^2 + R^2 - r^2)^2 - 4 R^2 (x^2 + y^2), and where it turns. Where r > R some have |p|^2 + R^2 - r^2
// below 0, at r from the circle's far side: they lie within the solid. On the axis itself they coincide with
// others, and the polynomial touches 0 only, which leaves the hit open.
static void hit_torus(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad major = object->as.torus.major, minor = object->as.torus.minor;
    if (torus_is_clear(object, ray)) {
        margin_reduce(hit, minor / 4);
        return;
    }
    Quad3 axis = quad3_unit(quad3(object->as.torus.axis)), across = quad3_perpendicular(axis);
    Quad3 beside = quad3_cross(axis, across);
    Quad length = quad3_length(ray->direction);
    Quad3 direction = quad3_scale(ray->direction, 1 / length);
    Quad3 from = quad3_subtract(ray->origin, quad3(object->as.torus.center));
    Quad closest = -quad3_dot(from, direction);
    from = quad3_add(from, quad3_scale(direction, closest));
    Quad3 p = {quad3_dot(from, across), quad3_dot(from, beside), quad3_dot(from, axis)};
    Quad3 q = {quad3_dot(direction, across), quad3_dot(direction, beside), quad3_dot(direction, axis)};

    const Quad pp = quad3_dot(p, p), pq = quad3_dot(p, q), four = 4 * major * major;
    const Quad sum[3] = {pp + major * major - minor * minor, 2 * pq, 1}; // |p + s q|^2 + R^2 - r^2
    const Quad quartic[5] = {sum[0] * sum[0] - four * (p.x * p.x + p.y * p.y),
                             2 * sum[0] * sum[1] - 2 * four * (p.x * q.x + p.y * q.y),
                             sum[1] * sum[1] + 2 * sum[0] - four * (q.x * q.x + q.y * q.y), 2 * sum[1], 1};
    const Quad cubic[4] = {quartic[1], 2 * quartic[2], 3 * quartic[3], 4};
    Quad half_span = 4 * (major + minor), turns[3], zeros[4];
    int count = polynomial_zeros(quartic, 4, -half_span, half_span, zeros);
    for (int i = 0; i < count; i++) {
        if (polynomial_value(sum, 2, zeros[i]) < 0) continue;
        Quad3 at = quad3_add(p, quad3_scale(q, zeros[i]));
        Quad rho = quad_root(at.x * at.x + at.y * at.y), out = 1 - major / rho;
        Quad3 normal = quad3_add(quad3_add(quad3_scale(across, at.x * out), quad3_scale(beside, at.y * out)),
                                 quad3_scale(axis, at.z));
        offer(hit, ray, (closest + zeros[i]) / length, normal, quad_minimum(minor, rho));
    }
    // the hit is there because of the turns up to the next behind it
    int turn_count = polynomial_zeros(cubic, 3, -half_span, half_span, turns);
    bool behind = false;
    for (int i = 0; i < turn_count && !behind; i++) {
        Quad3 at = quad3_add(p, quad3_scale(q, turns[i]));
        Quad off = quad_root(at.x * at.x + at.y * at.y) - major;
        margin_reduce(hit, 2 * (diagonal(off, at.z) - minor));
        behind = hit->found && closest + turns[i] > hit->t * length;
    }
}

static void surface_torus(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    double major = object->as.torus.major, minor = object->as.torus.minor;
    Quad3 from_center = quad3_subtract(point, quad3(object->as.torus.center));
    Quad3 axis = quad3_unit(quad3(object->as.torus.axis));
    Quad3 across = quad3_subtract(from_center, quad3_scale(axis, quad3_dot(from_center, axis)));
    Quad3 from_circle = quad3_subtract(from_center, quad3_scale(quad3_unit(across), major));
    Quad distance = quad3_length(from_circle);
    surface_measure(surface, object->as.torus.center, major + minor, minor);
    surface_add(surface, distance - minor, quad3_scale(from_circle, 1 / distance), minor);
}

static void hit_paraboloid(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad focal_length = object->as.paraboloid.focal_length, height = object->as.paraboloid.height;
    Quad3 apex = quad3(object->as.paraboloid.apex), axis = quad3_unit(quad3(object->as.paraboloid.axis));
    Quad3 from = quad3_subtract(ray->origin, apex);
    Quad3 m = quad3_cross(from, axis), q = quad3_cross(ray->direction, axis);
    Quad a = quad3_dot(q, q), b = quad3_dot(m, q) - 2 * focal_length * quad3_dot(ray->direction, axis);
    Quad c = quad3_dot(m, m) - 4 * focal_length * quad3_dot(from, axis);

    // How far the line is from one that only touches: the discriminant over its gradient, or less where it
    // bends away from that.
    Quad discriminant = b * b - a * c;
    Quad3 gradient = quad3_add(quad3_scale(quad3_cross(ray->direction, q), 4 * focal_length),
                               quad3_scale(q, 2 * quad3_dot(from, q)));
    if (quad3_dot(gradient, gradient) > 0) margin_reduce(hit, 2 * discriminant / quad3_length(gradient));
    if (discriminant > 0 && a > 0) margin_reduce(hit, quad_root(discriminant / a));

    Quad roots[2];
    int count = quadratic_roots(a, b, c, roots);
    for (int i = 0; i < count; i++) {
        Quad3 p = quad3_add(from, quad3_scale(ray->direction, roots[i]));
        Quad z = quad3_dot(p, axis);
        Quad3 across = quad3_subtract(p, quad3_scale(axis, z));
        Quad3 normal = quad3_subtract(across, quad3_scale(axis, 2 * focal_length));
        if (object->as.paraboloid.finite) {
            margin_reduce(hit, 2 * (height - z) * plane_cosine(ray, normal));
            if (z > height) continue;
        }
        offer(hit, ray, roots[i], normal, quad3_length(normal));
    }
    if (object->as.paraboloid.finite && object->as.paraboloid.caps)
        hit_disc_at(quad3_add(apex, quad3_scale(axis, height)), axis, 2 * quad_root(focal_length * height),
                    ray, hit);
}

// To first order: exact for points that are nearer to it than it is curved.
static void surface_paraboloid(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    Quad focal_length = object->as.paraboloid.focal_length, height = object->as.paraboloid.height;
    Quad3 apex = quad3(object->as.paraboloid.apex), axis = quad3_unit(quad3(object->as.paraboloid.axis));
    Quad3 from = quad3_subtract(point, apex);
    Quad z = quad3_dot(from, axis);
    Quad3 across = quad3_subtract(from, quad3_scale(axis, z));
    Quad3 normal = quad3_subtract(across, quad3_scale(axis, 2 * focal_length));
    Quad off = quad3_length(across), curvature_radius = quad3_length(normal);
    bool finite = object->as.paraboloid.finite;
    Quad rim = finite ? 2 * quad_root(focal_length * height) : 2 * focal_length;
    Quad3 middle = quad3_add(apex, quad3_scale(axis, finite ? height / 2 : 0));
    surface_measure(surface, quad3_rounded(middle), (double)diagonal(rim, height / 2), (double)rim);
    Quad beyond = finite && z > height ? (z - height) * curvature_radius / off : 0;
    surface_add(surface, diagonal((off * off - 4 * focal_length * z) / (2 * curvature_radius), beyond),
                quad3_scale(normal, 1 / curvature_radius), curvature_radius);
    if (finite && object->as.paraboloid.caps)
        surface_add(surface, diagonal(z - height, outside(off, 0, rim)), axis, UNBOUNDED);
}

// A shape's members are doubles in a row, `point_count` points first, then flags.
static const struct {
    void (*hit)(const Object *object, const ReferenceRay *ray, ReferenceHit *hit);
    void (*surface)(const Object *object, Quad3 point, ReferenceSurface *surface);
    unsigned point_count, number_count;
} shapes[SHAPE_COUNT] = {
    [SHAPE_SPHERE] = {hit_sphere, surface_sphere, 1, 4},
    [SHAPE_PLANE] = {hit_plane, surface_plane, 1, 6},
    [SHAPE_DISC] = {hit_disc, surface_disc, 1, 7},
    [SHAPE_BOX] = {hit_box, surface_box, 2, 6},
    [SHAPE_CYLINDER] = {hit_revolution, surface_revolution, 1, 7},
    [SHAPE_CONE] = {hit_revolution, surface_revolution, 1, 9},
    [SHAPE_TRIANGLE] = {hit_triangle, surface_triangle, 3, 18},
    [SHAPE_TORUS] = {hit_torus, surface_torus, 1, 8},
    [SHAPE_PARABOLOID] = {hit_paraboloid, surface_paraboloid, 1, 8},
};

Object reference_round_object(const Object *object)
{
    Object result = *object;
    Vector3 *points = (Vector3 *)(void *)&result.as, end = vector_add(points[0], points[1]);
    bool finite = (object->kind == SHAPE_CYLINDER && object->as.cylinder.finite) ||
                  (object->kind == SHAPE_CONE && object->as.cone.finite);
    round_numbers(&points[0].x, shapes[object->kind].number_count);
    round_numbers(&end.x, 3);
    if (finite) points[1] = vector_subtract(end, points[0]);
    return result;
}

Object reference_object_from(const Object *object, Vector3 eye)
{
    Object result = *object;
    Vector3 *points = (Vector3 *)(void *)&result.as;
    for (unsigned i = 0; i < shapes[object->kind].point_count; i++)
        points[i] = vector_subtract(points[i], eye);
    return result;
}

ReferenceHit reference_miss(void)
{
    return (ReferenceHit){.object = UINT32_MAX, .margin = UNBOUNDED};
}

ReferenceHit reference_hit_object(const Object *object, const ReferenceRay *ray)
{
    ReferenceHit hit = reference_miss();
    shapes[object->kind].hit(object, ray, &hit);
    return hit;
}

void reference_hit_take(ReferenceHit *nearest, ReferenceHit hit, uint32_t object, const ReferenceRay *ray)
{
    Quad margin = quad_minimum(nearest->margin, hit.margin);
    if (hit.found && nearest->found)
        margin = quad_minimum(margin, quad_absolute(hit.t - nearest->t) * quad3_length(ray->direction));
    if (hit.found && !(nearest->found && hit.t >= nearest->t)) {
        *nearest = hit;
        nearest->object = object;
    }
    nearest->margin = margin;
}

ReferenceHit reference_hit(const Scene *scene, const ReferenceRay *ray)
{
    ReferenceHit nearest = reference_miss();
    for (size_t i = 0; i < scene->objects.count; i++)
        reference_hit_take(&nearest, reference_hit_object(&scene->objects.items[i], ray), (uint32_t)i, ray);
    return nearest;
}

ReferenceSurface reference_surface(const Object *object, Quad3 point)
{
    ReferenceSurface surface = {.normal_condition = 1};
    shapes[object->kind].surface(object, point, &surface);
    return surface;
}

Quad reference_surface_distance(const ReferenceSurface *surface)
{
    Quad distance = UNBOUNDED;
    for (int i = 0; i < surface->count; i++)
        distance = quad_minimum(distance, surface->sheets[i].distance);
    return distance;
}
