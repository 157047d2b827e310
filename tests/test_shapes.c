// Compares every shape at every precision with the reference: hit or miss, distance and normal.
// run_tests: sanitize-long-only
#include "host/base/ulp.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/random_ray.h"
#include "tests/reference.h"
#include "tests/scene_reading.h"

enum { RAYS_PER_SHAPE = 2000, SHAPES_IN_SCENE = 40, SHAPES_NEXT_TO_SIDE = 3, SEEDS_NEXT_TO_SIDE = 80 };

static ShapeForm forms[SHAPE_FORMS_MAX];
static size_t form_count;

typedef struct {
    Vector3 center;
    double radius;
    TraceRay rays[RAYS_PER_SHAPE];
    ReferenceHit hits[RAYS_PER_SHAPE];
} Trial;

// The bounds of a precision, with u its unit roundoff, S the distance from the ray's origin to the far side
// of the object. Two roundings come beyond it (docs/numerics.md derives both):
// - The plane of an axis' end, at compensated forms: 2 u size.
// - The side of a cone near its apex, where the eye's power defines the cone: cone_moved_by_power.
typedef struct {
    double ulps;  // of t
    double slack; // of t, over the cosine; in u S, or in u size where the forms are compensated
    double band;  // of a margin within which hit or miss is open; in the same; a triangle's is TRIANGLE_BAND
    double turn;  // of the normal, in u S over cosine and radius of curvature
    bool compensated;
} Tolerance;

// Those of each precision are its tier of docs/verify.md, except that
// - the slack of `single` is allowed at every angle, since near a surface no bound can be an ulp of a small t
//   after a subtraction of larger numbers, and
// - its band is 5 u instead of 4 u, since one in two million of its rays needs 4.04 u.
static const Tolerance tolerances[ARITHMETIC_COUNT] = {
    [PRECISION_SINGLE] = {8, 16, 5, 16, false},
    [PRECISION_STRICT] = {4, 4, 16, 16, true},
    [PRECISION_DOUBLE] = {4, 4, 16, 16, true},
};

typedef struct {
    size_t compared, wrong;
    double t, normal, length; // the largest errors as parts of their bounds
} Tally;

static int bits_of(Precision precision)
{
    return precision == PRECISION_DOUBLE ? 53 : 24;
}

// Returns how far a cone's side moves at a point where its radius is r when the numbers that define it in
// addition to the eye's power C are rounded once: C, the axis' point F nearest to the eye, which is the
// origin, and the radius there.
static double cone_moved_by_power(const Object *cone, Vector3 point, double r, double u)
{
    const double *radii = cone->as.cone.radius, length = vector_length(cone->as.cone.axis);
    const bool finite = cone->as.cone.finite;
    const Vector3 axis = vector_scale(cone->as.cone.axis, 1 / length);
    const double slope = finite ? (radii[1] - radii[0]) / length : cone->as.cone.slope;
    const double base_height = vector_dot(cone->as.cone.from, axis), height = vector_dot(point, axis);
    const double foot_radius = (finite ? radii[0] : 0) - slope * base_height;
    const double foot = vector_length(vector_subtract(cone->as.cone.from, vector_scale(axis, base_height)));
    const double off = vector_length(vector_subtract(point, vector_scale(axis, height)));
    const double power = foot * foot - foot_radius * foot_radius;
    return u * (fabs(power) + 2 * off * foot + 2 * fabs(slope * height * foot_radius)) /
           (2 * r * hypot(1, slope));
}

// Returns how far a surface may move beyond the slack (Tolerance).
static double moved_beyond(const Object *object, const ReferenceHit *hit, Vector3 point, bool has_eye_powers,
                           bool compensated, double u, double size)
{
    if (object->type != SHAPE_CYLINDER && object->type != SHAPE_CONE) return 0;
    if (hit->curvature_radius == LDBL_MAX) return compensated ? 2 * u * size : 0;
    if (!has_eye_powers || object->type != SHAPE_CONE) return 0;
    return cone_moved_by_power(object, point, (double)hit->curvature_radius, u);
}

static bool is_triangle(const Scene *scene, uint32_t object)
{
    return object != UINT32_MAX && scene->objects.items[object].type == SHAPE_TRIANGLE;
}

