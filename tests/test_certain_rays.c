// Tests that certain hits of explicit rays at `certified` agree with exact arithmetic on the same doubles,
// whatever the ray hits and wherever it starts.
#include "host/verify/reference_scene.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/random_ray.h"
#include "tests/random_scene.h"

typedef struct {
    size_t certain, in_double, uncertain, hits;
} Counts;

static void ray_set(TraceRay *ray, Vector3 origin, Vector3 direction)
{
    *ray = (TraceRay){origin, direction, 0, INFINITY};
}

static void hit_check(const ReferenceScene *reference, const TraceRay *ray, const TraceHit *hit,
                      Counts *counts)
{
    if (hit->certainty == TRACE_UNCERTAIN) {
        counts->uncertain++;
        return;
    }
    const Vector3 o = ray->origin, d = ray->direction;
    ReferenceRay traced = reference_ray(o, d);
    traced.tmax = isfinite(ray->tmax) ? (Quad)ray->tmax : (Quad)LDBL_MAX;
    const ReferenceHit exact = reference_scene_hit(reference, &traced, UINT32_MAX);
    counts->certain += hit->certainty == TRACE_CERTAIN;
    counts->in_double += hit->certainty == TRACE_CERTAIN_IN_DOUBLE;
    counts->hits += exact.found;
    if (hit->object != exact.object ||
        (exact.found && !((Quad)hit->low <= exact.t && exact.t <= (Quad)hit->high)))
        fail_msg("(%a %a %a) + t (%a %a %a): object %u, t %a in %a .. %a, exact %u at %a", o.x, o.y, o.z, d.x,
                 d.y, d.z, hit->object, hit->t, hit->low, hit->high, exact.object, (double)exact.t);
}

static Counts rays_check(const Scene *scene, const TraceRay *rays, size_t count)
{
    Counts counts = {0};
    OWNED TraceHit *hits = memory_allocate(count, sizeof *hits);
    assert_true(probe_trace(scene, PRECISION_CERTIFIED, 0, rays, count, hits));
    ReferenceScene reference = reference_scene_open(scene);
    for (size_t i = 0; i < count; i++)
        hit_check(&reference, &rays[i], &hits[i], &counts);
    reference_scene_close(&reference);
    return counts;
}

static void counts_add(Counts *sum, Counts counts)
{
    sum->certain += counts.certain;
    sum->in_double += counts.in_double;
    sum->uncertain += counts.uncertain;
    sum->hits += counts.hits;
}

// Rays start within the scene and far away, in all directions and of any length.
TEST(every_shape_is_certain)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    enum { RAYS = 3000 };
    OWNED TraceRay *rays = memory_allocate(RAYS, sizeof *rays);
    Counts sum = {0};
    for (uint64_t seed = 1; seed <= (tests_are_long() ? 200 : 4); seed++) {
        OwnedScene scene = random_scene(seed, 48);
        Random random = {seed};
        for (size_t i = 0; i < RAYS; i++) {
            const double far = exp2(random_between(&random, -4, i % 4 ? 5 : 16));
            const Vector3 origin = random_point(&random, 0, far), target = random_cube_point(&random, 4);
            const double length = exp2(random_between(&random, -20, 20));
            ray_set(&rays[i], origin, vector_scale(vector_subtract(target, origin), length));
        }
        counts_add(&sum, rays_check(&scene, rays, RAYS));
    }
    printf("%zu certain, %zu in double, %zu uncertain, %zu hits\n", sum.certain, sum.in_double, sum.uncertain,
           sum.hits);
    assert_true(sum.certain > 20 * (sum.in_double + sum.uncertain));
    assert_true(sum.hits > sum.certain / 4);
}

// Returns a length of 2^-20 to 2^-2 of either sign.
static double random_offset(Random *random)
{
    return exp2(random_between(random, -20, -2)) * (random_coin(random) ? 1 : -1);
}

