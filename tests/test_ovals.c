// Tests that hits of shapes that transforms turn into other shapes agree with quadruple precision, at every
// precision, and hits of ellipsoids with the textbook's quadric.
//
// run_tests: sanitize-long-only
#include "host/compile/compile.h"
#include "host/scene/object_transform.h"
#include "host/scene/oval.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/random_ray.h"
#include "tests/reference.h"

enum { RAYS = 2000 };

static ShapeForm forms[SHAPE_FORMS_MAX];

static bool has_ovals(ShapeType type)
{
    return type == SHAPE_SPHERE || type == SHAPE_DISC || type == SHAPE_CYLINDER || type == SHAPE_CONE ||
           type == SHAPE_TORUS || type == SHAPE_PARABOLOID;
}

static Affine random_turn(Random *random)
{
    return affine_about(random_unit_vector(random), random_between(random, 0, 360));
}

// Returns a turn, a scale, one in four mirrors and one in four is extreme, another turn and a translation.
static Affine random_affine(Random *random)
{
    const double largest = random_bits(random) % 4 ? 0.4 : 1; // powers of ten
    Affine scale = affine_identity;
    for (int i = 0; i < 3; i++)
        scale.rows[i][i] = random_power(random, -largest, largest);
    if (random_bits(random) % 4 == 0) scale.rows[0][0] *= -1;
    const Affine first = random_turn(random), turned = affine_multiply(&scale, &first),
                 last = random_turn(random);
    Affine affine = affine_multiply(&last, &turned);
    const Vector3 place = random_cube_point(random, 8);
    affine.rows[0][3] = place.x, affine.rows[1][3] = place.y, affine.rows[2][3] = place.z;
    return affine;
}

// Transforms a shape, which becomes an oval.
static Object oval_of(const Object *shape, const Affine *affine)
{
    Object object = *shape;
    Material material;
    Scene scene = scene_of_shapes(&object, 1, &material);
    const char *why = object_transform(&scene, &object, affine);
    if (why) fail_msg("%s", why);
    assert_int_equal(object.type, SHAPE_OVAL);
    assert_int_equal(object_shape(&object), shape->type);
    return object;
}

// Prepares rays that are special to a shape, mapped as it is.
static void rays_prepare(const RandomShape *shape, const Affine *affine, TraceRay *rays, Random *random)
{
    for (size_t i = 0; i < RAYS; i++) {
        const RandomRay given = random_ray(shape, random);
        const Vector3 from = affine_point(affine, given.origin),
                      way = affine_direction(affine, given.direction);
        rays[i] = (TraceRay){from, way, 0, 1e30};
    }
}

static ReferenceHit exact_hit(const Object *object, const TraceRay *ray, bool is_double)
{
    const Vector3 origin = ray->origin, direction = ray->direction;
    const ReferenceRay exact =
        is_double ? reference_ray(origin, direction) : reference_ray_rounded(origin, direction);
    return reference_hit_object(object, &exact);
}

typedef struct {
    size_t compared, hits;
    double t, normal, place; // the largest errors, as parts of their bounds
} Tally;

// The bounds are those of other shapes (docs/numerics.md), with a size that the map's stretch multiplies.
static void hit_compare(const Object *object, const TraceRay *ray, const TraceHit *hit, Precision precision,
                        const char *what, Tally *tally)
{
    const bool is_double = precision == PRECISION_DOUBLE;
    const double u = is_double ? 0x1p-53 : 0x1p-24;
    const ReferenceHit exact = exact_hit(object, ray, is_double);
    const ReferenceSurface surface = reference_surface(object, quad3(object->as.oval.center));
    double least, most;
    oval_stretches(object, &least, &most);
    const double length = vector_length(ray->direction), stretch = most / least,
                 distance = vector_length(vector_subtract(ray->origin, surface.center));
    double size = surface.bounding_radius;
    if (!oval_is_bounded(object)) size = fmax(size, distance);
    if (exact.found && !oval_is_bounded(object)) size = fmax(size, (double)exact.t * length);
    // rounding turns a ray along the axis to either side
    const Vector3 way = vector_normalize(ray->direction), axis = vector_normalize(object->as.oval.axes[2]);
    if (!oval_is_bounded(object) && vector_length(vector_cross(way, axis)) < 1e-3) return;
    // rays far away are moved before they are mapped, at compensated forms without loss
    const double moved = u * ((precision == PRECISION_SINGLE ? 2 * distance : 0) + 4 * stretch * size);
    if ((double)exact.margin <= fmax(2 * moved, 4 * u * distance)) return;
    tally->compared++;
    if (hit->object != exact.object)
        fail_msg("%s, %s: object %u, exact %u, margin %g of %g", what, precision_names[precision],
                 hit->object, exact.object, (double)exact.margin, moved);
    if (!exact.found) return;
    tally->hits++;
    const double t_bound = 8 * u * (double)exact.t + moved / ((double)exact.cosine * length);
    tally->t = error_max(tally->t, fabs((double)(hit->t - exact.t)) / t_bound);
    const double normal_bound =
        16 * u * stretch +
        4 * u * (distance + stretch * size) / ((double)exact.cosine * (double)exact.curvature_radius);
    tally->normal = error_max(tally->normal, reference_distance(hit->normal, exact.normal) / normal_bound);
    const Vector3 place = hit->position;
    const ReferenceSurface there = reference_surface(object, quad3(place));
    const double place_bound =
        u * (24 * stretch * size + 8 * vector_length(place) + 4 * length * (double)exact.t);
    tally->place = error_max(tally->place, (double)reference_surface_distance(&there) / place_bound);
}