static void compare(const Trial *trial, size_t index, const TraceHit *hit, const Scene *scene,
                    bool has_eye_powers, Precision precision, Tally *tally)
{
    const ReferenceHit *expected = &trial->hits[index];
    const TraceRay *ray = &trial->rays[index];
    const Tolerance *tolerance = &tolerances[precision];
    const int bits = bits_of(precision);
    const double u = ldexp(1, -bits);
    Vector3 origin = ray->origin, direction = ray->direction;
    double distance = vector_length(vector_subtract(origin, trial->center)) + trial->radius;
    // A plane may be hit far beyond the radius.
    if (expected->found) distance = fmax(distance, fabs((double)expected->t) * vector_length(direction));
    double scale = u * (tolerance->compensated ? trial->radius : distance);
    // Flat shapes have no compensated edges.
    double band = fmax(tolerance->band * scale, 4 * u * distance);
    if (is_triangle(scene, expected->object) || is_triangle(scene, hit->object))
        band = TRIANGLE_BAND * u * distance;
    if (expected->margin <= band) return;

    tally->compared++;
    if (hit->object != expected->object) {
        tally->wrong++;
        return;
    }
    if (!expected->found) return;

    double cosine = (double)expected->cosine;
    double t_bound = tolerance->ulps * ulp_of((double)expected->t, bits);
    const Vector3 point = vector_add(origin, vector_scale(direction, (double)expected->t));
    const double moved =
        tolerance->slack * scale + moved_beyond(&scene->objects.items[hit->object], expected, point,
                                                has_eye_powers, tolerance->compensated, u, trial->radius);
    t_bound += moved / (cosine * vector_length(direction));
    tally->t = error_max(tally->t, fabs((double)(hit->t - expected->t)) / t_bound);

    Vector3 normal = hit->normal;
    double normal_bound =
        8 * u + tolerance->turn * u * distance / (cosine * (double)expected->curvature_radius);
    tally->normal = error_max(tally->normal, reference_distance(normal, expected->normal) / normal_bound);
    tally->length = error_max(tally->length, fabs(vector_length(normal) - 1) / (4 * u));
    if (!(vector_dot(normal, direction) <= 0)) tally->wrong++;
}

// Returns a ray in any direction from next to where the given one hits the scene, off it to either side by a
// hundredth to a hundred thousandth of the radius.
static RandomRay move_next_to_surface(const RandomRay *given, const Scene *scene, double radius,
                                      Random *random)
{
    ReferenceRay ray = reference_ray(given->origin, given->direction);
    ReferenceHit hit = reference_hit(scene, &ray);
    if (!hit.found) return *given;
    Quad3 p = reference_point(&ray, hit.t);
    double side = random_between(random, -1, 1) < 0 ? -1 : 1;
    double height = side * radius * pow(10, random_between(random, -5, -2));
    Vector3 normal = quad3_rounded(hit.normal), place = quad3_rounded(p);
    return (RandomRay){vector_add(place, vector_scale(normal, height)), random_in_sphere(random)};
}

// Prepares rays and what they should hit. With `is_double` the rays are used in double, else rounded to
// float. With `next_to_surface` they start next to the surface.
static void prepare(Trial *trial, const Scene *scene, const RandomShape *aims, size_t aim_count,
                    bool is_double, bool next_to_surface, Random *random)
{
    for (size_t i = 0; !is_double && i < scene->objects.count; i++)
        scene->objects.items[i] = reference_round_object(&scene->objects.items[i]);
    for (size_t i = 0; i < RAYS_PER_SHAPE; i++) {
        RandomRay given = random_ray(&aims[aim_count > 0 ? i % aim_count : 0], random);
        if (next_to_surface) given = move_next_to_surface(&given, scene, trial->radius, random);
        ReferenceRay ray = is_double ? reference_ray(given.origin, given.direction)
                                     : reference_ray_rounded(given.origin, given.direction);
        // one in three also looks behind its start
        if (i % 3 == 2) ray.tmin = -0x1p10;
        trial->rays[i] = (TraceRay){
            quad3_rounded(ray.origin),
            quad3_rounded(ray.direction),
            (double)ray.tmin,
            (double)ray.tmax,
        };
        trial->hits[i] = reference_hit(scene, &ray);
    }
}

static bool scene_has_eye_powers(const Scene *scene, Precision precision)
{
    const CompileSettings settings = {.width = 1, .height = 1, .sample_count = 1, .precision = precision};
    OwnedCompiledScene compiled = scene_compiled(scene, &settings);
    const bool has = (compiled.features & FEATURE_EYE_POWERS) != 0;
    return has;
}

