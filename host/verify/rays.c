#include "host/verify/rays.h"

#include "host/base/array.h"
#include "host/verify/checks.h"
#include <math.h>
#include <string.h>

enum { BATCH = 1 << 16 };

Scene *verify_rays_scene(VerifyRun *run, const VerifyRays *set)
{
    if (!set->scene_make) return verify_scene(run, "objects:\n%s", set->objects);
    Scene *scene = verify_empty_scene(run);
    set->scene_make(scene);
    return scene;
}

static double neighbor_toward(const VerifyRun *run, double value, double toward)
{
    return verify_is_double(run) ? nextafter(value, toward) : (double)nextafterf((float)value, (float)toward);
}

// Adds the ray and its neighbors. A component of 0 is not changed because its neighbors are subnormal.
static void test_ray_add(VerifyTestRays *tests, const VerifyRun *run, const VerifyRays *set,
                         const VerifyRay *given)
{
    VerifyTestRay item = {{given->origin, given->direction, given->tmin, INFINITY}, *given};
    verify_round_ray(run, &item.ray);
    if (!item.required.exact_tiers) item.required.exact_tiers = set->exact_tiers;
    if (!item.required.limits) item.required.limits = set->limits;
    array_push(*tests, item);
    item.required.exact_tiers = NULL;
    double *const moved[] = {&item.ray.origin.x, &item.ray.direction.x};
    for (size_t k = 0; k < 2; k++) {
        double x = *moved[k];
        if (x == 0) continue;
        *moved[k] = neighbor_toward(run, x, copysign(INFINITY, x));
        array_push(*tests, item);
        *moved[k] = neighbor_toward(run, x, 0);
        array_push(*tests, item);
        *moved[k] = x;
    }
}

void verify_family(const VerifyRun *run, RayFamily family, uint64_t first, size_t count, TraceRay *rays)
{
    for (size_t i = 0; i < count; i++) {
        rays[i] = family(first + i);
        verify_round_ray(run, &rays[i]);
    }
}

VerifyTestRays verify_test_rays(VerifyRun *run, const VerifyRays *set)
{
    VerifyTestRays tests = {0};
    for (size_t i = 0; set->rays && i < set->ray_count; i++)
        test_ray_add(&tests, run, set, &set->rays[i]);
    for (size_t i = 0; set->family && i < set->checked_count; i++) {
        VerifyTestRay item = {.required = {.exact_tiers = set->exact_tiers, .limits = set->limits}};
        verify_family(run, set->family, i, 1, &item.ray);
        array_push(tests, item);
    }
    array_push(run->memory.blocks, tests.items);
    return tests;
}

static void check_surface(VerifyRun *run, const Object *objects, const TraceRay *ray, const TraceHit *hit)
{
    // in these scenes an object's id is its place in the list
    if (verify_is_hit(hit)) verify_check_surface(run, &objects[hit->object], ray, hit);
}

// Checks a table of rays, including that hits do not depend on the order of the rays.
static void run_numbers(VerifyRun *run, const VerifyRays *set, const Scene *scene)
{
    VerifyTestRays tests = verify_test_rays(run, set);
    Object *objects = verify_objects(run, scene);
    const size_t count = tests.count;
    TraceRay *rays = verify_allocate(run, 2 * count, sizeof *rays), *turned = rays + count;
    for (size_t i = 0; i < count; i++)
        rays[i] = turned[count - 1 - i] = tests.items[i].ray;
    const TraceHit *hits = verify_trace(run, scene, false, rays, count);
    const TraceHit *turned_hits = verify_trace(run, scene, true, turned, count);
    for (size_t i = 0; i < count; i++) {
        verify_check_ray(run, objects, scene->objects.count, &tests.items[i], &hits[i]);
        check_surface(run, objects, &rays[i], &hits[i]);
        run->result->differing += !verify_same_bits(&hits[i], &turned_hits[count - 1 - i]);
    }
}

static void run_family(VerifyRun *run, const VerifyRays *set, const Scene *scene)
{
    VerifyTestRays tests = verify_test_rays(run, set);
    Object *objects = verify_objects(run, scene);
    TraceRay *rays = verify_allocate(run, BATCH, sizeof *rays);
    TraceHit *hits = verify_allocate(run, BATCH, sizeof *hits);
    Renderer *opened = verify_open(run, scene, set->scene_make != NULL);
    const size_t ray_count = verify_part(run, set->ray_count);
    for (size_t first = 0; first < ray_count; first += BATCH) {
        size_t count = ray_count - first < BATCH ? ray_count - first : BATCH;
        verify_family(run, set->family, first, count, rays);
        verify_trace_opened(run, opened, rays, count, hits);
        for (size_t i = 0; i < count; i++) {
            run->result->leaks += set->closed && !verify_is_hit(&hits[i]);
            if (first + i < tests.count)
                verify_check_ray(run, objects, scene->objects.count, &tests.items[first + i], &hits[i]);
            check_surface(run, objects, &rays[i], &hits[i]);
        }
    }
    renderer_close(opened);
}

void verify_rays_run(VerifyRun *run, const VerifyRays *set)
{
    Scene *scene = verify_rays_scene(run, set);
    (set->rays ? run_numbers : run_family)(run, set, scene);
}
