// Checks of triangles and of the BVH that are not in the tables.
#include "host/base/array.h"
#include "host/verify/checks.h"
#include "host/verify/families.h"
#include "host/verify/random_shape.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Checks that no ray leaves a mesh from inside, where adjacent floats are 1/64 apart.
void verify_far_mesh(VerifyRun *run)
{
    enum { COUNT = 1 << 16, BATCHES = 16 };
    TraceRay *rays = verify_allocate(run, COUNT, sizeof *rays);
    TraceHit *hits = verify_allocate(run, COUNT, sizeof *hits);
    Scene *scene = verify_empty_scene(run);
    scene_far_sphere(scene);
    Renderer *opened = verify_open(run, scene, true);
    for (uint64_t batch = 0; batch < verify_part(run, BATCHES); batch++) {
        for (uint64_t i = 0; i < COUNT; i++) {
            uint64_t index = batch * COUNT + i;
            Vector3 origin = vector_add(far_sphere_center, sample_in_cube(65, index, 0));
            rays[i] = verify_ray(run, origin, sample_unit_vector(65, index, 3));
        }
        verify_trace_opened(run, opened, rays, COUNT, hits);
        for (size_t i = 0; i < COUNT; i++)
            run->result->leaks += !verify_is_hit(&hits[i]);
    }
    renderer_close(opened);
}

// Checks one triangle at every power of two, all at one corner. A ray through the middle of each hits that
// one, the first in the list of those it crosses. The distances are each other's multiples, bit for bit.
void verify_scale_ladder(VerifyRun *run)
{
    enum { SMALLEST = -40, LARGEST = 40, COUNT = LARGEST - SMALLEST + 1 };
    TraceRay rays[COUNT];
    Scene *scene = verify_empty_scene(run);
    double third = verify_rounded(run, 1.0 / 3);
    for (int k = SMALLEST; k <= LARGEST; k++) {
        double s = ldexp(1, k), across = ldexp(third, k);
        scene_add_triangle(scene, (Vector3[]){{0, 0, 0}, {s, 0, 0}, {0, s, 0}});
        rays[k - SMALLEST] = verify_ray(run, (Vector3){across, across, -s}, (Vector3){0, 0, 1});
    }
    const TraceHit *hits = verify_trace(run, scene, false, rays, COUNT);
    double unscaled = hits[-SMALLEST].t;
    for (int k = SMALLEST; k <= LARGEST; k++) {
        const TraceHit *hit = &hits[k - SMALLEST];
        if (hit->object != (uint32_t)(k - SMALLEST)) {
            run->result->wrong++;
            continue;
        }
        run->result->differing += hit->t != ldexp(unscaled, k);
        if (run->tier != TIER_A) verify_record_ulps(run, fabs(hit->t - ldexp(1, k)), ldexp(1, k), 8);
    }
}

// Checks that a sliver seen at half a degree is hit only between its corners.
void verify_within_triangle(VerifyRun *run)
{
    enum { COUNT = 100000 };
    TraceRay *rays = verify_allocate(run, COUNT, sizeof *rays);
    verify_family(run, family_near_sliver, 0, COUNT, rays);
    Scene *scene = verify_empty_scene(run);
    scene_add_triangle(scene, sliver_corners);
    const TraceHit *hits = verify_trace(run, scene, false, rays, COUNT);
    for (size_t i = 0; i < COUNT; i++) {
        if (!verify_is_hit(&hits[i])) continue;
        const Vector3 origin = rays[i].origin, direction = rays[i].direction;
        double nearest = INFINITY, farthest = -INFINITY;
        for (size_t k = 0; k < 3; k++) {
            Vector3 toward = vector_subtract(verify_rounded_vector(run, sliver_corners[k]), origin);
            double t = vector_dot(toward, direction) / vector_dot(direction, direction);
            nearest = fmin(nearest, t);
            farthest = fmax(farthest, t);
        }
        double slack = 8 * verify_ulp(run, farthest);
        run->result->wrong += hits[i].t < nearest - slack || hits[i].t > farthest + slack;
    }
}

