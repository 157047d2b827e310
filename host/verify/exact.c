#include "host/verify/exact.h"

#include <float.h>
#include <math.h>

int verify_oracle_bits(void)
{
    return LDBL_MANT_DIG;
}

LongVector long_vector(Vector3 a)
{
    return (LongVector){a.x, a.y, a.z};
}

LongVector long_add(LongVector a, LongVector b)
{
    return (LongVector){a.x + b.x, a.y + b.y, a.z + b.z};
}

LongVector long_subtract(LongVector a, LongVector b)
{
    return (LongVector){a.x - b.x, a.y - b.y, a.z - b.z};
}

LongVector long_scale(LongVector a, Long factor)
{
    return (LongVector){a.x * factor, a.y * factor, a.z * factor};
}

Long long_dot(LongVector a, LongVector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

LongVector long_cross(LongVector a, LongVector b)
{
    return (LongVector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// a b - c d, rounded about once (Jeannerod, Louvet, Muller, "Further analysis of Kahan's algorithm for the
// accurate computation of 2x2 determinants", Mathematics of Computation 82, 2013).
static Long difference_of_products(Long a, Long b, Long c, Long d)
{
    Long product = c * d, rest = fmal(-c, d, product);
    return fmal(a, b, -product) + rest;
}

// The cross product of a far center and a direction: how far the line passes it, without cancellation.
static LongVector long_moment(LongVector a, LongVector b)
{
    return (LongVector){difference_of_products(a.y, b.z, a.z, b.y),
                        difference_of_products(a.z, b.x, a.x, b.z),
                        difference_of_products(a.x, b.y, a.y, b.x)};
}

Long long_length(LongVector a)
{
    return sqrtl(long_dot(a, a));
}

LongVector long_unit(LongVector a)
{
    return long_scale(a, 1 / long_length(a));
}

LongVector exact_from_eye(const VerifyRun *run, Vector3 point, Vector3 eye)
{
    return (LongVector){verify_rounded(run, point.x - eye.x), verify_rounded(run, point.y - eye.y),
                        verify_rounded(run, point.z - eye.z)};
}

LongVector exact_pixel_ray(const Film *picture, size_t pixel)
{
    return long_vector(verify_vector(&picture->ray[3 * pixel]));
}

// From the point of the line that is nearest to the center, at `middle`, and half the chord, in t.
static void exact_chord(ExactHit *exact, Long middle, Long half_chord)
{
    Long near = middle - half_chord, far = middle + half_chord;
    exact->t = near > 0 ? near : far;
    exact->found = exact->margin >= 0 && exact->t > 0;
}

ExactHit exact_sphere(LongVector center, Long radius, LongVector direction)
{
    Long a = long_dot(direction, direction), middle = long_dot(center, direction) / a;
    LongVector moment = long_moment(center, direction);
    LongVector nearest = long_scale(long_cross(moment, direction), 1 / a);
    Long squared = long_dot(moment, moment) / a;
    ExactHit exact = {.margin = 1 - squared / (radius * radius),
                      .distance = (double)long_length(center),
                      .radius = (double)radius,
                      .size = (double)radius};
    if (exact.margin < 0) return exact;
    Long half_chord = radius * sqrtl(exact.margin / a);
    exact_chord(&exact, middle, half_chord);
    Long side = exact.t < middle ? -half_chord : half_chord;
    exact.normal = long_unit(long_add(nearest, long_scale(direction, side)));
    exact.cosine = fabsl(long_dot(exact.normal, direction)) / sqrtl(a);
    return exact;
}

ExactHit exact_plane(LongVector point, LongVector normal, LongVector direction)
{
    Long along = long_dot(normal, direction), height = long_dot(normal, point);
    ExactHit exact = {.margin = INFINITY, .distance = (double)long_length(point), .radius = 1};
    exact.t = along != 0 ? height / along : 0;
    exact.found = exact.t > 0;
    exact.normal = long_unit(normal);
    exact.cosine = fabsl(along) / (long_length(normal) * long_length(direction));
    return exact;
}

ExactHit exact_cylinder(LongVector point, LongVector axis, Long radius, double size, LongVector direction)
{
    LongVector unit = long_unit(axis), across = long_cross(direction, unit), from = long_cross(point, unit);
    Long a = long_dot(across, across);
    Long off = long_dot(unit, long_moment(point, direction));
    ExactHit exact = {.margin = 1 - off * off / (a * radius * radius),
                      .distance = (double)long_length(from),
                      .radius = (double)radius,
                      .size = size};
    if (exact.margin < 0) return exact;
    exact_chord(&exact, long_dot(from, across) / a, radius * sqrtl(exact.margin / a));
    LongVector p = long_subtract(long_scale(direction, exact.t), point);
    exact.normal = long_unit(long_subtract(p, long_scale(unit, long_dot(p, unit))));
    exact.cosine = fabsl(long_dot(exact.normal, direction)) / long_length(direction);
    return exact;
}

// A ray near a torus' circle: s runs along its unit direction from where it is nearest to the center.
typedef struct {
    LongVector nearest, direction;
    Long major;
} CircleLine;

static Long circle_distance(const CircleLine *line, Long s)
{
    LongVector p = long_add(line->nearest, long_scale(line->direction, s));
    Long off = sqrtl(p.x * p.x + p.y * p.y) - line->major;
    return sqrtl(off * off + p.z * p.z);
}

// The least distance between two places, by thirds.
static Long circle_least(const CircleLine *line, Long low, Long high)
{
    for (int i = 0; i < 110; i++) {
        Long a = low + (high - low) / 3, b = high - (high - low) / 3;
        if (circle_distance(line, a) < circle_distance(line, b))
            high = b;
        else
            low = a;
    }
    return (low + high) / 2;
}

// Where the distance falls to `minor` between a place outside and one inside.
static Long circle_crossing(const CircleLine *line, Long outside, Long inside, Long minor)
{
    for (int i = 0; i < 70; i++) {
        Long middle = (outside + inside) / 2;
        if (circle_distance(line, middle) > minor)
            outside = middle;
        else
            inside = middle;
    }
    return (outside + inside) / 2;
}

// Whether the line keeps clear of the tube by a quarter of its radius: from each place as far as it is from
// there nothing can be.
static bool circle_is_clear(const CircleLine *line, double span, double minor)
{
    const LongVector *from = &line->nearest, *along = &line->direction;
    const double x = (double)from->x, y = (double)from->y, z = (double)from->z, major = (double)line->major;
    const double dx = (double)along->x, dy = (double)along->y, dz = (double)along->z;
    for (double s = -span; s < span;) {
        double px = x + s * dx, py = y + s * dy, pz = z + s * dz;
        double off = sqrt(px * px + py * py) - major, clear = sqrt(off * off + pz * pz) - minor;
        if (clear < minor / 4) return false;
        s += clear - minor / 8;
    }
    return true;
}

// The distance to the circle is looked at along the line; it changes no faster than the place, so that what
// is far from the tube at one place is outside it as far around.
ExactHit exact_torus(LongVector center, Long major, Long minor, LongVector direction)
{
    enum { STEPS = 48 };
    Long length = long_length(direction), reach = (major + minor) * 1.25L;
    LongVector unit = long_scale(direction, 1 / length);
    Long middle = long_dot(center, unit);
    LongVector moment = long_moment(center, direction);
    CircleLine line = {long_scale(long_cross(moment, unit), 1 / length), unit, major};
    ExactHit exact = {.margin = -INFINITY,
                      .distance = (double)long_length(center),
                      .radius = (double)minor,
                      .size = (double)(major + minor)};
    Long squared = reach * reach - long_dot(line.nearest, line.nearest);
    if (squared <= 0 || middle <= 0) return exact;
    Long span = sqrtl(squared), step = 2 * span / STEPS, deepest = INFINITY;
    if (circle_is_clear(&line, (double)span, (double)minor)) return exact;
    Long distances[STEPS + 1];
    for (int i = 0; i <= STEPS; i++)
        distances[i] = circle_distance(&line, i * step - span);
    for (int i = 1; i < STEPS; i++) {
        if (distances[i] > distances[i - 1] || distances[i] > distances[i + 1]) continue;
        deepest = fminl(deepest, distances[i]);
        if (distances[i] > minor + step) continue;
        Long before = (i - 1) * step - span, least = circle_least(&line, before, before + 2 * step);
        Long distance = circle_distance(&line, least);
        deepest = fminl(deepest, distance);
        if (distance > minor || exact.found) continue;
        // the line may have come in well before, where no distance was least
        int outside = i - 1;
        while (outside > 0 && distances[outside] <= minor)
            outside--;
        Long s = circle_crossing(&line, outside * step - span, least, minor);
        LongVector p = long_add(line.nearest, long_scale(unit, s));
        Long flat = sqrtl(p.x * p.x + p.y * p.y), inward = 1 - major / flat;
        exact.normal = long_unit((LongVector){p.x * inward, p.y * inward, p.z});
        exact.cosine = fabsl(long_dot(exact.normal, unit));
        exact.t = (middle + s) / length;
        exact.found = true;
    }
    exact.margin = 1 - deepest * deepest / (minor * minor);
    return exact;
}

Long exact_highlight(LongVector normal, LongVector to_light, LongVector ray, double power)
{
    LongVector n = long_unit(normal), l = long_unit(to_light), v = long_unit(ray);
    Long facing = long_dot(n, l);
    if (facing <= 0) return 0;
    LongVector mirrored = long_subtract(long_scale(n, 2 * facing), l), apart = long_add(mirrored, v);
    Long versine = long_dot(apart, apart) / 2;
    if (power == 0) return 1;
    return versine < 1 ? expl(power * log1pl(-versine)) : 0;
}

bool exact_is_open(const VerifyRun *run, const ExactHit *exact)
{
    double ratio = fmax(exact->distance / exact->radius, 1);
    double band = (run->tier == TIER_B ? 4 * ratio : 16) * verify_roundoff(run);
    return run->tier == TIER_A || fabsl(exact->margin) <= band;
}

void exact_judge(VerifyRun *run, const ExactHit *exact, bool found, double t)
{
    if (run->tier == TIER_A) return;
    if (found != exact->found) {
        run->result->wrong += !exact_is_open(run, exact);
        return;
    }
    if (!found) return;
    const double u = verify_roundoff(run), cosine = fmax((double)exact->cosine, 1e-30);
    double ulp = verify_ulp(run, (double)exact->t), bound = 8 * ulp;
    if (run->tier == TIER_B && cosine < 0.1) bound += 16 * u * (exact->distance + exact->size) / cosine;
    if (run->tier != TIER_B) bound = 4 * ulp + 4 * u * exact->size / cosine;
    verify_note_error(run, (double)fabsl(t - exact->t) / ulp, bound / ulp);
}

// A piece of a surface as a point sees it.
typedef struct {
    Long distance;
    LongVector normal; // unit
    Long radius;       // of its curvature
} Sheet;

enum { SHEETS_LARGEST = 6 };
typedef struct {
    Sheet items[SHEETS_LARGEST];
    size_t count;
    double size;
    Long steadiness; // by what part of itself the surface's size turns with its numbers' roundings
} Sheets;

static LongVector rounded(const VerifyRun *run, Vector3 v)
{
    const Vector3 eye = {0, 0, 0};
    return exact_from_eye(run, v, eye);
}

static void sheet_add(Sheets *sheets, Long distance, LongVector normal, Long radius)
{
    sheets->items[sheets->count++] = (Sheet){fabsl(distance), normal, radius};
}

static Long outside(Long value, Long low, Long high)
{
    return value < low ? low - value : value > high ? value - high : 0;
}

static void sphere_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    LongVector from = long_subtract(p, rounded(run, object->as.sphere.center));
    Long radius = verify_rounded(run, object->as.sphere.radius);
    sheet_add(sheets, long_length(from) - radius, long_unit(from), radius);
    sheets->size = (double)radius;
}

static void plane_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    LongVector from = long_subtract(p, rounded(run, object->as.plane.point));
    LongVector normal = long_unit(rounded(run, object->as.plane.normal));
    sheet_add(sheets, long_dot(from, normal), normal, INFINITY);
}

static void disc_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    LongVector from = long_subtract(p, rounded(run, object->as.disc.center));
    LongVector normal = long_unit(rounded(run, object->as.disc.normal));
    Long height = long_dot(from, normal);
    LongVector within = long_subtract(from, long_scale(normal, height));
    sheets->size = verify_rounded(run, object->as.disc.radius);
    Long beyond = outside(long_length(within), 0, sheets->size);
    sheet_add(sheets, hypotl(height, beyond), normal, INFINITY);
}