static void check_at(const Trial *trial, const Scene *scene, Precision precision, uint32_t lanes,
                     const char *what)
{
    static TraceHit hits[RAYS_PER_SHAPE];
    if (!probe_has(precision)) return;
    assert_true(probe_trace(scene, precision, lanes, trial->rays, RAYS_PER_SHAPE, hits));
    const bool has_eye_powers = scene_has_eye_powers(scene, precision);
    Tally tally = {0};
    for (size_t i = 0; i < RAYS_PER_SHAPE; i++)
        compare(trial, i, &hits[i], scene, has_eye_powers, precision, &tally);
    bool right = tally.wrong == 0 && tally.t <= 1 && tally.normal <= 1 && tally.length <= 1;
    if (!right)
        print_message("%s, %s, lanes %u: %zu of %zu wrong; as parts of their bounds: t %.2f, normal %.2f, "
                      "its length %.2f\n",
                      what, precision_names[precision], lanes, tally.wrong, tally.compared, tally.t,
                      tally.normal, tally.length);
    assert_true(tally.compared > RAYS_PER_SHAPE / 2);
    assert_true(right);
}

static void check(const RandomShape *shapes, size_t count, Vector3 center, double radius,
                  bool next_to_surface, const char *what, Random *random)
{
    static Trial trial;
    Object objects[SHAPES_IN_SCENE];
    Material material;
    Scene scene = scene_of_shapes(objects, count, &material);
    trial.center = center;
    trial.radius = radius;
    const Precision from = probe_sound_from();
    if (!probe_has(from)) skip();
    for (int is_double = 0; is_double < 2; is_double++) {
        for (size_t i = 0; i < count; i++)
            objects[i] = shapes[i].object;
        prepare(&trial, &scene, shapes, count, is_double, next_to_surface, random);
        for (Precision precision = from; precision < ARITHMETIC_COUNT; precision++) {
            if (is_double != (precision == PRECISION_DOUBLE)) continue;
            check_at(&trial, &scene, precision, 1, what);
            check_at(&trial, &scene, precision, 0, what);
        }
    }
}

static int shapes_of_a_form(void)
{
    return tests_are_long() ? 3 : 2;
}

static int scene_count(void)
{
    return tests_are_long() ? 3 : 1;
}

static void hits_each_shape(void **state)
{
    const ShapeForm *form = *state;
    Random random = {(uint64_t)(form - forms)};
    for (int i = 0; i < shapes_of_a_form(); i++) {
        RandomShape shape = random_shape(form, &random);
        check(&shape, 1, shape.center, shape.radius, false, form->name, &random);
    }
}

TEST(hits_the_nearest_of_many)
{
    Random random = {form_count};
    for (int scene = 0; scene < scene_count(); scene++) {
        RandomShape shapes[SHAPES_IN_SCENE];
        double radius = 0;
        for (size_t i = 0; i < SHAPES_IN_SCENE; i++) {
            shapes[i] = random_shape(&forms[i % form_count], &random);
            radius = fmax(radius, vector_length(shapes[i].center) + shapes[i].radius);
        }
        check(shapes, SHAPES_IN_SCENE, (Vector3){0, 0, 0}, radius, false, "many shapes", &random);
    }
}

// Changes a cone to 32 times the slope. Its axis still ends on a float.
static void make_steep(RandomShape *cone)
{
    cone->object.as.cone.slope *= 32;
    cone->object.as.cone.axis = vector_scale(cone->object.as.cone.axis, 0x1p-5);
}

// There c cancels, and some rays are classified as leaving without a closer test.
TEST(hits_from_next_to_the_side)
{
    const uint64_t seed_count = tests_are_long() ? SEEDS_NEXT_TO_SIDE : 1;
    for (uint64_t seed = 0; seed < seed_count; seed++) {
        Random random = {form_count + 2 + 1000 * seed};
        for (const ShapeForm *form = forms; form < forms + form_count; form++) {
            if (form->type != SHAPE_CYLINDER && form->type != SHAPE_CONE) continue;
            for (int i = 0; i < SHAPES_NEXT_TO_SIDE; i++) {
                RandomShape shape = random_shape(form, &random);
                if (i == 0 && form->type == SHAPE_CONE) make_steep(&shape);
                check(&shape, 1, shape.center, shape.radius, true, form->name, &random);
            }
        }
    }
}

static bool same_bits(const TraceHit *a, const TraceHit *b)
{
    return a->object == b->object &&
           (a->object == UINT32_MAX || (memcmp(&a->t, &b->t, sizeof a->t) == 0 &&
                                        memcmp(&a->normal, &b->normal, sizeof a->normal) == 0));
}

