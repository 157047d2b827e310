// Tests that no hit depends on the BVH, and that closed meshes do not leak, with ten thousand rays, or a
// million with GLINT_LONG_TESTS=1.
//
// run_tests: sanitize-long-only
#include "host/compile/shapes.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/random_ray.h"

static Random random_state;

static size_t few_or_many(size_t few, size_t many)
{
    return tests_are_long() ? many : few;
}

// On and off

static void trace_lanes(const Scene *scene, Precision precision, BvhChoice bvh, uint32_t lanes,
                        const TraceRay *rays, size_t count, TraceHit *hits)
{
    RenderSettings settings = settings_of_image(1, 1, precision);
    settings.lanes = lanes;
    settings.bvh = bvh;
    settings.extra_features = FEATURE_ALL;
    Renderer *renderer = probe_renderer(scene, &settings);
    assert_true(renderer_trace(renderer, rays, count, hits));
    assert_int_equal(renderer_report(renderer)->launches.count, 0); // the report is of images
    renderer_close(renderer);
}

static void trace(const Scene *scene, Precision precision, BvhChoice bvh, const TraceRay *rays, size_t count,
                  TraceHit *hits)
{
    trace_lanes(scene, precision, bvh, 0, rays, count, hits);
}

// Returns a shape along a world axis, or a box without thickness.
static Object aligned_object(size_t index, Vector3 center, double size)
{
    const Vector3 up = {0, size, 0};
    switch (index % 4) {
    case 0:
        return (Object){.type = SHAPE_BOX, .as.box = {center, vector_add(center, (Vector3){size, size, 0})}};
    case 1:
        return (Object){.type = SHAPE_DISC, .as.disc = {center, up, size / 2}};
    case 2:
        return (Object){.type = SHAPE_CYLINDER, .as.cylinder = {center, up, size / 3, true, true, false}};
    default:
        return (Object){.type = SHAPE_CONE, .as.cone = {center, up, {size / 2, 0}, 0, true, true, false}};
    }
}

// Returns a scene of a plane and every bounded form of every shape, mostly small, a third of them triangles.
static Scene random_scene(size_t count)
{
    ShapeForm forms[SHAPE_FORMS_MAX];
    const size_t form_count = shape_forms(forms);
    const ShapeForm triangle = {.type = SHAPE_TRIANGLE};
    Scene scene = {0};
    array_push(scene.materials, ((Material){.color = {1, 1, 1}, .ambient = 1, .ior = 1}));
    // what a ray crosses twice attenuates it twice
    array_push(scene.materials, ((Material){.color = {1, 1, 1}, .transmission.largest = 0.75, .ior = 1}));
    for (size_t i = 0; scene.objects.count < count; i++) {
        const ShapeForm *form = i % 3 == 0 ? &triangle : &forms[random_bits(&random_state) % form_count];
        if (i % 3 > 0 && !form->bounded) continue;
        double size = exp2(random_between(&random_state, -5, 0));
        Vector3 center = random_cube_point(&random_state, 10);
        Object object = i % 3 == 1 ? aligned_object(i / 3, center, size)
                                   : random_shape_at(form, center, size / 2, &random_state).object;
        object.material = random_bits(&random_state) % 3 == 0;
        array_push(scene.objects, object);
    }
    array_push(scene.objects, ((Object){.type = SHAPE_PLANE, .as.plane = {{0, -14, 0}, {0, 1, 0}}}));
    return scene;
}

// Returns a point where rounding matters. It is a triangle's vertex or on its edge, a corner of a box around
// another shape, or where the shape may touch the box.
static Vector3 delicate_point(const Scene *scene)
{
    const Object *object = &scene->objects.items[random_bits(&random_state) % scene->objects.count];
    double part = random_coin(&random_state) ? 0 : random_between(&random_state, 0, 1);
    if (object->type == SHAPE_TRIANGLE) {
        const Vector3 *vertices = object->as.triangle.vertices;
        return vector_add(vertices[0], vector_scale(vector_subtract(vertices[1], vertices[0]), part));
    }
    const Bounds box = object_bounds(scene, object);
    if (bounds_is_everywhere(&box)) return random_cube_point(&random_state, 10);
    if (random_coin(&random_state)) return (Vector3){box.max.x, box.min.y, box.max.z};
    Vector3 center = vector_scale(vector_add(box.min, box.max), 0.5);
    return (Vector3){box.max.x, center.y, center.z};
}

static TraceRay ray_of(Vector3 origin, Vector3 direction)
{
    return (TraceRay){origin, direction, 0, INFINITY};
}

