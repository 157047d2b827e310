#include "host/verify/checks.h"

#include <math.h>
#include <string.h>

// The factors of u and ulp below are those of docs/verify.md, tiers B to D.

static Object object_at_work(const VerifyRun *run, const Object *object)
{
    return verify_is_double(run) ? *object : reference_round_object(object);
}

static VerifyTarget target_from(const Object *object, Vector3 origin)
{
    ReferenceSurface surface = reference_surface(object, quad3(origin));
    double distance = vector_length(vector_subtract(surface.center, origin));
    return (VerifyTarget){*object, distance, surface.bounding_radius, surface.feature_radius};
}

VerifyTarget verify_target(const VerifyRun *run, const Object *object, Vector3 eye)
{
    const Vector3 origin = {0, 0, 0};
    Object seen = reference_object_from(object, eye);
    seen = object_at_work(run, &seen);
    return target_from(&seen, origin);
}

Object *verify_objects(VerifyRun *run, const Scene *scene)
{
    Object *objects = verify_allocate(run, scene->objects.count, sizeof *objects);
    for (size_t i = 0; i < scene->objects.count; i++)
        objects[i] = object_at_work(run, &scene->objects.items[i]);
    return objects;
}

// Returns whether the tier permits both a hit and a miss of the target.
static bool is_open(const VerifyRun *run, const VerifyTarget *target, const ReferenceHit *exact)
{
    const double u = verify_roundoff(run);
    if (run->tier == TIER_A) return true;
    if (target->object.type == SHAPE_TRIANGLE)
        return exact->margin <= TRIANGLE_BAND * u * (target->distance + target->bounding_radius);
    if (run->tier == TIER_B) return exact->margin <= 4 * u * fmax(target->distance, target->feature_radius);
    return exact->margin <= 16 * u * target->feature_radius;
}

// Returns the permitted error of t, in units of t.
static double bound_of(const VerifyRun *run, const VerifyTarget *target, const ReferenceHit *exact,
                       double length, const VerifyLimits *limits)
{
    const double u = verify_roundoff(run), ulp = verify_ulp(run, (double)exact->t);
    if (limits && limits->within[run->tier] > 0) return limits->within[run->tier];
    if (limits && limits->ulps[run->tier] != 0) return fmax(limits->ulps[run->tier], 0) * ulp;
    if (run->tier == TIER_A) return INFINITY;
    double cosine = fmax((double)exact->cosine, 1e-30), slope = 1 / (cosine * length);
    if (run->tier == TIER_B)
        return 8 * ulp + (cosine < 0.1 ? 16 * u * (target->distance + target->bounding_radius) * slope : 0);
    return 4 * ulp +
           4 * u * (target->bounding_radius > 0 ? target->bounding_radius : target->distance) * slope;
}

static void check_distance(VerifyRun *run, const ReferenceHit *exact, double t, double bound)
{
    const double exact_t = (double)exact->t;
    verify_record_ulps(run, (double)quad_absolute(t - exact->t), exact_t, bound / verify_ulp(run, exact_t));
}

ReferenceHit verify_pixel_hit(const VerifyTarget *target, const Film *image, size_t pixel)
{
    const Vector3 eye = {0, 0, 0};
    ReferenceRay ray = reference_ray(eye, vector_from(&image->ray[3 * pixel]));
    return reference_hit_object(&target->object, &ray);
}

ReferenceHit verify_check_pixel(VerifyRun *run, const VerifyTarget *target, const Film *image, size_t pixel)
{
    ReferenceHit exact = verify_pixel_hit(target, image, pixel);
    if (verify_pixel_found(image, pixel) != exact.found) {
        run->result->wrong += !is_open(run, target, &exact);
    } else if (exact.found) {
        double length = vector_length(vector_from(&image->ray[3 * pixel]));
        check_distance(run, &exact, image->t[pixel], bound_of(run, target, &exact, length, NULL));
    }
    return exact;
}

ReferenceRay verify_reference_ray(const TraceRay *ray)
{
    ReferenceRay exact = reference_ray(ray->origin, ray->direction);
    exact.tmin = ray->tmin;
    return exact;
}

