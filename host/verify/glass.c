// Images and rays through glass.
#include "host/base/array.h"
#include "host/verify/checks.h"
#include "host/verify/families.h"
#include <math.h>
#include <stdlib.h>

// Returns the signature of the light transport path that passes through each object of a list and ends at
// the last, by the rule in kernels/types.h.
static uint32_t passed_path(const uint32_t *objects, size_t count)
{
    uint32_t path = PATH_START;
    for (size_t i = 0; i < count; i++)
        path = (path ^ ((objects[i] + 1) * PATH_EVENTS + (i + 1 < count ? PATH_REFRACTED : 0))) * PATH_FACTOR;
    return path;
}

// Checks a red sphere in a coat of glass thinner than most epsilons. At any scale only the inner sphere is
// visible through the glass.
void verify_nested_spheres(VerifyRun *run)
{
    static const double ratios[] = {1 + 4e-5, 1 + 0x1p-16}, scales[] = {1, 1000, 0.001};
    const uint32_t sphere_then_coat[] = {1, 0};
    const uint32_t expected = passed_path(sphere_then_coat, 2);
    for (size_t k = 0; k < COUNT_OF(ratios) * COUNT_OF(scales); k++) {
        const double ratio = ratios[k / COUNT_OF(scales)], scale = scales[k % COUNT_OF(scales)];
        Scene *scene =
            verify_scene(run, "ambient: [1, 1, 1]\n"
                              "materials:\n  red: {color: [1, 0, 0]}\n"
                              "  glass: {transmission: 1, ior: 1.5, diffuse: 0, ambient: 0}\n"
                              "objects:\n  - sphere: {center: [0, 0, 0], radius: 1, material: red}\n"
                              "  - sphere: {center: [0, 0, 0], radius: 1, material: glass}\n");
        scene->objects.items[0].as.sphere.radius = scale;
        scene->objects.items[1].as.sphere.radius = scale * ratio;
        const Vector3 eye = {1.5 * scale, 2 * scale, 2.5 * scale}, center = {0, 0, 0};
        scene->camera = verify_camera(eye, center, 40);
        Film image = verify_render(run, scene, false, 192, 192);
        VerifyTarget coat = verify_target(run, &scene->objects.items[1], eye);
        size_t seen = 0;
        for (size_t i = 0; i < film_pixel_count(&image); i++) {
            if (image.object[i] != 1) {
                // at the rim a ray may miss the coat, but it must not see the sphere without it
                ReferenceHit exact = verify_pixel_hit(&coat, &image, i);
                bool certain = exact.found && exact.margin > 1e-5 * coat.feature_radius;
                run->result->wrong += image.object[i] != UINT32_MAX || certain;
                continue;
            }
            seen++;
            run->result->wrong += image.path[i] != expected;
        }
        run->result->wrong += seen == 0;
    }
}

static Scene *matched_scene(VerifyRun *run, const char *object)
{
    Scene *scene =
        verify_scene(run,
                     "background: [0.2, 0.3, 0.4]\nambient: [0.1, 0.1, 0.1]\n"
                     "lights:\n  - point: {position: [-3, 4, -6]}\n"
                     "materials:\n  tiles: {checker: {colors: [[1, 1, 1], [0.1, 0.1, 0.1]], size: 0.5}}\n"
                     "  glass: {transmission: 1, ior: 1, diffuse: 0, ambient: 0}\n"
                     "objects:\n  - plane: {point: [0, 0, 5], normal: [0, 0, -1], material: tiles}\n%s",
                     object);
    const Vector3 eye = {0, 0, -5}, ahead = {0, 0, 5};
    scene->camera = verify_camera(eye, ahead, 30);
    return scene;
}

static const char *const matched[] = {
    "  - sphere: {center: [0, 0, 0], radius: 1, material: glass}\n",
    "  - box: {min: [-0.9, -0.8, -0.7], max: [0.7, 0.8, 0.9], material: glass}\n"};