static void box_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    LongVector low = rounded(run, object->as.box.min), high = rounded(run, object->as.box.max);
    const Long lows[] = {low.x, low.y, low.z}, highs[] = {high.x, high.y, high.z}, at[] = {p.x, p.y, p.z};
    for (size_t axis = 0; axis < 3; axis++) {
        size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
        Long beside = hypotl(outside(at[b], lows[b], highs[b]), outside(at[c], lows[c], highs[c]));
        LongVector normal = {axis == 0, axis == 1, axis == 2};
        sheet_add(sheets, hypotl(at[axis] - lows[axis], beside), normal, INFINITY);
        sheet_add(sheets, hypotl(at[axis] - highs[axis], beside), normal, INFINITY);
    }
    sheets->size = (double)long_length(long_subtract(high, low)) / 2;
}

// In the half-plane through the axis: `along` the axis from the base, `off` it.
static void revolution_sheets(Sheets *sheets, LongVector base, LongVector axis, const Long radii[2],
                              bool finite, bool caps, LongVector p)
{
    Long height = long_length(axis);
    LongVector unit = long_scale(axis, 1 / height), from = long_subtract(p, base);
    Long along = long_dot(from, unit);
    LongVector across = long_subtract(from, long_scale(unit, along));
    Long off = long_length(across);
    LongVector radial = off > 0 ? long_scale(across, 1 / off) : unit;
    Long slope = finite ? (radii[1] - radii[0]) / height : 0, lean = sqrtl(1 + slope * slope);
    // along the side, and away from it
    Long run_along = (along + slope * (off - radii[0])) / lean;
    Long away = (off - radii[0] - slope * along) / lean;
    Long beyond = finite ? outside(run_along, 0, height * lean) : 0;
    LongVector normal = long_scale(long_subtract(radial, long_scale(unit, slope)), 1 / lean);
    sheet_add(sheets, hypotl(away, beyond), normal, fmaxl(off, 1e-30L) * lean);
    for (size_t end = 0; end < 2 && finite && caps; end++)
        sheet_add(sheets, hypotl(along - (Long)end * height, outside(off, 0, radii[end])), unit, INFINITY);
    Long largest = fmaxl(radii[0], radii[1]);
    sheets->size = (double)(finite ? hypotl(largest, height / 2) : largest);
}

