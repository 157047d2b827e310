#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

#include <math.h>

static Quad polynomial_value(const Quad *coefficients, int degree, Quad x)
{
    Quad value = coefficients[degree];
    for (int i = degree - 1; i >= 0; i--)
        value = value * x + coefficients[i];
    return value;
}

// Returns the zero in an interval on which the polynomial is monotonic, by Newton's method, and by bisection
// where that leaves the bracket.
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

// Finds where a polynomial of degree 1..4 changes its sign in an interval, ascending, and returns how often.
// It is monotonic between two such places of its derivative.
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

// Returns whether the ray's line certainly stays an eighth of the tube's radius away from a torus. It steps
// by the distance of the tube, in double, for rays from not too far.
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

// Finds the zeros of (|p|^2 + R^2 - r^2)^2 - 4 R^2 (x^2 + y^2), and where it turns, in the frame of the axis
// from the ray's closest approach to the center on. If r > R, some zeros have |p|^2 + R^2 - r^2 below 0, at
// r from the circle's far side, and lie within the solid. On the axis itself they coincide with others, and
// the polynomial only touches 0, which leaves the hit uncertain.
static void hit_torus(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Quad major = object->as.torus.major, minor = object->as.torus.minor;
    if (torus_is_clear(object, ray)) {
        hit_reduce_margin(hit, minor / 4);
        return;
    }
    Quad3 axes[3];
    axes_around(quad3_unit(quad3(object->as.torus.axis)), axes);
    Quad length = quad3_length(ray->direction);
    Quad3 direction = quad3_scale(ray->direction, 1 / length);
    Quad3 from = quad3_subtract(ray->origin, quad3(object->as.torus.center));
    Quad closest = -quad3_dot(from, direction);
    from = quad3_add(from, quad3_scale(direction, closest));
    Quad3 p = axes_coordinates(axes, from), q = axes_coordinates(axes, direction);

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
        Quad3 normal = axes_vector(axes, (Quad3){at.x * out, at.y * out, at.z});
        hit_keep_nearest(hit, ray, (closest + zeros[i]) / length, normal, quad_minimum(minor, rho));
    }
    // the hit is there because of the turns up to the next behind it
    int turn_count = polynomial_zeros(cubic, 3, -half_span, half_span, turns);
    bool behind = false;
    for (int i = 0; i < turn_count && !behind; i++) {
        Quad3 at = quad3_add(p, quad3_scale(q, turns[i]));
        Quad off = quad_root(at.x * at.x + at.y * at.y) - major;
        hit_reduce_margin(hit, 2 * (quad_hypotenuse(off, at.z) - minor));
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

const ReferenceShape reference_torus = {hit_torus, surface_torus, 8};

enum { TORUS, TORUS_THIN, TORUS_FAT, TORUS_SPINDLE };

// Makes a random torus, aligned with a world axis in half of the cases. The tube of a spindle torus is wider
// than its circle, so it has no hole.
static void torus_randomize(RandomShape *made, unsigned form, Random *random)
{
    const double major = made->radius;
    double minor = major * random_between(random, 0.1, 0.6);
    if (form == TORUS_THIN) minor = major * 0.01;
    if (form == TORUS_FAT) minor = major * 0.9;
    if (form == TORUS_SPINDLE) minor = major * random_between(random, 1.1, 3);
    made->axis = random_coin(random) ? random_world_axis(random) : vector_on_grid(random_unit_vector(random));
    made->object.as.torus.center = made->center;
    made->object.as.torus.axis = made->axis;
    made->object.as.torus.major = major;
    made->object.as.torus.minor = minor;
    made->radius = major + minor;
}

const RandomForms torus_forms = {{"torus", "thin torus", "fat torus", "spindle torus"}, torus_randomize};
