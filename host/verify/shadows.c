// Images of lit surfaces, which must have no shadow, and of shadows, of which none may be missing.
#include "host/base/array.h"
#include "host/verify/checks.h"
#include <math.h>

// Checks a plane alone in light from barely to steeply above it, near and far from the origin, small and
// large. No pixel may lie in shadow, and all must have one color, the light's cosine with the normal.
void verify_plane_acne(VerifyRun *run)
{
    static const double sizes_places[][2] = {{1, 0}, {1, 1e3}, {1, 1e6}, {1e-4, 0}, {1e-4, 1}, {1e4, 0}};
    static const double elevations[] = {0.01, 1, 45};
    const Vector3 normal = {1, 2, 3}, unit = vector_normalize(normal);
    const Vector3 across = vector_normalize(vector_cross(normal, (Vector3){1, 0, 0}));
    for (size_t k = 0; k < COUNT_OF(sizes_places); k++) {
        double size = sizes_places[k][0], place = sizes_places[k][1];
        Vector3 point = vector_add(vector_scale((Vector3){0.3, -0.2, 0.5}, size),
                                   vector_scale((Vector3){1, -2, 0.5}, place));
        Vector3 eye =
            vector_add(point, vector_add(vector_scale(unit, 3 * size), vector_scale(across, 0.5 * size)));
        for (size_t light = 0; light < COUNT_OF(elevations); light++) {
            const CaseMemory before = run->memory;
            double angle = elevations[light] * (M_PI / 180);
            Scene *scene = verify_scene(run, "lights:\n  - directional: {direction: [0, 0, 1]}\n"
                                             "objects:\n  - plane: {point: [0, 0, 0], normal: [1, 2, 3]}\n");
            Vector3 to_light = vector_add(vector_scale(across, cos(angle)), vector_scale(unit, sin(angle)));
            scene->lights.items[0].direction = vector_scale(to_light, -1);
            scene->objects.items[0].as.plane.point = point;
            scene->camera = verify_camera(eye, point, 60);
            Film image = verify_render(run, scene, false, 128, 128);
            Vector3 direction = vector_normalize(scene->lights.items[0].direction);
            Quad3 stored = quad3(verify_rounded_vector(run, direction));
            Quad cosine = -quad3_dot(quad3_unit(quad3(normal)), stored);
            double darkest = INFINITY, brightest = 0;
            for (size_t i = 0; i < film_pixel_count(&image); i++) {
                run->result->leaks += image.object[i] != 0;
                run->result->wrong += image.shadow[i] != 0;
                darkest = fmin(darkest, image.color[3 * i]);
                brightest = fmax(brightest, image.color[3 * i]);
            }
            run->result->wrong += !(darkest > 0);
            verify_record_ulps(run, brightest - darkest, brightest, 0);
            const double u = verify_roundoff(run);
            verify_record(
                run,
                (double)quad_maximum(quad_absolute(brightest - cosine), quad_absolute(darkest - cosine)) / u,
                8, "u");
            verify_release_since(run, &before);
        }
    }
}

// Checks a plate a millionth as thick as wide, lit from one side. That side is lit and the other is dark.
void verify_thin_plate(VerifyRun *run)
{
    Scene *scene = verify_scene(run, "lights:\n  - point: {position: [0.5, 0.5, -2]}\n"
                                     "  - directional: {direction: [0.1, 0.2, 1]}\n"
                                     "objects:\n  - box: {min: [0, 0, 0], max: [1, 1, 1e-6]}\n");
    static const struct {
        bool above, light_above;
    } sides[] = {{false, false}, {true, false}, {false, true}, {true, true}};
    for (size_t k = 0; k < COUNT_OF(sides); k++) {
        const bool above = sides[k].above, light_above = sides[k].light_above;
        const Vector3 eye = {0.5, 0.5, above ? 2 : -2}, center = {0.5, 0.5, 0};
        scene->camera = verify_camera(eye, center, 40);
        scene->lights.items[0].position.z = light_above ? 2 : -2;
        scene->lights.items[1].direction.z = light_above ? -1 : 1;
        Film image = verify_render(run, scene, false, 256, 256);
        size_t seen = 0;
        for (size_t i = 0; i < film_pixel_count(&image); i++) {
            if (image.object[i] == UINT32_MAX) continue;
            seen++;
            const double *color = image.color + 3 * i;
            if (above == light_above)
                run->result->wrong += !(color[0] > 0) || image.shadow[2 * i] || image.shadow[2 * i + 1];
            else
                run->result->leaks += color[0] != 0 || !image.shadow[2 * i] || !image.shadow[2 * i + 1];
        }
        run->result->wrong += seen == 0;
    }
}