bool verify_is_exact(const VerifyRun *run, const VerifyTestRay *test)
{
    return test->required.exact_tiers && strchr(test->required.exact_tiers, 'A' + (int)run->tier);
}

VerifyExpected verify_expected(const VerifyRun *run, const Object *object, const VerifyTestRay *test,
                               ReferenceHit exact)
{
    const VerifyRay *required = &test->required;
    VerifyTarget target = target_from(object, test->ray.origin);
    VerifyExpected expected = {exact, is_open(run, &target, &exact), 0};
    if (!exact.found && required->tangent_t != 0) {
        expected.exact.found = true;
        expected.exact.t = required->tangent_t;
    }
    double length = vector_length(test->ray.direction);
    if (expected.exact.found)
        expected.bound = bound_of(run, &target, &expected.exact, length, required->limits);
    return expected;
}

void verify_check_ray(VerifyRun *run, const Object *objects, size_t count, const VerifyTestRay *test,
                      const TraceHit *hit)
{
    ReferenceRay ray = verify_reference_ray(&test->ray);
    const bool is_exact = verify_is_exact(run, test);
    bool found = false, certain = false, wrong = false;
    for (size_t i = 0; i < count; i++) {
        ReferenceHit exact = reference_hit_object(&objects[i], &ray);
        bool reported = i == hit->object;
        if (!exact.found && test->required.tangent_t == 0 && !reported) continue;
        VerifyExpected expected = verify_expected(run, &objects[i], test, exact);
        found |= expected.exact.found;
        certain |= expected.exact.found && !expected.open;
        if (reported && expected.exact.found)
            check_distance(run, &expected.exact, hit->t, expected.bound);
        else if (reported)
            wrong |= !expected.open;
        else if (verify_is_hit(hit) && !expected.open) // this one may be nearer
            wrong |= expected.exact.t < hit->t - expected.bound;
    }
    if (verify_is_hit(hit))
        wrong |= is_exact && !found;
    else
        wrong |= certain || (is_exact && found);
    run->result->wrong += wrong;
}

// Returns the permitted distance of a hit point from the surface.
static double surface_bound(const VerifyRun *run, const TraceRay *ray, double t, double length,
                            double bounding_radius)
{
    const double u = verify_roundoff(run), start = vector_largest(ray->origin);
    if (run->tier == TIER_B) return 16 * u * (start + t * length + bounding_radius);
    return 2 * verify_ulp(run, t) * length + 8 * u * bounding_radius;
}

// Returns the angle between two nearly parallel vectors. The second is a unit vector.
static double normal_angle(Quad3 normal, Quad3 exact)
{
    Vector3 unit = quad3_rounded(exact);
    bool opposite = vector_dot(quad3_rounded(normal), unit) < 0;
    Vector3 change = quad3_rounded((opposite ? quad3_add : quad3_subtract)(normal, exact));
    return vector_length(vector_cross(change, unit));
}

void verify_check_surface(VerifyRun *run, const Object *object, const TraceRay *ray, const TraceHit *hit)
{
    if (run->tier == TIER_A || !verify_is_hit(hit)) return;
    const ReferenceRay exact = verify_reference_ray(ray);
    const ReferenceSurface surface = reference_surface(object, reference_point(&exact, hit->t));
    Quad distance = reference_surface_distance(&surface);
    double bound = surface_bound(run, ray, hit->t, vector_length(ray->direction), surface.bounding_radius);
    run->result->off_surface += !(distance <= bound);
    run->result->worst_position_ratio = fmax(run->result->worst_position_ratio, (double)distance / bound);

    // at an edge the normal may be that of any adjacent sheet
    Quad3 normal = quad3(hit->normal);
    double least_part = INFINITY;
    for (int i = 0; i < surface.count; i++) {
        const ReferenceSheet *sheet = &surface.sheets[i];
        if (sheet->distance > distance + bound) continue;
        double angle = normal_angle(normal, sheet->normal);
        double tolerance =
            8 * verify_roundoff(run) * surface.normal_condition + bound / (double)sheet->curvature_radius;
        least_part = fmin(least_part, angle / tolerance);
    }
    run->result->wrong_normals += !(least_part <= 1);
    run->result->worst_normal_ratio = fmax(run->result->worst_normal_ratio, least_part);
}