// Returns a ray along a line in either direction, which starts before or after a point of the line.
static TraceRay ray_through(Vector3 point, Vector3 direction, Random *random)
{
    const double t = exp2(random_between(random, -2, 12));
    if (random_coin(random)) direction = vector_scale(direction, -1);
    TraceRay ray;
    ray_set(&ray, vector_subtract(point, vector_scale(direction, random_coin(random) ? t : -t)), direction);
    return ray;
}

// Returns a ray nearly along the axis of a cylinder, and next to its side or to its axis.
static TraceRay ray_along_cylinder(const Object *object, Random *random)
{
    const Vector3 w = vector_normalize(object->as.cylinder.axis),
                  u = vector_normalize(vector_cross(w, random_unit_vector(random))),
                  aside = vector_cross(w, random_unit_vector(random));
    const double offset = random_offset(random),
                 off_axis = object->as.cylinder.radius * (random_coin(random) ? offset : 1 + offset);
    const Vector3 target =
        vector_add(object->as.cylinder.from,
                   vector_add(vector_scale(u, off_axis), vector_scale(w, random_between(random, -1, 3))));
    return ray_through(target, vector_add(w, vector_scale(aside, random_offset(random))), random);
}

// Returns a ray next to the apex of a double cone, or nearly along its side and next to it.
static TraceRay ray_along_cone(const Object *object, Random *random)
{
    const Vector3 w = vector_normalize(object->as.cone.axis),
                  u = vector_normalize(vector_cross(w, random_unit_vector(random)));
    const Vector3 side = vector_normalize(vector_add(w, vector_scale(u, object->as.cone.slope))),
                  normal = vector_cross(side, vector_cross(w, u));
    Vector3 off = vector_scale(random_unit_vector(random), random_offset(random)), direction = side;
    if (random_coin(random)) {
        const double along = exp2(random_between(random, -8, 8));
        off = vector_scale(vector_add(side, vector_scale(normal, random_offset(random))), along);
    } else if (random_coin(random)) {
        direction = random_unit_vector(random);
    }
    direction = vector_add(direction, vector_scale(random_unit_vector(random), random_offset(random)));
    return ray_through(vector_add(object->as.cone.from, off), direction, random);
}

// Rays aim at unbounded and finite cylinders, and at double cones with slopes of 10^-6 to 10^6.
TEST(rays_along_axes_and_sides_are_certain)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    enum { RAYS = 500 };
    OWNED TraceRay *rays = memory_allocate(RAYS, sizeof *rays);
    Random random = {5};
    Counts sum = {0};
    const unsigned scene_count = tests_are_long() ? 600 : 12;
    for (unsigned i = 0; i < scene_count; i++) {
        const Vector3 from = random_in_sphere(&random),
                      axis = vector_scale(random_unit_vector(&random), exp2(random_between(&random, -4, 4)));
        Object object = {.type = SHAPE_CYLINDER,
                         .as.cylinder = {.from = from,
                                         .axis = axis,
                                         .radius = exp2(random_between(&random, -6, 6)),
                                         .finite = i % 3 == 1,
                                         .caps = i % 6 == 1}};
        if (i % 3 == 2)
            object = (Object){.type = SHAPE_CONE,
                              .as.cone = {.from = from, .axis = axis, .slope = random_power(&random, -6, 6)}};
        for (size_t k = 0; k < RAYS; k++)
            rays[k] = i % 3 == 2 ? ray_along_cone(&object, &random) : ray_along_cylinder(&object, &random);
        Material material;
        Scene scene = scene_of_shapes(&object, 1, &material);
        counts_add(&sum, rays_check(&scene, rays, RAYS));
    }
    printf("%zu certain, %zu in double, %zu uncertain, %zu hits\n", sum.certain, sum.in_double, sum.uncertain,
           sum.hits);
    assert_true(sum.certain > sum.in_double + sum.uncertain && sum.hits > sum.certain / 4);
}

