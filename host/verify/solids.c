// Checks of spheres and boxes that are not in the tables.
#include "host/base/array.h"
#include "host/verify/checks.h"
#include "host/verify/families.h"
#include "host/verify/run.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Checks that a direction 2^20 times as long or as short gives the same hits, at distances exactly as many
// times shorter or longer.
void verify_scaled_directions(VerifyRun *run)
{
    enum { COUNT = 100 };
    static const int exponents[] = {0, 20, -20};
    TraceRay rays[3][COUNT];
    for (uint64_t i = 0; i < COUNT; i++) {
        Vector3 origin = vector_scale(sample_unit_vector(61, i, 0), i % 2 ? 0.7 : 3);
        Vector3 target = vector_scale(sample_unit_vector(61, i, 3), 0.9);
        rays[0][i] = verify_ray(run, origin, vector_subtract(target, origin));
        for (size_t k = 1; k < 3; k++) {
            rays[k][i] = rays[0][i];
            rays[k][i].direction = vector_scale(rays[0][i].direction, ldexp(1, exponents[k]));
        }
    }
    Scene *scene = verify_scene(run, "objects:\n  - sphere: {center: [0, 0, 0], radius: 1}\n");
    const TraceHit *hits = verify_trace(run, scene, false, rays[0], 3 * (size_t)COUNT);
    for (size_t i = 0; i < COUNT; i++) {
        run->result->wrong += !verify_is_hit(&hits[i]);
        for (size_t k = 1; k < 3; k++)
            run->result->differing += ldexp(hits[k * COUNT + i].t, exponents[k]) != hits[i].t;
    }
}

enum { SPHERES = 50, GROUPS = 20, DIRECTIONS = 500 };

// Returns spheres whose radii and centers span eight powers of ten.
static Scene *spheres_of_all_sizes(VerifyRun *run, unsigned group)
{
    Scene *scene = verify_empty_scene(run);
    for (uint64_t i = 0; i < SPHERES; i++) {
        uint64_t index = group * SPHERES + i;
        Object object = {.type = SHAPE_SPHERE};
        for (unsigned k = 0; k < 3; k++) {
            double size = pow(10, 4 * sample_symmetric(62, index, k));
            (&object.as.sphere.center.x)[k] =
                verify_rounded(run, sample_number(62, index, 3 + k) < 0.5 ? size : -size);
        }
        object.as.sphere.radius = verify_rounded(run, pow(10, 4 * sample_symmetric(62, index, 6)));
        array_push(scene->objects, object);
    }
    return scene;
}

// Returns the far crossing of a ray from inside, or NAN if it starts outside or runs along the surface.
static double sphere_exit(const Object *sphere, const TraceRay *ray)
{
    const ReferenceRay reference_ray = verify_reference_ray(ray);
    const ReferenceHit hit = reference_hit_object(sphere, &reference_ray);
    if (!hit.found || hit.entering || hit.cosine < 0.1L) return NAN;
    return (double)hit.t;
}

// Makes a ray to each sphere from outside.
static void rays_at_spheres(const VerifyRun *run, const Scene *scene, unsigned group, TraceRay rays[SPHERES])
{
    for (uint64_t i = 0; i < SPHERES; i++) {
        uint64_t index = group * SPHERES + i;
        Vector3 center = scene->objects.items[i].as.sphere.center;
        double radius = scene->objects.items[i].as.sphere.radius;
        double away = radius * (1 + pow(10, 2 * sample_symmetric(63, index, 0)));
        Vector3 origin = vector_add(center, vector_scale(sample_unit_vector(63, index, 1), away));
        double off = 0.9 * radius * sample_number(63, index, 4);
        Vector3 target = vector_add(center, vector_scale(sample_unit_vector(63, index, 5), off));
        rays[i] = verify_ray(run, origin, vector_subtract(target, origin));
    }
}

// Traces rays from where the first ray hit the sphere. Half of them leave it and must not hit it again. The
// others enter it and must reach its far side.
static void leave_sphere(VerifyRun *run, const Scene *scene, Renderer *opened, size_t sphere,
                         const TraceHit *first)
{
    TraceRay rays[2 * DIRECTIONS];
    TraceHit hits[2 * DIRECTIONS];
    for (uint64_t i = 0; i < DIRECTIONS; i++) {
        Vector3 direction = sample_unit_vector(64, sphere * DIRECTIONS + i, 0);
        if (vector_dot(direction, first->normal) < 0) direction = vector_scale(direction, -1);
        rays[i] = verify_ray(run, first->reflected_origin, direction);
        rays[DIRECTIONS + i] = verify_ray(run, first->refracted_origin, vector_scale(direction, -1));
    }
    verify_trace_opened(run, opened, rays, 2 * (size_t)DIRECTIONS, hits);
    for (size_t i = 0; i < DIRECTIONS; i++) {
        run->result->wrong += hits[i].object == sphere;
        double exit = sphere_exit(&scene->objects.items[sphere], &rays[DIRECTIONS + i]);
        const TraceHit *far = &hits[DIRECTIONS + i];
        if (isnan(exit)) continue;
        run->result->leaks += !verify_is_hit(far);
        if (far->object != sphere) continue;
        if (run->tier == TIER_A)
            run->result->wrong += far->t < exit / 2;
        else
            verify_record_ulps(run, fabs(far->t - exit), exit, 16);
    }
}

