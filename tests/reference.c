#include "tests/reference.h"
#include "tests/reference_quad.h"

#define NOWHERE ((Quad)LDBL_MAX)

enum { QUAD_BITS = 113 };

// The detour through memory keeps GCC 12 from dropping roundings where it merges stores
// (-ftree-slp-vectorize).
static void rounded(double *number)
{
    volatile float narrow = (float)*number;
    *number = (double)narrow;
}

static void rounded3(Vector3 *vector)
{
    rounded(&vector->x);
    rounded(&vector->y);
    rounded(&vector->z);
}

// A finite axis runs to where the end is rounded to.
static void rounded_axis(Vector3 *from, Vector3 *axis, bool finite)
{
    Vector3 end = vector_add(*from, *axis);
    rounded3(from);
    rounded3(&end);
    if (finite)
        *axis = vector_subtract(end, *from);
    else
        rounded3(axis);
}

Object reference_round_object(const Object *object)
{
    Object result = *object;
    switch (result.kind) {
    case SHAPE_SPHERE:
        rounded3(&result.as.sphere.center);
        rounded(&result.as.sphere.radius);
        break;
    case SHAPE_PLANE:
        rounded3(&result.as.plane.point);
        rounded3(&result.as.plane.normal);
        break;
    case SHAPE_DISC:
        rounded3(&result.as.disc.center);
        rounded3(&result.as.disc.normal);
        rounded(&result.as.disc.radius);
        break;
    case SHAPE_BOX:
        rounded3(&result.as.box.min);
        rounded3(&result.as.box.max);
        break;
    case SHAPE_CYLINDER:
        rounded_axis(&result.as.cylinder.from, &result.as.cylinder.axis, result.as.cylinder.finite);
        rounded(&result.as.cylinder.radius);
        break;
    case SHAPE_CONE:
        rounded_axis(&result.as.cone.from, &result.as.cone.axis, result.as.cone.finite);
        rounded(&result.as.cone.radius[0]);
        rounded(&result.as.cone.radius[1]);
        rounded(&result.as.cone.slope);
        break;
    case SHAPE_TRIANGLE:
        for (int i = 0; i < 3; i++) {
            rounded3(&result.as.triangle.vertices[i]);
            rounded3(&result.as.triangle.normals[i]);
        }
        break;
    case SHAPE_TORUS:
        rounded3(&result.as.torus.center);
        rounded3(&result.as.torus.axis);
        rounded(&result.as.torus.major);
        rounded(&result.as.torus.minor);
        break;
    default:
        break;
    }
    return result;
}

ReferenceRay reference_ray(Vector3 origin, Vector3 direction)
{
    return (ReferenceRay){quad3(origin), quad3(direction), 0, (Quad)FLT_MAX};
}

ReferenceRay reference_ray_rounded(Vector3 origin, Vector3 direction)
{
    rounded3(&origin);
    rounded3(&direction);
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

static void narrow(ReferenceHit *hit, Quad margin)
{
    hit->margin = quad_minimum(hit->margin, quad_absolute(margin));
}

// Takes the surface met at `t` if it is the nearest so far. `normal` points outward; it need not be unit.
static void offer(ReferenceHit *hit, const ReferenceRay *ray, Quad t, Quad3 normal, Quad bend)
{
    normal = quad3_unit(normal);
    Quad length = quad3_length(ray->direction);
    Quad cosine = -quad3_dot(normal, ray->direction) / length;
    narrow(hit, 2 * (t - ray->tmin) * length * cosine);
    if (!(t > ray->tmin && t < ray->tmax) || (hit->found && t >= hit->t)) return;
    hit->found = true;
    hit->object = 0;
    hit->t = t;
    hit->normal = cosine < 0 ? quad3_scale(normal, -1) : normal;
    hit->shading_normal = hit->normal;
    hit->entering = cosine >= 0;
    hit->cosine = quad_absolute(cosine);
    hit->bend = bend;
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
    narrow(hit, (b * b / a - c) / radius);
    Quad roots[2];
    int count = quadratic_roots(a, b, c, roots);
    for (int i = 0; i < count; i++) {
        Quad3 normal = quad3_add(from_center, quad3_scale(ray->direction, roots[i]));
        if (object->as.sphere.only_inside && quad3_dot(normal, ray->direction) < 0) continue;
        offer(hit, ray, roots[i], normal, radius);
    }
}

// Where a ray crosses the plane through `point`; false if it runs parallel.
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
    narrow(hit, plane_cosine(ray, normal) * quad3_length(quad3_subtract(point, ray->origin)));
    narrow(hit, 2 * quad3_dot(quad3_unit(normal), quad3_subtract(point, ray->origin)));
    Quad t;
    if (plane_crossing(ray, point, normal, &t)) offer(hit, ray, t, normal, NOWHERE);
}