// Makes rays. A quarter each are arbitrary, run along an axis with components of exactly 0 or -0, aim at a
// delicate point, or start far away.
static void rays_fill(TraceRay *rays, size_t count, const Scene *scene)
{
    for (size_t i = 0; i < count; i++) {
        Vector3 target =
            random_coin(&random_state) ? delicate_point(scene) : random_cube_point(&random_state, 10);
        Vector3 origin = random_cube_point(&random_state, 12), direction = vector_subtract(target, origin);
        if (i % 4 == 1) {
            double axes[3] = {0, -0.0, 0}, from[3] = {target.x, target.y, target.z};
            uint64_t axis = random_bits(&random_state) % 3;
            axes[axis] = random_coin(&random_state) ? 1 : -1;
            from[axis] = -12 * axes[axis];
            rays[i] = ray_of((Vector3){from[0], from[1], from[2]}, (Vector3){axes[0], axes[1], axes[2]});
            continue;
        }
        if (i % 4 == 2) direction = vector_subtract(delicate_point(scene), origin);
        if (i % 4 == 3) {
            origin =
                vector_scale(random_unit_vector(&random_state), exp2(random_between(&random_state, 5, 20)));
            direction = vector_subtract(target, origin);
        }
        rays[i] = ray_of(origin, vector_scale(direction, exp2(random_between(&random_state, -3, 3))));
    }
}

TEST(no_hit_depends_on_the_tree)
{
    static const struct {
        Precision precision;
        size_t few, many;
    } runs[] = {{PRECISION_SINGLE, 60000, 1000000},
                {PRECISION_STRICT, 20000, 200000},
                {PRECISION_DOUBLE, 20000, 200000}};
    random_state.state = 1;
    size_t all_different = 0;
    OwnedScene scene = random_scene(few_or_many(1000, 10000));
    size_t most = few_or_many(runs[0].few, runs[0].many);
    OWNED TraceRay *rays = memory_allocate(most, sizeof *rays);
    OWNED TraceHit *on = memory_allocate(most, sizeof *on), *off = memory_allocate(most, sizeof *off);
    rays_fill(rays, most, &scene);
    for (size_t run = 0; run < COUNT_OF(runs); run++) {
        if (!probe_has(runs[run].precision)) continue;
        size_t count = few_or_many(runs[run].few, runs[run].many), hit_count = 0, different = 0;
        trace(&scene, runs[run].precision, BVH_ON, rays, count, on);
        trace(&scene, runs[run].precision, BVH_OFF, rays, count, off);
        for (size_t i = 0; i < count; i++) {
            bool same = on[i].object == off[i].object &&
                        (off[i].object == UINT32_MAX || memcmp(&on[i].t, &off[i].t, sizeof on[i].t) == 0);
            hit_count += off[i].object != UINT32_MAX;
            if (same || different++ >= 10) continue;
            const TraceRay *ray = &rays[i];
            print_error(
                "%s, ray %zu from %.9g %.9g %.9g along %.9g %.9g %.9g: object %d at %.17g with the tree, "
                "%d (a %s) at %.17g without\n",
                precision_names[runs[run].precision], i, ray->origin.x, ray->origin.y, ray->origin.z,
                ray->direction.x, ray->direction.y, ray->direction.z, (int)on[i].object, on[i].t,
                (int)off[i].object,
                off[i].object == UINT32_MAX ? "miss" : shape_names[scene.objects.items[off[i].object].type],
                off[i].t);
        }
        assert_true(hit_count > count / 3);
        all_different += different;
    }
    assert_int_equal(all_different, 0);
}

enum { PACKET = 16, PACKETS = 1000 };

// Makes packets in which all rays look nearly one way, three of four do, or each looks another way.
// Traversal then takes one group, two and divergent lanes, or ray by ray. Each tmin lies behind the origin,
// at it, or ahead of it.
static void rays_behind_fill(TraceRay *rays, const Scene *scene)
{
    static const double nears[] = {-30, -4, -1e-3, 0, 1};
    for (size_t packet = 0; packet < PACKETS; packet++) {
        Vector3 origin = random_cube_point(&random_state, 8), target = delicate_point(scene);
        Vector3 ahead = vector_normalize(vector_subtract(target, origin));
        bool looks_behind = random_coin(&random_state); // each of its rays, at what is there
        if (looks_behind) ahead = vector_scale(ahead, -1);
        for (size_t lane = 0; lane < PACKET; lane++) {
            bool is_near_ahead = packet % 3 == 0 || (packet % 3 == 1 && lane % 4 != 0);
            Vector3 direction = random_unit_vector(&random_state);
            if (is_near_ahead) direction = vector_add(ahead, vector_scale(direction, 0.03));
            TraceRay *ray = &rays[packet * PACKET + lane];
            *ray = ray_of(vector_add(origin, random_cube_point(&random_state, 0.1)), direction);
            ray->tmin = nears[random_bits(&random_state) % (looks_behind ? 3 : COUNT_OF(nears))];
            if (random_coin(&random_state)) ray->tmax = ray->tmin + random_between(&random_state, 1, 20);
        }
    }
}