// Half of a chord of the cylinder's circle is too long for float, in units of t. The small sphere keeps the
// unit of length.
TEST(rays_almost_along_a_huge_cylinder_miss)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    Object objects[] = {
        {.type = SHAPE_SPHERE, .as.sphere = {.center = {0, -3, 0}, .radius = 1e-16}},
        {.type = SHAPE_CYLINDER,
         .as.cylinder = {
             .from = {0, 7e13, 0}, .axis = {0, 6e13, 0}, .radius = 1.4e14, .finite = true, .caps = true}}};
    Material material;
    Scene scene = scene_of_shapes(objects, 2, &material);
    enum { RAYS = 64 };
    TraceRay rays[RAYS];
    for (int i = 0; i < RAYS; i++) {
        const double side = (1.6e14 + 0.35e14 * (i % 8) / 7) / sqrt(2),
                     slope = 4.9e-6 * pow(2, i / 56.0) / sqrt(2);
        ray_set(&rays[i], (Vector3){side, 0, side}, (Vector3){-slope, 1, -slope});
    }
    const Counts counts = rays_check(&scene, rays, RAYS);
    assert_true(counts.certain > 0 && counts.in_double > 0);
    assert_int_equal(counts.uncertain + counts.hits, 0);
}

// A bumpy sheet of triangles. Rays aim at its vertices, at its edges and, along the sheet, at its
// silhouettes.
TEST(mesh_edges_are_certain)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    enum { SIDE = 12, RAYS = 4000 };
    Random random = {3};
    Vector3 vertices[SIDE][SIDE];
    for (unsigned i = 0; i < SIDE; i++)
        for (unsigned k = 0; k < SIDE; k++)
            vertices[i][k] = (Vector3){(double)i / 3, random_between(&random, 0, 0.3), (double)k / 7};
    Object objects[2 * (SIDE - 1) * (SIDE - 1)];
    size_t count = 0;
    for (size_t i = 0; i + 1 < SIDE; i++)
        for (size_t k = 0; k + 1 < SIDE; k++)
            for (size_t half = 0; half < 2; half++)
                objects[count++] = (Object){.type = SHAPE_TRIANGLE,
                                            .as.triangle.vertices = {vertices[i][k + 1], vertices[i + 1][k],
                                                                     vertices[i + half][k + half]}};
    Material material;
    Scene scene = scene_of_shapes(objects, count, &material);
    TraceRay rays[RAYS];
    for (size_t i = 0; i < RAYS; i++) {
        const size_t row = (size_t)random_between(&random, 0, SIDE - 1),
                     column = (size_t)random_between(&random, 0, SIDE - 1);
        const Vector3 a = vertices[row][column], b = vertices[row + i % 2][column + 1];
        const Vector3 target =
            vector_add(a, vector_scale(vector_subtract(b, a), i % 3 ? random_between(&random, 0, 1) : 0));
        const Vector3 aside = {i % 2 ? 1e-10 : 0, 0, i % 4 == 1 ? 1e-10 : 0};
        Vector3 origin = random_point(&random, 2, i % 5 ? 20 : 2000);
        if (i % 7 == 0) origin.y = random_between(&random, 0, 0.3);
        ray_set(&rays[i], origin, vector_subtract(vector_add(target, aside), origin));
    }
    const Counts counts = rays_check(&scene, rays, RAYS);
    printf("%zu certain, %zu in double, %zu uncertain\n", counts.certain, counts.in_double, counts.uncertain);
    assert_true(counts.certain > 0 && counts.in_double > RAYS / 10 && counts.uncertain > 0);
}