// Checks that a triangle seen face on from near has its plane's distance, however far its corners are.
void verify_facing_triangle(VerifyRun *run)
{
    enum { COUNT = 1000 };
    static const Vector3 corners[] = {{2001, 1002, -1998}, {2001, -1998, 1002}, {-3999, 1002, 1002}};
    TraceRay rays[COUNT];
    for (uint64_t i = 0; i < COUNT; i++)
        rays[i] = verify_ray(run, sample_in_cube(72, i, 0), (Vector3){1, 2, 2});
    Scene *scene = verify_empty_scene(run);
    scene_add_triangle(scene, corners);
    const TraceHit *hits = verify_trace(run, scene, false, rays, COUNT);
    for (size_t i = 0; i < COUNT; i++) {
        Quad t = 1 - quad3_dot(quad3(rays[i].origin), (Quad3){1, 2, 2}) / 9;
        run->result->leaks += !verify_is_hit(&hits[i]);
        if (verify_is_hit(&hits[i]) && run->tier > TIER_B)
            verify_record_ulps(run, (double)quad_absolute(hits[i].t - t), (double)t, 4);
    }
}

static void add_random_triangles(Scene *scene, unsigned count, double size)
{
    for (uint64_t i = 0; i < count; i++) {
        Vector3 a = sample_in_cube(66, i, 0);
        scene_add_triangle(scene, (Vector3[]){a, vector_add(a, vector_scale(sample_in_cube(66, i, 3), size)),
                                              vector_add(a, vector_scale(sample_in_cube(66, i, 6), size))});
    }
}

static bool is_refused(const char *vertex)
{
    char text[200];
    snprintf(text, sizeof text,
             "camera: {position: [0, 0, 0], look_at: [0, 0, 1], fov: 90}\n"
             "objects:\n  - triangle: {vertices: [[%s, 0, 0], [1, 0, 0], [0, 1, 0]]}\n",
             vertex);
    return verify_is_refused(text);
}

// Checks that degenerate triangles are never hit or affect others, and that NaN and infinity are refused.
void verify_degenerate_meshes(VerifyRun *run)
{
    enum { SOUND = 200 };
    const size_t count = 4000;
    static const Vector3 degenerate[][3] = {
        {{0, 0, 0}, {0, 0, 0}, {1, 1, 1}},       // a vertex twice
        {{0, 0, 0}, {0.5, 0.5, 0.5}, {1, 1, 1}}, // collinear
        {{0.25, 0.25, 0.25}, {0.25, 0.25, 0.25}, {0.25, 0.25, 0.25}},
        {{-1, 0.5, 0}, {1, 0.5, 0}, {0, 0.5, 0}},
    };
    TraceRay *rays = verify_allocate(run, count, sizeof *rays);
    for (uint64_t i = 0; i < count; i++) {
        Vector3 origin = vector_scale(sample_unit_vector(67, i, 0), 4);
        Vector3 target = sample_in_cube(67, i, 3);
        if (i % 2) {
            const Vector3 *corners = degenerate[i / 2 % 4];
            Vector3 along = vector_subtract(corners[2], corners[0]);
            target = vector_add(corners[0], vector_scale(along, i % 4 == 1 ? 0.5 : sample_number(67, i, 6)));
        }
        rays[i] = verify_ray(run, origin, vector_subtract(target, origin));
    }
    Scene *scene = verify_empty_scene(run);
    add_random_triangles(scene, SOUND, 0.5);
    const TraceHit *clean = verify_trace(run, scene, true, rays, count);
    for (size_t i = 0; i < COUNT_OF(degenerate); i++)
        scene_add_triangle(scene, degenerate[i]);
    const TraceHit *hits = verify_trace(run, scene, true, rays, count);
    for (size_t i = 0; i < count; i++) {
        run->result->wrong += verify_is_hit(&hits[i]) && hits[i].object >= SOUND;
        run->result->differing += !verify_same_bits(&hits[i], &clean[i]);
    }
    static const char *const no_numbers[] = {".nan", ".inf", "-.inf"};
    for (size_t i = 0; i < COUNT_OF(no_numbers); i++)
        run->result->wrong += !is_refused(no_numbers[i]);
}

enum { M6_TRIANGLES = 10000, M6_OTHERS = 20, M6_RAYS = 1 << 16, M6_BATCHES = 16 };

// Returns a scene of triangles and several objects of every bounded form of every shape.
static Scene *m6_scene(VerifyRun *run)
{
    ShapeForm forms[SHAPE_FORMS_MAX];
    const size_t form_count = shape_forms(forms);
    Scene *scene = verify_empty_scene(run);
    add_random_triangles(scene, M6_TRIANGLES, 0.05);
    Random random = {68};
    for (size_t i = 0; i < form_count * M6_OTHERS; i++) {
        Vector3 center = sample_in_cube(68, i, 0);
        RandomShape shape =
            random_shape_at(&forms[i % form_count], center, random_between(&random, 0.02, 0.1), &random);
        if (forms[i % form_count].bounded) array_push(scene->objects, shape.object);
    }
    return scene;
}