static size_t hits_differ(const TraceRay *rays, const TraceHit *hits, const TraceHit *expected,
                          const char *what)
{
    size_t different = 0;
    for (size_t i = 0; i < PACKETS * PACKET; i++) {
        bool hit = expected[i].object != UINT32_MAX;
        bool same = hits[i].object == expected[i].object &&
                    (!hit || memcmp(&hits[i].t, &expected[i].t, sizeof hits[i].t) == 0) &&
                    hits[i].light == expected[i].light;
        if (same || different++ >= 5) continue;
        print_error("%s, ray %zu between %g and %g: object %d at %.9g, light %g; expected %d at %.9g, %g\n",
                    what, i, rays[i].tmin, rays[i].tmax, (int)hits[i].object, hits[i].t, hits[i].light,
                    (int)expected[i].object, expected[i].t, expected[i].light);
    }
    return different;
}

TEST(rays_may_look_behind_their_start)
{
    random_state.state = 7;
    OwnedScene scene = random_scene(4000);
    const uint32_t plane = (uint32_t)scene.objects.count - 1;
    enum { COUNT = PACKETS * PACKET };
    OWNED TraceRay *rays = memory_allocate(COUNT, sizeof *rays);
    OWNED TraceHit *expected = memory_allocate(COUNT, sizeof *expected),
                   *hits = memory_allocate(COUNT, sizeof *hits);
    rays_behind_fill(rays, &scene);
    const Precision precisions[] = {probe_same_bits_from(), PRECISION_DOUBLE};
    if (!probe_has(precisions[0])) skip();
    size_t different = 0, behind = 0, dimmed = 0;
    for (size_t k = 0; k < COUNT_OF(precisions); k++) {
        if (!probe_has(precisions[k])) continue;
        trace(&scene, precisions[k], BVH_OFF, rays, COUNT, expected);
        for (size_t i = 0; i < COUNT; i++) {
            behind += expected[i].object < plane && expected[i].t < 0;
            dimmed += expected[i].light > 0 && expected[i].light < 1;
        }
        for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
            trace_lanes(&scene, precisions[k], BVH_ON, *lanes, rays, COUNT, hits);
            different += hits_differ(rays, hits, expected,
                                     formatted("%s, %u lanes", precision_names[precisions[k]], *lanes));
        }
    }
    assert_true(behind > COUNT / 32);
    assert_true(dimmed > COUNT / 32);
    assert_int_equal(different, 0);
}

// Closed meshes

enum { LEVELS = 5, CLOSED_TRIANGLES = 20 << (2 * LEVELS), CLOSED_VERTICES = CLOSED_TRIANGLES / 2 + 2 };

static uint32_t vertex_between(Mesh *mesh, uint32_t (*middles)[2], uint32_t a, uint32_t b)
{
    // each edge's midpoint is requested twice, the second time with its ends swapped
    uint32_t low = a < b ? a : b, high = a < b ? b : a, slot = (low * 73856093u ^ high * 19349663u) & 0xffff;
    for (; middles[slot][1] != 0; slot = (slot + 1) & 0xffff) {
        Vector3 middle = vector_normalize(vector_add(mesh->vertices[low], mesh->vertices[high]));
        Vector3 known = mesh->vertices[middles[slot][1]];
        if (middles[slot][0] == low && known.x == middle.x && known.y == middle.y && known.z == middle.z)
            return middles[slot][1];
    }
    uint32_t index = (uint32_t)mesh->vertex_count++;
    mesh->vertices[index] = vector_normalize(vector_add(mesh->vertices[low], mesh->vertices[high]));
    middles[slot][0] = low;
    middles[slot][1] = index;
    return index;
}

static void mesh_subdivide(Mesh *mesh)
{
    uint32_t(*middles)[2] = memory_allocate_zeroed(1 << 16, sizeof *middles);
    size_t count = mesh->triangle_count;
    for (size_t i = 0; i < count; i++) {
        const uint32_t a = mesh->triangles[i][0], b = mesh->triangles[i][1], c = mesh->triangles[i][2];
        uint32_t ab = vertex_between(mesh, middles, a, b), bc = vertex_between(mesh, middles, b, c),
                 ca = vertex_between(mesh, middles, c, a);
        const uint32_t parts[4][3] = {{ab, bc, ca}, {a, ab, ca}, {b, bc, ab}, {c, ca, bc}};
        memcpy(mesh->triangles[i], parts[0], sizeof parts[0]);
        memcpy(mesh->triangles[mesh->triangle_count], parts[1], 3 * sizeof parts[0]);
        mesh->triangle_count += 3;
    }
    free(middles);
}