// A plane through the origin and one across it. Rays start next to the origin, down to the least numbers, and
// have directions of every length and ends next to their hits.
TEST(least_and_largest_numbers)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    Object objects[] = {{.type = SHAPE_PLANE, .as.plane = {.normal = {0, 1, 0}}},
                        {.type = SHAPE_PLANE, .as.plane = {.normal = {1, 0, 0}}},
                        {.type = SHAPE_PLANE, .as.plane = {.point = {0, 0, 1}, .normal = {0, 0, 1}}}};
    Material material;
    Scene scene = scene_of_shapes(objects, 3, &material);
    enum { RAYS = 6000 };
    OWNED TraceRay *rays = memory_allocate(RAYS, sizeof *rays),
                   *scaled = memory_allocate(RAYS, sizeof *scaled);
    OWNED TraceHit *hits = memory_allocate(RAYS, sizeof *hits);
    OWNED int *exponents = memory_allocate(RAYS, sizeof *exponents);
    Random random = {11};
    for (size_t i = 0; i < RAYS; i++) {
        const double size = exp2(floor(random_between(&random, i % 2 ? -1074 : -160, i % 3 ? 40 : 1000)));
        const Vector3 direction =
            vector_scale(random_in_sphere(&random), exp2(random_between(&random, -1000, 1000)));
        ray_set(&rays[i], vector_scale(random_in_sphere(&random), size), direction);
        if (i % 4 == 0) // about the distance of the plane y = 0
            rays[i].tmax = -rays[i].origin.y / direction.y * (1 + random_between(&random, -1e-15, 1e-15));
        if (!(rays[i].tmax > 0)) rays[i].tmax = INFINITY;
        scaled[i] = trace_ray_scaled(rays[i], PRECISION_CERTIFIED, &exponents[i]);
    }
    assert_true(probe_trace(&scene, PRECISION_CERTIFIED, 0, scaled, RAYS, hits));
    ReferenceScene reference = reference_scene_open(&scene);
    Counts counts = {0};
    for (size_t i = 0; i < RAYS; i++) {
        trace_hit_unscale(&hits[i], exponents[i]);
        hit_check(&reference, &rays[i], &hits[i], &counts);
    }
    printf("%zu certain, %zu in double, %zu uncertain\n", counts.certain, counts.in_double, counts.uncertain);
    assert_true(counts.certain > RAYS / 8 && counts.uncertain > 0);
    reference_scene_close(&reference);
}

// A sphere's tangent, a start on a sphere, and two coincident spheres are uncertain. Rays whose targets lie
// behind them, and tiny directions, are certain.
TEST(ambiguous_hits_are_uncertain)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    Object objects[] = {
        {.type = SHAPE_SPHERE, .as.sphere = {.center = {0, 0, 5}, .radius = 1}},
        {.type = SHAPE_SPHERE, .as.sphere = {.center = {9, 0, 5}, .radius = 1}},
        {.type = SHAPE_SPHERE, .as.sphere = {.center = {9, 0, 5}, .radius = 1}},
    };
    Material material;
    Scene scene = scene_of_shapes(objects, 3, &material);
    const struct {
        Vector3 origin, direction;
        bool is_certain;
    } questions[] = {
        {{1, 0, 0}, {0, 0, 1}, false},        {{0, 0, 4}, {0, 0, 1}, false},
        {{9, 0, 0}, {0, 0, 1}, false},        {{0, 0, 0}, {0, 0, 1}, true},
        {{0, 0, 0}, {0, 0, -1}, true},        {{0.5, 0.1, 5}, {0.1, 0.2, 1}, true},
        {{0, 0, 0}, {0, 0, 0x1p-30}, true},   {{0, 0, -0x1p30}, {0, 0, 1}, true},
        {{0, 0, -0x1p230}, {0, 0, 1}, false}, {{1 + 1e-9, 0, 0}, {0, 0, 1}, true},
    };
    enum { COUNT = COUNT_OF(questions) };
    TraceRay rays[COUNT];
    TraceHit hits[COUNT];
    for (size_t i = 0; i < COUNT; i++)
        ray_set(&rays[i], questions[i].origin, questions[i].direction);
    assert_true(probe_trace(&scene, PRECISION_CERTIFIED, 0, rays, COUNT, hits));
    for (size_t i = 0; i < COUNT; i++)
        if ((hits[i].certainty != TRACE_UNCERTAIN) != questions[i].is_certain)
            fail_msg("question %zu is %scertain", i, questions[i].is_certain ? "not " : "");
    assert_int_equal(rays_check(&scene, rays, COUNT).uncertain, 4);
    assert_int_equal(hits[3].certainty, TRACE_CERTAIN);
    assert_int_equal(hits[COUNT - 1].certainty, TRACE_CERTAIN_IN_DOUBLE);
}

TEST_MAIN(probe_open, probe_close)