static void hit_disc_at(Quad3 center, Quad3 normal, Quad radius, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad t;
    if (radius <= 0 || !plane_crossing(ray, center, normal, &t)) return;
    Quad3 from_center = quad3_subtract(reference_point(ray, t), center);
    Quad excess = quad3_dot(from_center, from_center) / (radius * radius) - 1;
    narrow(hit, excess * radius * plane_cosine(ray, normal));
    if (excess <= 0) offer(hit, ray, t, normal, NOWHERE);
}

static void hit_disc(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 center = quad3(object->as.disc.center), normal = quad3(object->as.disc.normal);
    // Seen edge on, a disc is there or not by the sign of the height of the eye over it.
    narrow(hit, plane_cosine(ray, normal) * quad3_length(quad3_subtract(center, ray->origin)));
    hit_disc_at(center, normal, object->as.disc.radius, ray, hit);
}

static void hit_box(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Vector3 corners[2] = {object->as.box.min, object->as.box.max};
    const Quad low[3] = {corners[0].x, corners[0].y, corners[0].z};
    const Quad high[3] = {corners[1].x, corners[1].y, corners[1].z};
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
                offer(hit, ray, t, quad3_scale(along, side ? 1 : -1), NOWHERE);
        }
        for (int edge = 0; edge < 4; edge++) {
            Vector3 y_and_z = {corners[0].x, corners[edge & 1].y, corners[edge >> 1].z};
            Vector3 z_and_x = {corners[edge & 1].x, corners[0].y, corners[edge >> 1].z};
            Vector3 x_and_y = {corners[edge & 1].x, corners[edge >> 1].y, corners[0].z};
            Vector3 on_edge = axis == 0 ? y_and_z : axis == 1 ? z_and_x : x_and_y;
            narrow(hit, 2 * line_distance(ray, quad3(on_edge), along));
        }
    }
}

// A cylinder or cone: radius `base` at `from`, growing by `slope` along the unit axis, up to `height` or
// endless.
typedef struct {
    Quad3 from, axis;
    Quad base, slope, height;
    bool finite, caps, only_inside;
} RoundBody;

static void round_body_side(const RoundBody *body, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 across = quad3_beside(body->axis), beside = quad3_cross(body->axis, across);
    Quad3 from = quad3_subtract(ray->origin, body->from);
    Quad3 p = {quad3_dot(from, across), quad3_dot(from, beside), quad3_dot(from, body->axis)};
    Quad3 q = {quad3_dot(ray->direction, across), quad3_dot(ray->direction, beside),
               quad3_dot(ray->direction, body->axis)};
    // What is left of the rounding of `across` in a ray along the axis is not a direction.
    if (q.x * q.x + q.y * q.y < (Quad)1e-60L * q.z * q.z) q.x = q.y = 0;
    Quad radius = body->base + body->slope * p.z, growth = body->slope * q.z;
    Quad a = q.x * q.x + q.y * q.y - growth * growth;
    Quad b = p.x * q.x + p.y * q.y - radius * growth;
    Quad c = p.x * p.x + p.y * p.y - radius * radius;

    // With e the distance of the ray from the axis, seen along it, and s the radius of the body there,
    // the discriminant is proportional to s^2 - e^2.
    Quad steepness = quad_root(q.x * q.x + q.y * q.y);
    Quad3 reach = {radius * q.x - growth * p.x, radius * q.y - growth * p.y, 0};
    Quad silhouette = quad3_length(reach);
    if (steepness > 0 && silhouette > 0) narrow(hit, (b * b - a * c) / (silhouette * steepness));
    if (body->slope != 0) {
        Quad apex = -body->base / body->slope;
        if (!body->finite || (apex >= 0 && apex <= body->height)) {
            Quad3 apex_point = quad3_add(body->from, quad3_scale(body->axis, apex));
            narrow(hit, 2 * point_line_distance(apex_point, ray->origin, ray->direction));
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
            narrow(hit, 2 * z * cosine);
            narrow(hit, 2 * (body->height - z) * cosine);
            if (z < 0 || z > body->height) continue;
        }
        if (body->only_inside && quad3_dot(normal, ray->direction) < 0) continue;
        offer(hit, ray, roots[i], normal, quad_root(x * x + y * y));
    }
}