// Returns the distance of a pixel's hit point from the nearest edge between tiles, in pixels.
static double edge_distance(const Film *empty, size_t pixel)
{
    const double *d = &empty->ray[3 * pixel];
    double nearest = INFINITY, step = 2 * tan(15 * (M_PI / 180)) * 10 / empty->height;
    for (size_t axis = 0; axis < 2; axis++) {
        double place = d[axis] / d[2] * 10 / 0.5;
        nearest = fmin(nearest, fabs(place - round(place)) * 0.5 / step);
    }
    return nearest;
}

// Checks that rays into a closed body of index 1 leave it and keep their direction.
static void check_straight_rays(VerifyRun *run, const char *object, unsigned seed)
{
    enum { COUNT = 20000 };
    TraceRay *rays = verify_allocate(run, COUNT, sizeof *rays),
             *inner = verify_allocate(run, COUNT, sizeof *inner);
    TraceHit *first = verify_allocate(run, COUNT, sizeof *first),
             *second = verify_allocate(run, COUNT, sizeof *second);
    for (uint64_t i = 0; i < COUNT; i++) {
        Vector3 from = vector_scale(sample_unit_vector(seed, i, 0), 4);
        Vector3 at = vector_scale(sample_unit_vector(seed, i, 3), sample_number(seed, i, 6));
        rays[i] = verify_ray(run, from, vector_normalize(vector_subtract(at, from)));
    }
    Scene *scene = matched_scene(run, object);
    scene->objects.items[0].as.plane.point.z = 1e6; // out of the way
    Renderer *opened = verify_open(run, scene, false);
    verify_trace_opened(run, opened, rays, COUNT, first);
    for (size_t i = 0; i < COUNT; i++) {
        inner[i] = rays[i];
        if (first[i].object == 1)
            inner[i] = verify_ray(run, first[i].refracted_origin, first[i].refracted_direction);
    }
    verify_trace_opened(run, opened, inner, COUNT, second);
    renderer_close(opened);
    size_t entered = 0;
    for (size_t i = 0; i < COUNT; i++) {
        if (first[i].object != 1) continue;
        Quad3 d = quad3_unit(quad3(rays[i].direction));
        if (quad_absolute(quad3_dot(d, quad3(first[i].normal))) < 1e-4) continue;
        entered++;
        if (second[i].object != 1) {
            run->result->leaks++;
            continue;
        }
        Quad3 refracted = quad3(second[i].refracted_direction);
        Vector3 off = quad3_rounded(quad3_subtract(refracted, d));
        // two cosines have a root each, and a unit vector has a root and a quotient
        double bound = 4 + (run->inexact ? 3 * ROOT_ERROR + QUOTIENT_ERROR : 0);
        verify_record(run, vector_largest(off) / verify_roundoff(run), bound, "u");
    }
    // most of the targets lie within the body
    run->result->wrong += entered < COUNT / 2;
}

// Checks that glass of index 1 is invisible.
void verify_matched_glass(VerifyRun *run)
{
    Scene *without = matched_scene(run, "");
    Film empty = verify_render(run, without, false, 256, 256);
    for (unsigned k = 0; k < COUNT_OF(matched); k++) {
        const CaseMemory before = run->memory;
        Scene *scene = matched_scene(run, matched[k]);
        Film image = verify_render(run, scene, false, 256, 256);
        size_t through = 0;
        for (size_t i = 0; i < film_pixel_count(&image); i++) {
            through += image.object[i] == 1;
            if (edge_distance(&empty, i) < 1e-3) continue;
            for (size_t c = 3 * i; c < 3 * i + 3; c++)
                verify_record(run, fabs(image.color[c] - empty.color[c]), 1e-5, "of 1");
        }
        run->result->wrong += through == 0;
        check_straight_rays(run, matched[k], 71 + k);
        verify_release_since(run, &before);
    }
}