static void cylinder_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    LongVector base = rounded(run, object->as.cylinder.from), axis = rounded(run, object->as.cylinder.axis);
    Long radius = verify_rounded(run, object->as.cylinder.radius);
    if (object->as.cylinder.finite)
        axis =
            long_subtract(rounded(run, vector_add(object->as.cylinder.from, object->as.cylinder.axis)), base);
    revolution_sheets(sheets, base, axis, (Long[]){radius, radius}, object->as.cylinder.finite,
                      object->as.cylinder.caps, p);
}

static void cone_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    LongVector base = rounded(run, object->as.cone.from);
    LongVector tip = rounded(run, vector_add(object->as.cone.from, object->as.cone.axis));
    const Long radii[] = {verify_rounded(run, object->as.cone.radius[0]),
                          verify_rounded(run, object->as.cone.radius[1])};
    revolution_sheets(sheets, base, long_subtract(tip, base), radii, true, object->as.cone.caps, p);
}

static void torus_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    Long major = verify_rounded(run, object->as.torus.major);
    Long minor = verify_rounded(run, object->as.torus.minor);
    LongVector from = long_subtract(p, rounded(run, object->as.torus.center));
    LongVector axis = rounded(run, vector_normalize(object->as.torus.axis));
    LongVector across = long_subtract(from, long_scale(axis, long_dot(from, axis)));
    LongVector circle = long_subtract(from, long_scale(long_unit(across), major));
    sheet_add(sheets, long_length(circle) - minor, long_unit(circle), minor);
    sheets->size = (double)(major + minor);
}

