#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

// A superellipsoid: the exponent n, the rows that lead to the space where it is |x|^n + |y|^n + |z|^n = 1,
// and the root of the sum of their squares.
typedef struct {
    Quad3 rows[3];
    Quad norm;
    int exponent;
} UnitSpace;

static UnitSpace unit_space(const Object *object)
{
    const Vector3 *axes = object->as.superellipsoid.axes;
    UnitSpace space = {.exponent = (int)object->as.superellipsoid.exponent};
    Quad squares = 0;
    for (int i = 0; i < 3; i++) {
        const Quad3 across =
            quad3_triangle_normal((Quad3){0, 0, 0}, quad3(axes[(i + 1) % 3]), quad3(axes[(i + 2) % 3]));
        space.rows[i] = quad3_scale(across, 1 / quad3_dot(across, quad3(axes[i])));
        squares += quad3_dot(space.rows[i], space.rows[i]);
    }
    space.norm = quad_root(squares);
    return space;
}

static Quad power_of(Quad base, int exponent)
{
    Quad power = 1;
    for (int i = 0; i < exponent; i++)
        power *= base;
    return power;
}

static Quad3 powers_of(Quad3 q, int exponent)
{
    return (Quad3){power_of(q.x, exponent), power_of(q.y, exponent), power_of(q.z, exponent)};
}

// A point's gauge, by which the shape must be scaled to contain it; how far the surface there moves for each
// unit of the gauge; and the outward normal and the radius of curvature of the scaled shape.
typedef struct {
    Quad gauge, reach, curvature_radius;
    Quad3 normal;
} Gauge;

static Gauge gauge_at(const UnitSpace *space, Quad3 q)
{
    const int n = space->exponent;
    Gauge at = {.gauge = QUAD_CALL(pow)(quad3_dot(powers_of(q, n - 1), q), 1 / (Quad)n), .reach = UNBOUNDED};
    if (!(at.gauge > 0x1p-100)) return at; // the center
    q = quad3_scale(q, 1 / at.gauge);
    const Quad3 gradient = axes_vector(space->rows, powers_of(q, n - 1)), even = powers_of(q, n - 2);
    const Quad length = quad3_length(gradient), evens[3] = {even.x, even.y, even.z};
    at.normal = quad3_scale(gradient, 1 / length);
    at.reach = 1 / length;
    Quad bend = space->norm * 0x1p-10L; // the radius is a magnitude, so it stays in proportion to the shape
    for (int i = 0; i < 3; i++) {
        const Quad3 row = space->rows[i];
        const Quad3 across = quad3_subtract(row, quad3_scale(at.normal, quad3_dot(row, at.normal)));
        bend += (n - 1) * evens[i] * quad3_length(row) * quad3_length(across) / length;
    }
    at.curvature_radius = at.gauge / bend;
    return at;
}

// A line q = from + t towards in the unit space.
typedef struct {
    const UnitSpace *space;
    Quad3 from, towards;
} UnitLine;

static Quad3 line_point(const UnitLine *line, Quad t)
{
    return quad3_add(line->from, quad3_scale(line->towards, t));
}

static Quad excess_at(const UnitLine *line, Quad t)
{
    const Quad3 q = line_point(line, t);
    return quad3_dot(powers_of(q, line->space->exponent - 1), q) - 1;
}

static Quad slope_at(const UnitLine *line, Quad t)
{
    return quad3_dot(powers_of(line_point(line, t), line->space->exponent - 1), line->towards);
}

// Returns where a function that is negative at one end and not at the other changes its sign, by bisection.
static Quad sign_change(Quad (*value_at)(const UnitLine *, Quad), const UnitLine *line, Quad negative,
                        Quad positive)
{
    for (int i = 0; i < 2 * QUAD_BITS; i++) {
        const Quad middle = (negative + positive) / 2;
        if (middle == negative || middle == positive) break;
        *(value_at(line, middle) < 0 ? &negative : &positive) = middle;
    }
    return positive;
}