static void hit_round_body(const RoundBody *body, const ReferenceRay *ray, ReferenceHit *hit)
{
    round_body_side(body, ray, hit);
    if (!body->finite || !body->caps) return;
    hit_disc_at(body->from, quad3_scale(body->axis, -1), body->base, ray, hit);
    hit_disc_at(quad3_add(body->from, quad3_scale(body->axis, body->height)), body->axis,
                body->base + body->slope * body->height, ray, hit);
}

static void hit_cylinder(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 axis = quad3(object->as.cylinder.axis);
    RoundBody body = {quad3(object->as.cylinder.from),
                      quad3_unit(axis),
                      object->as.cylinder.radius,
                      0,
                      quad3_length(axis),
                      object->as.cylinder.finite,
                      object->as.cylinder.caps,
                      object->as.cylinder.only_inside};
    hit_round_body(&body, ray, hit);
}

static void hit_cone(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 axis = quad3(object->as.cone.axis);
    Quad height = quad3_length(axis), first = object->as.cone.radius[0], second = object->as.cone.radius[1];
    bool finite = object->as.cone.finite;
    RoundBody body = {quad3(object->as.cone.from),
                      quad3_unit(axis),
                      finite ? first : 0,
                      finite ? (second - first) / height : object->as.cone.slope,
                      height,
                      finite,
                      object->as.cone.caps,
                      object->as.cone.only_inside};
    hit_round_body(&body, ray, hit);
}

static Quad determinant(Quad3 a, Quad3 b, Quad3 c)
{
    return a.x * (b.y * c.z - c.y * b.z) - b.x * (a.y * c.z - c.y * a.z) + c.x * (a.y * b.z - b.y * a.z);
}