static void triangle_sheets(Sheets *sheets, const VerifyRun *run, const Object *object, LongVector p)
{
    LongVector a = rounded(run, object->as.triangle.vertices[0]);
    LongVector ab = long_subtract(rounded(run, object->as.triangle.vertices[1]), a);
    LongVector ac = long_subtract(rounded(run, object->as.triangle.vertices[2]), a);
    LongVector normal = long_cross(ab, ac), bc = long_subtract(ac, ab);
    Long longest = fmaxl(long_length(ab), fmaxl(long_length(ac), long_length(bc)));
    sheets->steadiness = longest * longest / long_length(normal);
    sheet_add(sheets, long_dot(long_subtract(p, a), long_unit(normal)), long_unit(normal), INFINITY);
    sheets->size = (double)longest;
}

static Sheets surface_sheets(const VerifyRun *run, const Object *object, LongVector p)
{
    Sheets sheets = {.steadiness = 1};
    switch (object->kind) {
    case SHAPE_SPHERE:
        sphere_sheets(&sheets, run, object, p);
        break;
    case SHAPE_PLANE:
        plane_sheets(&sheets, run, object, p);
        break;
    case SHAPE_DISC:
        disc_sheets(&sheets, run, object, p);
        break;
    case SHAPE_BOX:
        box_sheets(&sheets, run, object, p);
        break;
    case SHAPE_CYLINDER:
        cylinder_sheets(&sheets, run, object, p);
        break;
    case SHAPE_CONE:
        cone_sheets(&sheets, run, object, p);
        break;
    case SHAPE_TRIANGLE:
        triangle_sheets(&sheets, run, object, p);
        break;
    case SHAPE_TORUS:
        torus_sheets(&sheets, run, object, p);
        break;
    case SHAPE_PARABOLOID:
    case SHAPE_MESH: // the oracle is asked of single shapes
    case SHAPE_COUNT:
        break;
    }
    return sheets;
}