TEST(gives_the_same_bits_at_every_width)
{
    static Trial trial;
    static TraceHit hits[2][RAYS_PER_SHAPE];
    Random random = {form_count + 1};
    RandomShape shapes[SHAPE_FORMS_MAX];
    Object objects[SHAPE_FORMS_MAX];
    for (size_t i = 0; i < form_count; i++) {
        shapes[i] = random_shape(&forms[i], &random);
        objects[i] = shapes[i].object;
    }
    Material material;
    Scene scene = scene_of_shapes(objects, form_count, &material);
    prepare(&trial, &scene, shapes, form_count, false, false, &random);
    for (Precision precision = probe_same_bits_from(); precision <= PRECISION_STRICT; precision++) {
        for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
            TraceHit *seen = hits[*lanes > 1];
            assert_true(probe_trace(&scene, precision, *lanes, trial.rays, RAYS_PER_SHAPE, seen));
            for (size_t i = 0; *lanes > 1 && i < RAYS_PER_SHAPE; i++)
                if (!same_bits(&hits[0][i], &seen[i]))
                    fail_msg("%s: ray %zu differs between 1 and %u lanes", precision_names[precision], i,
                             *lanes);
        }
    }
}

// Rays end inside a plate or needle that is thinner than the roundings of their distance. From there Newton's
// steps onto the surface diverge, which must not move points away from their rays.
TEST(points_of_thin_superellipsoids_stay_at_their_rays)
{
    static TraceRay rays[RAYS_PER_SHAPE];
    static TraceHit hits[RAYS_PER_SHAPE];
    Random random = {form_count + 3};
    for (int i = 0; i < 12; i++) {
        const double thickness = i % 3 == 0 ? 1e-5 : 1e-6,
                     radii[3] = {1, i % 2 == 0 ? 1 : thickness, thickness};
        const Vector3 first = random_unit_vector(&random),
                      second = vector_normalize(vector_cross(first, random_unit_vector(&random))),
                      axes[3] = {first, second, vector_cross(first, second)};
        Object object = {
            .type = SHAPE_SUPERELLIPSOID,
            .as.superellipsoid = {.center = random_in_sphere(&random), .exponent = i % 4 < 2 ? 4 : 16}};
        for (int k = 0; k < 3; k++)
            object.as.superellipsoid.axes[k] = vector_scale(axes[k], radii[k]);
        const Vector3 center = object.as.superellipsoid.center;
        for (size_t k = 0; k < RAYS_PER_SHAPE; k++) {
            const Vector3 aim = vector_add(center, vector_scale(first, random_between(&random, -0.5, 0.5))),
                          origin = vector_scale(random_unit_vector(&random), k % 2 == 0 ? 20 : 100);
            rays[k] = (TraceRay){origin, vector_subtract(aim, origin), 0, 1e30};
        }
        Material material;
        const Scene scene = scene_of_shapes(&object, 1, &material);
        for (Precision precision = probe_sound_from(); precision <= PRECISION_STRICT; precision++) {
            if (!probe_has(precision)) continue;
            assert_true(probe_trace(&scene, precision, 0, rays, RAYS_PER_SHAPE, hits));
            size_t found = 0;
            for (size_t k = 0; k < RAYS_PER_SHAPE; k++) {
                if (hits[k].object != 0) continue;
                found++;
                const Vector3 at = vector_add(rays[k].origin, vector_scale(rays[k].direction, hits[k].t));
                const double moved = vector_length(vector_subtract(hits[k].position, at)),
                             bound = 16 * 0x1p-24 * (4 + 2 * vector_length(rays[k].origin));
                if (!(moved <= bound))
                    fail_msg("%s, shape %d, ray %zu: moved by %g of %g", precision_names[precision], i, k,
                             moved, bound);
            }
            assert_true(found > 0);
        }
    }
}

// The squares of the gradients of such sizes are not numbers in float.
TEST(superellipsoids_of_extreme_sizes_have_normals)
{
    if (!probe_has(PRECISION_SINGLE)) skip();
    for (int exponent = -25; exponent <= 25; exponent += 5) {
        const double size = pow(10, exponent);
        Object object = {.type = SHAPE_SUPERELLIPSOID,
                         .as.superellipsoid = {{0, 0, 0}, {{size, 0, 0}, {0, size, 0}, {0, 0, size}}, 4}};
        Material material;
        const Scene scene = scene_of_shapes(&object, 1, &material);
        const TraceRay ray = {{0, 0, -4 * size}, {0, 0, 1}, 0, 1e30};
        TraceHit hit;
        assert_true(probe_trace(&scene, PRECISION_SINGLE, 0, &ray, 1, &hit));
        assert_int_equal(hit.object, 0);
        if (!(hit.normal.z < -0.999)) fail_msg("size %g: normal %g", size, hit.normal.z);
    }
}

int main(int argument_count, char **arguments)
{
    form_count = shape_forms(forms);
    for (size_t i = 0; i < form_count; i++)
        test_register(&(struct CMUnitTest){forms[i].name, hits_each_shape, NULL, NULL, &forms[i]});
    return tests_run(argument_count, arguments, probe_open, probe_close);
}