// Rays along the normal from outside an ellipsoid do not hit it again, however near it the next ray starts.
static void leaving_rays_miss(const Scene *scene, Precision precision, TraceRay *rays, const TraceHit *hits)
{
    static TraceHit next[RAYS];
    size_t count = 0;
    for (size_t i = 0; i < RAYS; i++) {
        const Vector3 from = rays[i].origin, way = hits[i].normal, start = hits[i].reflected_origin,
                      outward = vector_subtract(start, scene->objects.items[0].as.oval.center);
        if (hits[i].object != 0 || vector_dot(way, outward) < 0) continue;
        assert_true(vector_dot(way, vector_subtract(from, start)) > 0);
        rays[count++] = (TraceRay){start, way, 0, 1e30};
    }
    assert_true(count > RAYS / 20);
    assert_true(probe_trace(scene, precision, 0, rays, count, next));
    for (size_t i = 0; i < count; i++)
        if (next[i].object != UINT32_MAX)
            fail_msg("%s: a ray that leaves hits at %g", precision_names[precision], next[i].t);
}

static void hits_ovals(void **state)
{
    const ShapeForm *form = *state;
    static TraceRay rays[RAYS];
    static TraceHit hits[RAYS];
    Random random = {(uint64_t)(form - forms) + 1};
    for (int round = 0; round < (tests_are_long() ? 12 : 3); round++) {
        const RandomShape shape = random_shape(form, &random);
        const Affine affine = random_affine(&random);
        const Object exact = oval_of(&shape.object, &affine);
        rays_prepare(&shape, &affine, rays, &random);
        for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
            if (!probe_has(precision)) continue;
            Object object = precision == PRECISION_DOUBLE ? exact : reference_round_object(&exact);
            Material material;
            const Scene scene = scene_of_shapes(&object, 1, &material);
            assert_true(probe_trace(&scene, precision, 0, rays, RAYS, hits));
            Tally tally = {0};
            for (size_t i = 0; i < RAYS; i++)
                hit_compare(&object, &rays[i], &hits[i], precision, form->name, &tally);
            const bool is_right = tally.t <= 1 && tally.normal <= 1 && tally.place <= 1 &&
                                  tally.compared > RAYS / 2 && tally.hits > RAYS / 20;
            if (!is_right || tests_are_long())
                print_message("%s, %s: %zu compared, %zu hits; as parts of their bounds t %.2f, normal %.2f, "
                              "place %.2f\n",
                              form->name, precision_names[precision], tally.compared, tally.hits, tally.t,
                              tally.normal, tally.place);
            assert_true(is_right);
            static TraceRay leaving[RAYS];
            memcpy(leaving, rays, sizeof leaving);
            if (form->type == SHAPE_SPHERE) leaving_rays_miss(&scene, precision, leaving, hits);
        }
    }
}

// Hits that are certain at `certified` are right, even at outlines and rims.
TEST(certain_hits_of_ovals_are_right)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    static TraceRay rays[RAYS];
    static TraceHit hits[RAYS];
    const size_t form_count = shape_forms(forms);
    size_t certain = 0, found = 0, traced = 0;
    for (size_t f = 0; f < form_count; f++) {
        if (!has_ovals(forms[f].type)) continue;
        Random random = {f + 100};
        for (int round = 0; round < (tests_are_long() ? 20 : 2); round++) {
            const RandomShape shape = random_shape(&forms[f], &random);
            const Affine affine = random_affine(&random);
            Object object = oval_of(&shape.object, &affine);
            Material material;
            const Scene scene = scene_of_shapes(&object, 1, &material);
            rays_prepare(&shape, &affine, rays, &random);
            assert_true(probe_trace(&scene, PRECISION_CERTIFIED, 0, rays, RAYS, hits));
            traced += RAYS;
            for (size_t i = 0; i < RAYS; i++) {
                if (hits[i].certainty == TRACE_UNCERTAIN) continue;
                const ReferenceHit exact = exact_hit(&object, &rays[i], true);
                certain++;
                found += exact.found;
                if (hits[i].object != exact.object ||
                    (exact.found && !((Quad)hits[i].low <= exact.t && exact.t <= (Quad)hits[i].high)))
                    fail_msg("%s, ray %zu: object %u, t %a in %a .. %a, exact %u at %a", forms[f].name, i,
                             hits[i].object, hits[i].t, hits[i].low, hits[i].high, exact.object,
                             (double)exact.t);
            }
        }
    }
    print_message("%zu of %zu certain, of which %zu hit\n", certain, traced, found);
    assert_true(10 * certain > 9 * traced && found > certain / 4);
}