static Long sheets_distance(const Sheets *sheets)
{
    Long distance = INFINITY;
    for (size_t i = 0; i < sheets->count; i++)
        distance = fminl(distance, sheets->items[i].distance);
    return distance;
}

Long exact_surface_distance(const VerifyRun *run, const Object *object, LongVector point)
{
    Sheets sheets = surface_sheets(run, object, point);
    return sheets_distance(&sheets);
}

// How far a hit's point may be off the surface.
static double surface_bound(const VerifyRun *run, const TraceRay *ray, double t, double length, double size)
{
    const double u = verify_roundoff(run), *o = ray->origin;
    double start = fmax(fabs(o[0]), fmax(fabs(o[1]), fabs(o[2])));
    if (run->tier == TIER_B) return 16 * u * (start + t * length + size);
    return 2 * verify_ulp(run, t) * length + 8 * u * size;
}

void exact_judge_surface(VerifyRun *run, const Object *object, const TraceRay *ray, const TraceHit *hit)
{
    if (run->tier == TIER_A || !verify_is_hit(hit)) return;
    LongVector direction = long_vector(verify_vector(ray->direction));
    LongVector origin = long_vector(verify_vector(ray->origin));
    Sheets sheets = surface_sheets(run, object, long_add(origin, long_scale(direction, hit->t)));
    double length = (double)long_length(direction);
    double bound = surface_bound(run, ray, hit->t, length, sheets.size);
    Long distance = sheets_distance(&sheets);
    run->result->off += !(distance <= bound);
    run->result->surface_part = fmax(run->result->surface_part, (double)distance / bound);

    // at an edge any of the sheets that meet there may be told
    LongVector normal = long_vector(verify_vector(hit->normal));
    double least_part = INFINITY;
    for (size_t i = 0; i < sheets.count; i++) {
        const Sheet *sheet = &sheets.items[i];
        if (sheet->distance > distance + bound) continue;
        Long turned = long_length(long_cross(normal, sheet->normal));
        Long owed = 8 * verify_roundoff(run) * sheets.steadiness + bound / sheet->radius;
        least_part = fmin(least_part, (double)(turned / owed));
    }
    run->result->turned += !(least_part <= 1);
    run->result->normal_part = fmax(run->result->normal_part, least_part);
}
