// Images of distant, thin or pointed objects. Each pixel's hit or miss is compared with the exact one for
// the ray that was traced.
#include "host/base/array.h"
#include "host/base/percentile.h"
#include "host/verify/checks.h"
#include <math.h>
#include <stdlib.h>

static const Vector3 origin;

// Checks that no pixel farther from the center is brighter.
static void check_radial_brightness(VerifyRun *run, const Film *image)
{
    const uint32_t side = image->width;
    for (unsigned k = 0; k < 16; k++) {
        double x = cos(k * M_PI / 8), y = sin(k * M_PI / 8), brightness = INFINITY;
        int64_t farthest = -1;
        for (uint32_t step = 0; step < side / 2; step++) {
            int64_t column = (int64_t)floor(side / 2.0 + x * step),
                    row = (int64_t)floor(side / 2.0 + y * step);
            int64_t dx = 2 * column + 1 - side, dy = 2 * row + 1 - side;
            // pixels along the way are not quite on it, so only those farther out than all before count
            if (dx * dx + dy * dy <= farthest) continue;
            farthest = dx * dx + dy * dy;
            double value = image->color[3 * (size_t)(row * side + column)];
            run->result->wrong += value > brightness + 2.0 / 255;
            brightness = fmin(brightness, value);
        }
    }
}

// Checks each pixel, and the 99.9th percentile of errors of Lambert's cosine for light from the eye's side.
static void check_fringe(VerifyRun *run, const Film *image, const VerifyTarget *sphere)
{
    float *errors = verify_allocate(run, film_pixel_count(image), sizeof *errors);
    size_t count = 0;
    for (size_t i = 0; i < film_pixel_count(image); i++) {
        ReferenceHit exact = verify_check_pixel(run, sphere, image, i);
        if (!exact.found || !verify_pixel_found(image, i)) continue;
        double shade = fmax((double)exact.normal.z, 0);
        errors[count++] = (float)fabs(image->color[3 * i] - shade);
    }
    bool near = sphere->distance <= 1e3; // farther away the 8 ulp of t exceed the bound of B
    if (count > 0 && (near || run->tier > TIER_B))
        verify_record(run, percentile_999(errors, count), run->tier == TIER_B ? 2e-3 : 1e-5, "of 1");
}

void verify_far_fringe(VerifyRun *run)
{
    Scene *scene = verify_scene(run, "lights:\n  - directional: {direction: [0, 0, -1]}\n"
                                     "objects:\n  - sphere: {center: [0, 0, 0], radius: 1}\n");
    static const double distances[] = {10, 100, 1e3, 1e4};
    for (size_t k = 0; k < COUNT_OF(distances); k++) {
        const CaseMemory before = run->memory;
        double distance = distances[k];
        const Vector3 eye = {0, 0, distance};
        scene->camera = verify_camera(eye, origin, 2.2 / distance * (180 / M_PI));
        const uint32_t side = run->settings->quick ? 128 : 512;
        Film image = verify_render(run, scene, false, side, side);
        check_radial_brightness(run, &image);
        VerifyTarget sphere = verify_target(run, &scene->objects.items[0], eye);
        if (run->tier != TIER_A) check_fringe(run, &image, &sphere);
        verify_release_since(run, &before);
    }
}

static void check_pixels(VerifyRun *run, const Film *image, const Scene *scene)
{
    VerifyTarget target = verify_target(run, &scene->objects.items[0], scene->camera.position);
    for (size_t i = 0; i < film_pixel_count(image) && run->tier != TIER_A; i++)
        verify_check_pixel(run, &target, image, i);
}

// Checks that every column has one stretch of pixels without a gap.
void verify_wire(VerifyRun *run)
{
    Scene *scene = verify_scene(
        run, "objects:\n  - cylinder: {from: [-10000, 0, 0], to: [10000, 0, 0], radius: 0.001}\n");
    const Vector3 eye = {0, 0, -10};
    scene->camera = verify_camera(eye, origin, 0.293);
    Film image = verify_render(run, scene, false, 1024, 64);
    check_pixels(run, &image, scene);
    for (uint32_t column = 0; column < image.width; column++) {
        size_t stretches = 0;
        for (uint32_t row = 0; row < image.height; row++) {
            size_t pixel = (size_t)row * image.width + column;
            bool above = row > 0 && verify_pixel_found(&image, pixel - image.width);
            stretches += verify_pixel_found(&image, pixel) && !above;
        }
        run->result->leaks += stretches != 1;
    }
}