// An ellipsoid with the semi-axes s along the columns of a rotation R is |S^-1 R^T (p - c)| = 1, with the
// gradient R S^-2 R^T (p - c) (Glassner, An Introduction to Ray Tracing, 1989, chapter 2).
TEST(ellipsoids_follow_the_textbook)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    static TraceRay rays[RAYS];
    static TraceHit hits[RAYS];
    Random random = {7};
    for (int round = 0; round < 4; round++) {
        const Vector3 semi_axes = {random_between(&random, 0.3, 3), random_between(&random, 0.3, 3),
                                   random_between(&random, 0.3, 3)};
        const Vector3 center = random_cube_point(&random, 2);
        const Affine turn = random_turn(&random);
        Affine affine = turn;
        for (int i = 0; i < 3; i++) {
            affine.rows[i][0] *= semi_axes.x, affine.rows[i][1] *= semi_axes.y,
                affine.rows[i][2] *= semi_axes.z;
        }
        affine.rows[0][3] = center.x, affine.rows[1][3] = center.y, affine.rows[2][3] = center.z;
        const Object unit = {.type = SHAPE_SPHERE, .as.sphere.radius = 1};
        Object object = oval_of(&unit, &affine);
        Material material;
        const Scene scene = scene_of_shapes(&object, 1, &material);
        for (size_t i = 0; i < RAYS; i++) {
            const Vector3 from = vector_scale(random_unit_vector(&random), 9),
                          to = vector_add(center, random_cube_point(&random, 2)),
                          way = vector_normalize(vector_subtract(to, from));
            rays[i] = (TraceRay){from, way, 0, 1e30};
        }
        assert_true(probe_trace(&scene, PRECISION_DOUBLE, 1, rays, RAYS, hits));
        size_t found = 0;
        for (size_t i = 0; i < RAYS; i++) {
            const Vector3 f = vector_subtract(rays[i].origin, center), d = rays[i].direction;
            const double semi[3] = {semi_axes.x, semi_axes.y, semi_axes.z};
            double a = 0, b = 0, c = -1;
            for (int k = 0; k < 3; k++) {
                const Vector3 axis = {turn.rows[0][k], turn.rows[1][k], turn.rows[2][k]};
                const double fk = vector_dot(f, axis) / semi[k], dk = vector_dot(d, axis) / semi[k];
                a += dk * dk, b += fk * dk, c += fk * fk;
            }
            const double discriminant = b * b - a * c;
            if (fabs(discriminant) < 1e-9 * a) continue;
            assert_int_equal(hits[i].object, discriminant > 0 ? 0 : UINT32_MAX);
            if (discriminant < 0) continue;
            found++;
            const double t = (-b - sqrt(discriminant)) / a;
            assert_true(fabs(hits[i].t - t) < 1e-9);
            const Vector3 p = vector_add(f, vector_scale(d, t));
            Vector3 gradient = {0, 0, 0};
            for (int k = 0; k < 3; k++) {
                const Vector3 axis = {turn.rows[0][k], turn.rows[1][k], turn.rows[2][k]};
                gradient =
                    vector_add(gradient, vector_scale(axis, vector_dot(p, axis) / (semi[k] * semi[k])));
            }
            const Vector3 error = vector_subtract(vector_normalize(gradient), hits[i].normal);
            assert_true(vector_length(error) < 1e-7);
        }
        assert_true(found > RAYS / 10);
    }
}

int main(int argument_count, char **arguments)
{
    const size_t form_count = shape_forms(forms);
    for (size_t i = 0; i < form_count; i++)
        if (has_ovals(forms[i].type))
            test_register(&(struct CMUnitTest){forms[i].name, hits_ovals, NULL, NULL, &forms[i]});
    return tests_run(argument_count, arguments, probe_open, probe_close);
}