void verify_leaving_spheres(VerifyRun *run)
{
    for (unsigned group = 0; group < verify_part(run, GROUPS); group++) {
        TraceRay rays[SPHERES];
        TraceHit hits[SPHERES];
        Scene *scene = spheres_of_all_sizes(run, group);
        rays_at_spheres(run, scene, group, rays);
        Renderer *opened = verify_open(run, scene, false);
        verify_trace_opened(run, opened, rays, SPHERES, hits);
        for (size_t i = 0; i < SPHERES; i++)
            if (hits[i].object == i) leave_sphere(run, scene, opened, i, &hits[i]);
        renderer_close(opened);
    }
}

// Checks that each hit point lies exactly on the face whose normal is reported.
void verify_points_on_faces(VerifyRun *run)
{
    enum { COUNT = 30000 };
    if (run->tier == TIER_A) return;
    TraceRay *rays = verify_allocate(run, COUNT, sizeof *rays);
    verify_family(run, family_in_room, 0, COUNT, rays);
    Scene *scene = verify_scene(run, "objects:\n  - box: {min: [-1, -1, -1], max: [1, 1, 1]}\n");
    const TraceHit *hits = verify_trace(run, scene, false, rays, COUNT);
    for (size_t i = 0; i < COUNT; i++) {
        if (!verify_is_hit(&hits[i])) continue;
        size_t on_face = 0;
        for (size_t axis = 0; axis < 3; axis++)
            if (fabs((&hits[i].normal.x)[axis]) == 1) on_face += fabs((&hits[i].position.x)[axis]) == 1;
        run->result->wrong += on_face != 1;
    }
}

// Checks that among objects at the same distance the first in the list is hit, and that the distance does
// not depend on the list's order. A scene of each object alone gives that distance.
void verify_coincident_faces(VerifyRun *run)
{
    enum { COUNT = 1200, COINCIDENT = 6 };
    TraceRay *rays = verify_allocate(run, COUNT, sizeof *rays);
    const TraceHit *alone[COINCIDENT];
    for (uint64_t i = 0; i < COUNT; i++) {
        Vector3 origin = {0.5, sample_number(7, i, 0), sample_number(7, i, 1)}, direction = {1, 0, 0};
        if (i % 2)
            direction =
                vector_subtract((Vector3){2 * sample_number(7, i, 2), 0, sample_number(7, i, 3)}, origin);
        rays[i] = verify_ray(run, origin, direction);
    }
    Scene *scene =
        verify_scene(run, "objects:\n"
                          "  - box: {min: [0, 0, 0], max: [1, 1, 1]}\n"
                          "  - box: {min: [1, 0, 0], max: [2, 1, 1]}\n"
                          "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
                          "  - triangle: {vertices: [[-1, 0.25, 0.25], [3, 0.25, 0.25], [1, 0.25, 2]]}\n"
                          "  - triangle: {vertices: [[0, 0.25, 0], [2, 0.25, 0.5], [0, 0.25, 3]]}\n"
                          "  - disc: {center: [1, 0.5, 0.5], normal: [1, 0, 0], radius: 0.75}\n");
    Object objects[COINCIDENT];
    memcpy(objects, scene->objects.items, sizeof objects);
    scene->objects.count = 1;
    for (size_t k = 0; k < COINCIDENT; k++) {
        scene->objects.items[0] = objects[k];
        alone[k] = verify_trace(run, scene, false, rays, COUNT);
    }
    scene->objects.count = COINCIDENT;
    for (size_t order = 0; order < 2 * (size_t)COINCIDENT; order++) {
        size_t place_of[COINCIDENT];
        for (size_t k = 0; k < COINCIDENT; k++) {
            place_of[k] = (order < COINCIDENT ? k + order : COINCIDENT - 1 - k + order) % COINCIDENT;
            scene->objects.items[k] = objects[place_of[k]];
        }
        const TraceHit *hits = verify_trace(run, scene, order % 2, rays, COUNT);
        for (size_t i = 0; i < COUNT; i++) {
            uint32_t nearest = UINT32_MAX;
            double t = INFINITY;
            for (uint32_t k = 0; k < COINCIDENT; k++) {
                const TraceHit *hit = &alone[place_of[k]][i];
                if (!verify_is_hit(hit) || hit->t >= t) continue;
                nearest = k;
                t = hit->t;
            }
            run->result->differing += hits[i].object != nearest || (nearest != UINT32_MAX && hits[i].t != t);
        }
    }
    for (size_t i = 0; i < COUNT; i += 2)
        run->result->wrong += alone[0][i].t != 0.5 || alone[1][i].t != 0.5;
}