// Cramer's rule for  u (b - a) + v (c - a) - t d = o - a.
static void hit_triangle(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad3 corners[3];
    for (int i = 0; i < 3; i++)
        corners[i] = quad3(object->as.triangle.vertices[i]);
    Quad3 first = quad3_subtract(corners[1], corners[0]), second = quad3_subtract(corners[2], corners[0]);
    Quad3 back = quad3_scale(ray->direction, -1), from = quad3_subtract(ray->origin, corners[0]);
    Quad3 normal = quad3_cross(first, second);
    for (int i = 0; i < 3; i++)
        narrow(hit, 2 * line_distance(ray, corners[i], quad3_subtract(corners[(i + 1) % 3], corners[i])));
    Quad whole = determinant(first, second, back);
    if (whole == 0) return;
    Quad u = determinant(from, second, back) / whole;
    Quad v = determinant(first, from, back) / whole;
    Quad t = determinant(first, second, from) / whole;
    if (u < 0 || v < 0 || u + v > 1) return;

    offer(hit, ray, t, normal, NOWHERE);
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

static Quad polynomial_value(const Quad *coefficients, int degree, Quad x)
{
    Quad value = coefficients[degree];
    for (int i = degree - 1; i >= 0; i--)
        value = value * x + coefficients[i];
    return value;
}

// Where a polynomial of degree 1..4 changes its sign between two places, in rising order; returns how often.
// From one such place of its derivative to the next it only rises or only falls, which leaves one zero to
// halve towards.
static int polynomial_zeros(const Quad *coefficients, int degree, Quad low, Quad high, Quad zeros[])
{
    Quad derivative[4], places[5] = {low};
    for (int i = 0; i < degree; i++)
        derivative[i] = (Quad)(i + 1) * coefficients[i + 1];
    int turn_count = degree > 1 ? polynomial_zeros(derivative, degree - 1, low, high, places + 1) : 0;
    places[turn_count + 1] = high;
    int count = 0;
    for (int i = 0; i <= turn_count; i++) {
        Quad before = places[i], after = places[i + 1];
        bool rising = polynomial_value(coefficients, degree, before) < 0;
        if (rising != (polynomial_value(coefficients, degree, after) >= 0)) continue;
        for (int halving = 0; halving < QUAD_BITS; halving++) {
            Quad middle = (before + after) / 2;
            bool too_low = (polynomial_value(coefficients, degree, middle) < 0) == rising;
            *(too_low ? &before : &after) = middle;
        }
        zeros[count++] = before;
    }
    return count;
}

// In the frame of the axis, from the ray's closest approach to the center on: the zeros of
// (|p|^2 + R^2 - r^2)^2 - 4 R^2 (x^2 + y^2), and where it turns. Where r > R some have |p|^2 + R^2 - r^2
// below 0, at r from the circle's far side: they lie within the solid. On the axis itself they coincide with
// others, and the polynomial touches 0 only, which leaves the hit open.
static void hit_torus(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad major = object->as.torus.major, minor = object->as.torus.minor;
    Quad3 axis = quad3_unit(quad3(object->as.torus.axis)), across = quad3_beside(axis);
    Quad3 beside = quad3_cross(axis, across);
    Quad length = quad3_length(ray->direction);
    Quad3 way = quad3_unit(ray->direction);
    Quad3 from = quad3_subtract(ray->origin, quad3(object->as.torus.center));
    Quad closest = -quad3_dot(from, way);
    from = quad3_add(from, quad3_scale(way, closest));
    Quad3 p = {quad3_dot(from, across), quad3_dot(from, beside), quad3_dot(from, axis)};
    Quad3 q = {quad3_dot(way, across), quad3_dot(way, beside), quad3_dot(way, axis)};

    const Quad pp = quad3_dot(p, p), pq = quad3_dot(p, q), four = 4 * major * major;
    const Quad sum[3] = {pp + major * major - minor * minor, 2 * pq, 1}; // |p + s q|^2 + R^2 - r^2
    const Quad quartic[5] = {sum[0] * sum[0] - four * (p.x * p.x + p.y * p.y),
                             2 * sum[0] * sum[1] - 2 * four * (p.x * q.x + p.y * q.y),
                             sum[1] * sum[1] + 2 * sum[0] - four * (q.x * q.x + q.y * q.y), 2 * sum[1], 1};
    const Quad cubic[4] = {quartic[1], 2 * quartic[2], 3 * quartic[3], 4};
    Quad reach = 4 * (major + minor), turns[3], zeros[4];
    int turn_count = polynomial_zeros(cubic, 3, -reach, reach, turns);
    for (int i = 0; i < turn_count; i++) {
        Quad3 at = quad3_add(p, quad3_scale(q, turns[i]));
        Quad off = quad_root(at.x * at.x + at.y * at.y) - major;
        narrow(hit, 2 * (quad_root(off * off + at.z * at.z) - minor));
    }
    int count = polynomial_zeros(quartic, 4, -reach, reach, zeros);
    for (int i = 0; i < count; i++) {
        if (polynomial_value(sum, 2, zeros[i]) < 0) continue;
        Quad3 at = quad3_add(p, quad3_scale(q, zeros[i]));
        Quad rho = quad_root(at.x * at.x + at.y * at.y), out = 1 - major / rho;
        Quad3 normal = quad3_add(quad3_add(quad3_scale(across, at.x * out), quad3_scale(beside, at.y * out)),
                                 quad3_scale(axis, at.z));
        offer(hit, ray, (closest + zeros[i]) / length, normal, quad_minimum(minor, rho));
    }
}

typedef void (*ShapeHit)(const Object *object, const ReferenceRay *ray, ReferenceHit *hit);
static const ShapeHit shape_hits[SHAPE_COUNT] = {
    [SHAPE_SPHERE] = hit_sphere,     [SHAPE_PLANE] = hit_plane,       [SHAPE_DISC] = hit_disc,
    [SHAPE_BOX] = hit_box,           [SHAPE_CYLINDER] = hit_cylinder, [SHAPE_CONE] = hit_cone,
    [SHAPE_TRIANGLE] = hit_triangle, [SHAPE_TORUS] = hit_torus,
};

ReferenceHit reference_hit_object(const Object *object, const ReferenceRay *ray)
{
    ReferenceHit hit = {.object = UINT32_MAX, .margin = NOWHERE};
    shape_hits[object->kind](object, ray, &hit);
    return hit;
}

ReferenceHit reference_hit(const Scene *scene, const ReferenceRay *ray)
{
    ReferenceHit nearest = {.object = UINT32_MAX, .margin = NOWHERE};
    Quad margin = NOWHERE, length = quad3_length(ray->direction);
    for (size_t i = 0; i < scene->objects.count; i++) {
        ReferenceHit hit = reference_hit_object(&scene->objects.items[i], ray);
        margin = quad_minimum(margin, hit.margin);
        if (!hit.found) continue;
        if (nearest.found) margin = quad_minimum(margin, quad_absolute(hit.t - nearest.t) * length);
        if (nearest.found && hit.t >= nearest.t) continue;
        nearest = hit;
        nearest.object = (uint32_t)i;
    }
    nearest.margin = margin;
    return nearest;
}