// Returns a point far from a triangle, in its plane, from which it is seen edge-on.
static Vector3 m6_point_in_plane(const Vector3 vertices[3], uint64_t index)
{
    Vector3 ab = vector_subtract(vertices[1], vertices[0]), ac = vector_subtract(vertices[2], vertices[0]);
    Vector3 along = vector_add(vector_scale(ab, sample_symmetric(69, index, 1)),
                               vector_scale(ac, sample_symmetric(69, index, 2)));
    return vector_add(vertices[0], vector_scale(vector_normalize(along), 3));
}

// Makes rays in turn: at random, along an axis through a triangle's corner, toward a corner (every other one
// of a triangle seen edge-on) and from where another ray was reflected.
static void m6_rays(const VerifyRun *run, const Scene *scene, uint64_t first, const TraceHit *reflected,
                    TraceRay *rays)
{
    for (uint64_t i = first; i < first + M6_RAYS; i++) {
        uint64_t triangle = (uint64_t)(sample_number(69, i, 0) * M6_TRIANGLES);
        Vector3 corner = scene->objects.items[triangle].as.triangle.vertices[i % 3];
        Vector3 origin = vector_scale(sample_unit_vector(69, i, 1), 3), direction = sample_in_cube(69, i, 4);
        if (i % 4 == 0) direction = vector_subtract(direction, origin);
        if (i % 4 == 1) {
            double parts[] = {0, 0, 0};
            parts[i / 4 % 3] = i / 16 % 2 ? 1 : -1;
            direction = vector_from(parts);
            origin = vector_subtract(corner, vector_scale(direction, 3 * sample_number(69, i, 7)));
        }
        if (i % 4 == 2 && i / 4 % 2)
            origin = m6_point_in_plane(scene->objects.items[triangle].as.triangle.vertices, i);
        if (i % 4 == 2) direction = vector_subtract(corner, origin);
        if (i % 4 == 3 && reflected && verify_is_hit(&reflected[i - first - 3])) {
            origin = reflected[i - first - 3].reflected_origin;
            direction = reflected[i - first - 3].reflected_direction;
        }
        rays[i - first] = verify_ray(run, origin, direction);
    }
}

// Checks that the BVH returns the same hits as a test of every object, and that occlusion before a distance
// agrees with the closest hit when tmax is an ulp before the hit and an ulp behind it.
void verify_bvh(VerifyRun *run)
{
    TraceRay *rays = verify_allocate(run, M6_RAYS, sizeof *rays);
    TraceHit *hits = verify_allocate(run, M6_RAYS, sizeof *hits),
             *plain = verify_allocate(run, M6_RAYS, sizeof *plain);
    Scene *scene = m6_scene(run);
    Renderer *tree = verify_open(run, scene, true);
    Renderer *list = verify_open(run, scene, false);
    const double parts[] = {INFINITY, 1 - 2 * verify_roundoff(run), 1 + 2 * verify_roundoff(run)};
    for (uint64_t batch = 0; batch < verify_part(run, M6_BATCHES); batch++) {
        m6_rays(run, scene, batch * M6_RAYS, NULL, rays);
        verify_trace_opened(run, tree, rays, M6_RAYS, hits);
        m6_rays(run, scene, batch * M6_RAYS, hits, rays);
        verify_trace_opened(run, list, rays, M6_RAYS, plain);
        for (size_t cut = 0; cut < COUNT_OF(parts); cut++) {
            for (size_t i = 0; i < M6_RAYS; i++) {
                if (verify_is_hit(&plain[i])) rays[i].tmax = plain[i].t * parts[cut];
                verify_round_ray(run, &rays[i]);
            }
            verify_trace_opened(run, tree, rays, M6_RAYS, hits);
            for (size_t i = 0; i < M6_RAYS; i++) {
                bool hit = verify_is_hit(&plain[i]) && plain[i].t < rays[i].tmax;
                bool same = verify_is_hit(&hits[i]) == hit && hits[i].light == (hit ? 0 : 1);
                run->result->differing += !same || (hit && !verify_same_bits(&hits[i], &plain[i]));
            }
        }
    }
    renderer_close(tree);
    renderer_close(list);
}