// Returns the interval of t in a cube around the center, empty if low > high, and sets *first and *last to
// where the first and the last coordinate changes its sign.
static void cube_interval(const UnitLine *line, Quad half, Quad interval[2], Quad *first, Quad *last)
{
    const Quad from[3] = {line->from.x, line->from.y, line->from.z},
               towards[3] = {line->towards.x, line->towards.y, line->towards.z};
    interval[0] = *last = -UNBOUNDED;
    interval[1] = *first = UNBOUNDED;
    for (int i = 0; i < 3; i++) {
        if (towards[i] == 0) {
            if (quad_absolute(from[i]) > half) interval[1] = -UNBOUNDED;
            continue;
        }
        const Quad middle = -from[i] / towards[i], reach = half / quad_absolute(towards[i]);
        interval[0] = quad_maximum(interval[0], middle - reach);
        interval[1] = quad_minimum(interval[1], middle + reach);
        *first = quad_minimum(*first, middle);
        *last = quad_maximum(*last, middle);
    }
}

// The sum of powers is convex along the line. Its derivative changes its sign between the first and the last
// place where a coordinate does.
static void hit_superellipsoid(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    const UnitSpace space = unit_space(object);
    const Quad3 from = quad3_subtract(ray->origin, quad3(object->as.superellipsoid.center));
    const UnitLine line = {&space, axes_coordinates(space.rows, from),
                           axes_coordinates(space.rows, ray->direction)};
    const Quad outside = 1.0625;
    Quad interval[2], first, last;
    cube_interval(&line, outside, interval, &first, &last);
    if (interval[0] > interval[1]) { // clearly missed
        hit_reduce_margin(hit, (outside - 1) / space.norm);
        return;
    }
    const Quad turn = first < last ? sign_change(slope_at, &line, first, last) : first;
    const Gauge closest = gauge_at(&space, line_point(&line, turn));
    if (closest.reach < UNBOUNDED) hit_reduce_margin(hit, 2 * (closest.gauge - 1) * closest.reach);
    if (!(excess_at(&line, turn) < 0)) return;
    for (int i = 0; i < 2; i++) {
        const Quad t = sign_change(excess_at, &line, turn, interval[i]);
        const Gauge at = gauge_at(&space, line_point(&line, t));
        hit_keep_nearest(hit, ray, t, at.normal, at.curvature_radius);
    }
}

// Measures the surface to first order, which suffices for points nearer to it than its radius of curvature.
static void surface_superellipsoid(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    const UnitSpace space = unit_space(object);
    const Vector3 center = object->as.superellipsoid.center, *axes = object->as.superellipsoid.axes;
    const Gauge at = gauge_at(&space, axes_coordinates(space.rows, quad3_subtract(point, quad3(center))));
    double squares = 0;
    for (int i = 0; i < 3; i++)
        squares += vector_dot(axes[i], axes[i]);
    surface_measure(surface, center, sqrt(squares), 1 / (double)space.norm);
    surface->normal_condition = 3;
    surface_add(surface, (at.gauge - 1) * at.reach, at.normal, at.curvature_radius);
}

const ReferenceShape reference_superellipsoid = {hit_superellipsoid, surface_superellipsoid, 13};

enum { SUPERELLIPSOID_ALIGNED, SUPERELLIPSOID_TURNED };

// Makes a random superellipsoid that is up to ten times as long as thick.
static void superellipsoid_randomize(RandomShape *made, unsigned form, Random *random)
{
    const double exponent = 2 + 2 * (double)(random_bits(random) % 8), size = made->radius;
    Vector3 along = vector_normalize(made->axis);
    if (form == SUPERELLIPSOID_ALIGNED) along = made->axis = random_world_axis(random);
    const Vector3 across = vector_normalize(vector_cross(along, vector_least_aligned_axis(along)));
    const Vector3 axes[3] = {along, across, vector_cross(along, across)};
    double largest = 0;
    for (int i = 0; i < 3; i++) {
        const double radius = size * random_between(random, 0.1, 1);
        made->object.as.superellipsoid.axes[i] = vector_scale(axes[i], radius);
        largest = fmax(largest, radius);
    }
    made->object.as.superellipsoid.center = made->center;
    made->object.as.superellipsoid.exponent = exponent;
    made->radius = largest * pow(3, 0.5 - 1 / exponent);
}

const RandomForms superellipsoid_forms = {{"superellipsoid", "turned superellipsoid"},
                                          superellipsoid_randomize};