// Checks that, with the eye on the axis and the light behind it, the tip is as bright as the side around it.
// From the side only finite values are required.
void verify_apex(VerifyRun *run)
{
    static const struct {
        Vector3 eye;
        const char *light;
    } views[] = {{{0, 0, -5}, "[0, 0, 1]"}, {{5, 0, 0}, "[-1, 0, 0]"}};
    enum { SIDE = 65 };
    for (size_t k = 0; k < COUNT_OF(views); k++) {
        Scene *scene = verify_scene(run,
                                    "lights:\n  - directional: {direction: %s}\n"
                                    "objects:\n  - cone: {from: [0, 0, 0], to: [0, 0, 10], radius: [0, 5]}\n",
                                    views[k].light);
        scene->camera = verify_camera(views[k].eye, origin, 0);
        scene->camera.half_tangent = SIDE * 1e-4 / 2 / 5;
        Film image = verify_render(run, scene, false, SIDE, SIDE);
        for (size_t i = 0; i < film_pixel_count(&image); i++) {
            if (k == 0) run->result->wrong += !verify_pixel_found(&image, i) || !(image.color[3 * i] > 0);
            if (!verify_pixel_found(&image, i)) continue;
            const double u = verify_roundoff(run);
            double length = vector_length(vector_from(image.normal + 3 * i));
            const double bound = 4 + (run->inexact ? ROOT_ERROR + QUOTIENT_ERROR : 0);
            verify_record(run, fabs(length - 1) / u, bound, "u");
        }
    }
}

static Scene *torus_scene(VerifyRun *run, double minor)
{
    return verify_scene(
        run, "objects:\n  - torus: {center: [0, 0, 0], axis: [0, 0, 1], major: 1, minor: %g}\n", minor);
}

void verify_far_torus(VerifyRun *run)
{
    static const double distances[] = {10, 50, 1000};
    Scene *scene = torus_scene(run, 0.25);
    for (size_t k = 0; k < COUNT_OF(distances); k++) {
        const Vector3 eye = {0.3 * distances[k], 0.4 * distances[k], -0.866 * distances[k]};
        scene->camera = verify_camera(eye, origin, 0);
        scene->camera.half_tangent = 1.3 / distances[k];
        Film image = verify_render(run, scene, false, 160, 160);
        check_pixels(run, &image, scene);
    }
}

// Checks hits along tangents, where t has little meaning but the point must lie on the torus.
void verify_tangent_circle(VerifyRun *run)
{
    static const double heights[] = {0.25, 0.25 - 0x1p-26, 0.25 + 0x1p-25};
    enum { COUNT = COUNT_OF(heights) };
    if (run->tier == TIER_A) return;
    TraceRay rays[COUNT];
    for (size_t i = 0; i < COUNT; i++)
        rays[i] = verify_ray(run, (Vector3){-5, 0, heights[i]}, (Vector3){1, 0, 0});
    Scene *scene = torus_scene(run, 0.25);
    const TraceHit *hits = verify_trace(run, scene, false, rays, COUNT);
    for (size_t i = 0; i < COUNT; i++) {
        if (!verify_is_hit(&hits[i])) continue;
        Quad3 point = {-5 + (Quad)hits[i].t, 0, rays[i].origin.z};
        ReferenceSurface surface = reference_surface(&scene->objects.items[0], point);
        run->result->off_surface += reference_surface_distance(&surface) > 16 * verify_roundoff(run);
    }
}

// Returns the pixel that stands for the part of the image to which a pixel belongs.
static size_t part_of(size_t *parents, size_t pixel)
{
    while (parents[pixel] != pixel)
        pixel = parents[pixel] = parents[parents[pixel]];
    return pixel;
}

// Returns the number of connected parts of the hit pixels. Pixels that touch at a corner are connected.
static size_t count_parts(VerifyRun *run, const Film *image)
{
    size_t *parents = verify_allocate(run, film_pixel_count(image), sizeof *parents), count = 0;
    for (size_t pixel = 0; pixel < film_pixel_count(image); pixel++) {
        const size_t column = pixel % image->width, row = pixel / image->width;
        parents[pixel] = pixel;
        if (!verify_pixel_found(image, pixel)) continue;
        count++;
        // those around it that come before it
        for (size_t y = row > 0 ? row - 1 : 0; y <= row; y++)
            for (size_t x = column > 0 ? column - 1 : 0; x <= column + 1 && x < image->width; x++) {
                const size_t other = y * image->width + x;
                if (other >= pixel || !verify_pixel_found(image, other)) continue;
                const size_t part = part_of(parents, other);
                count -= part != part_of(parents, pixel);
                parents[part] = part_of(parents, pixel);
            }
    }
    return count;
}

// Checks a ring. At 30 degrees it is half a pixel thick, so the exact image has gaps. In the second image it
// is 1.4 pixels thick and must have none.
void verify_thin_ring(VerifyRun *run)
{
    static const struct {
        double fov;
        uint32_t side;
    } views[] = {{30, 1024}, {17.2, 1536}};
    const Vector3 eye = {0, -5, 5};
    Scene *scene = torus_scene(run, 0.001);
    for (size_t k = run->settings->quick ? 1 : 0; k < COUNT_OF(views); k++) {
        const CaseMemory before = run->memory;
        scene->camera = verify_camera(eye, origin, views[k].fov);
        Film image = verify_render(run, scene, false, views[k].side, views[k].side);
        check_pixels(run, &image, scene);
        if (k == 1) run->result->leaks += count_parts(run, &image) != 1;
        verify_release_since(run, &before);
    }
}