// Counts a pixel that does not show the nearer of plane 0 and sphere 1. Skips the sphere's rim and places
// where the two are equally far.
static void check_nearest(VerifyRun *run, uint32_t object, const ReferenceHit *plane,
                          const ReferenceHit *sphere)
{
    const double open = 1e-5;
    if (sphere->margin < open) return;
    if (sphere->found && plane->found && quad_absolute(sphere->t - plane->t) < open * plane->t) return;
    bool sphere_first = sphere->found && (!plane->found || sphere->t < plane->t);
    uint32_t nearest = sphere_first ? 1 : plane->found ? 0 : UINT32_MAX;
    run->result->leaks += object == UINT32_MAX && nearest != UINT32_MAX;
    run->result->wrong += object != UINT32_MAX && object != nearest;
}

// Checks a sphere on a plane, lit from above. Its shadow is a disc with an exactly known radius, up to the
// point where they touch.
void verify_contact_shadow(VerifyRun *run)
{
    static const struct {
        Vector3 eye;
        double fov;
    } views[] = {{{3, 2, 3}, 60}, {{3, 0.001, 3}, 0.5}, {{0.2, 0.02, 0.2}, 40}};
    const Vector3 touched = {0, 0, 0}, light = {0, 10, 0};
    const double edge = 10 / sqrt(80);
    Scene *scene = verify_scene(run, "lights:\n  - point: {position: [0, 10, 0]}\n"
                                     "objects:\n  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
                                     "  - sphere: {center: [0, 1, 0], radius: 1}\n");
    size_t dark_count = 0, lit_count = 0;
    for (size_t k = 0; k < COUNT_OF(views); k++) {
        const Vector3 eye = views[k].eye;
        scene->camera = verify_camera(eye, touched, views[k].fov);
        Film image = verify_render(run, scene, false, 384, 384);
        Quad3 to_light = quad3(vector_subtract(light, eye)), ground = quad3(vector_subtract(touched, eye));
        VerifyTarget targets[] = {verify_target(run, &scene->objects.items[0], eye),
                                  verify_target(run, &scene->objects.items[1], eye)};
        for (size_t i = 0; i < film_pixel_count(&image); i++) {
            Quad3 direction = quad3(vector_from(image.ray + 3 * i));
            bool dark = image.shadow[i];
            ReferenceHit plane = verify_pixel_hit(&targets[0], &image, i);
            ReferenceHit sphere = verify_pixel_hit(&targets[1], &image, i);
            check_nearest(run, image.object[i], &plane, &sphere);
            if (image.object[i] != UINT32_MAX) {
                run->result->wrong += dark != !(image.color[3 * i] > 0);
                *(dark ? &dark_count : &lit_count) += 1;
            }
            if (image.object[i] == 0 && plane.found) {
                Vector3 p = quad3_rounded(quad3_subtract(quad3_scale(direction, plane.t), ground));
                double radius = hypot(p.x, p.z);
                run->result->leaks += !dark && radius < edge * (1 - 1e-5);
                run->result->wrong += dark && radius > edge * (1 + 1e-5);
            } else if (image.object[i] == 1 && sphere.found) {
                Quad3 p = quad3_scale(direction, sphere.t);
                Quad facing = quad3_dot(sphere.normal, quad3_unit(quad3_subtract(to_light, p)));
                run->result->wrong += quad_absolute(facing) > 1e-5 && dark != (facing < 0);
            }
        }
    }
    run->result->wrong += dark_count < 100000 || lit_count < 100000; // of 442,368 pixels
}