// Returns an icosahedron cut four times each way, with its vertices' radii changed by up to a fifth.
static Scene closed_scene(Vector3 center, double radius)
{
    const double g = (1 + sqrt(5)) / 2;
    static const uint32_t faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                          {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                          {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                          {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const Vector3 corners[12] = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    Mesh mesh = {
        .vertices = memory_allocate(CLOSED_VERTICES, sizeof *mesh.vertices),
        .triangles = memory_allocate(CLOSED_TRIANGLES, sizeof *mesh.triangles),
        .vertex_count = 12,
        .triangle_count = 20,
    };
    for (int i = 0; i < 12; i++)
        mesh.vertices[i] = vector_normalize(corners[i]);
    memcpy(mesh.triangles, faces, sizeof faces);
    for (int level = 0; level < LEVELS; level++)
        mesh_subdivide(&mesh);
    assert_int_equal(mesh.triangle_count, CLOSED_TRIANGLES);
    assert_int_equal(mesh.vertex_count, CLOSED_VERTICES);
    for (size_t i = 0; i < CLOSED_VERTICES; i++)
        mesh.vertices[i] = vector_add(
            center, vector_scale(mesh.vertices[i], radius * random_between(&random_state, 0.8, 1.2)));
    Scene scene = {0};
    array_push(scene.materials, ((Material){.color = {1, 1, 1}, .ambient = 1, .ior = 1}));
    array_push(scene.meshes, mesh);
    array_push(scene.objects, ((Object){.type = SHAPE_MESH}));
    return scene;
}

// Makes rays from inside, two fifths each at vertices and at edges as they are at the kernel's precision.
static void rays_at_seams(TraceRay *rays, size_t count, const Mesh *mesh, Vector3 center, bool wide)
{
    for (size_t i = 0; i < count; i++) {
        const uint32_t *corners = mesh->triangles[random_bits(&random_state) % mesh->triangle_count];
        Vector3 a = mesh->vertices[corners[0]], b = mesh->vertices[corners[1]];
        Vector3 origin = vector_add(center, random_cube_point(&random_state, 0.15));
        if (!wide) {
            a = (Vector3){(float)a.x, (float)a.y, (float)a.z};
            b = (Vector3){(float)b.x, (float)b.y, (float)b.z};
            origin = (Vector3){(float)origin.x, (float)origin.y, (float)origin.z};
        }
        Vector3 target = a;
        if (i % 5 > 1)
            target = vector_add(a, vector_scale(vector_subtract(b, a), random_between(&random_state, 0, 1)));
        Vector3 direction = i % 5 == 4 ? random_unit_vector(&random_state) : vector_subtract(target, origin);
        rays[i] = ray_of(origin, direction);
    }
}

TEST(closed_meshes_do_not_leak)
{
    static const Vector3 centers[] = {{0, 0, 0}, {148376, 1234, -223423}};
    static const double radii[] = {1, 2};
    random_state.state = 31;
    size_t count = few_or_many(6000, 1000000), plain_count = few_or_many(320, 20000);
    OWNED TraceRay *rays = memory_allocate(count, sizeof *rays);
    OWNED TraceHit *hits = memory_allocate(count, sizeof *hits);
    for (size_t place = 0; place < 2; place++) {
        OwnedScene scene = closed_scene(centers[place], radii[place]);
        for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
            if (!probe_has(precision)) continue;
            rays_at_seams(rays, count, &scene.meshes.items[0], centers[place], precision == PRECISION_DOUBLE);
            for (BvhChoice bvh = BVH_ON; bvh <= BVH_OFF; bvh++) {
                size_t ray_count = bvh == BVH_ON ? count : plain_count, miss_count = 0;
                trace(&scene, precision, bvh, rays, ray_count, hits);
                for (size_t i = 0; i < ray_count; i++)
                    miss_count += hits[i].object == UINT32_MAX;
                if (miss_count > 0)
                    fail_msg("%zu of %zu rays leak at %s, tree %s, mesh %zu", miss_count, ray_count,
                             precision_names[precision], bvh_choice_names[bvh], place);
            }
        }
    }
}

TEST_MAIN(probe_open, probe_close)
