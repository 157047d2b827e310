// Images of ground up to its horizon.
#include "host/verify/checks.h"
#include <math.h>
#include <stdlib.h>

// The first row, from the bottom, whose pixel of the column hits nothing; counts what is hit above it.
static uint32_t column_horizon(VerifyRun *run, const Film *image, uint32_t column)
{
    uint32_t row = image->height;
    while (row > 0 && verify_pixel_found(image, (size_t)(row - 1) * image->width + column))
        row--;
    for (uint32_t above = 0; above < row; above++)
        run->result->wrong += verify_pixel_found(image, (size_t)above * image->width + column);
    return row;
}

typedef struct {
    Quad3 to_eye; // from the center
    Quad radius, power;
} ExactSphere;

// From the bottom up to the horizon the ground's distance never falls, and the horizon is where it is
// exactly.
void verify_ground_horizon(VerifyRun *run)
{
    static const struct {
        double fov;  // in degrees
        double rise; // slope of the way ahead; the horizon's is -sqrt(2e-6)
    } views[] = {{60, 0}, {0.5, 0}, {0.02, -0.0014142}};
    Scene scene = verify_scene("objects:\n  - sphere: {center: [0, -1e6, 0], radius: 1e6}\n");
    const Vector3 eye = {0, 1, 0};
    for (size_t k = 0; k < sizeof views / sizeof *views; k++) {
        scene.camera = verify_camera(eye, (Vector3){0, 1 + views[k].rise, 1}, views[k].fov);
        Film image = verify_render(run, &scene, false, 128, 512);
        VerifyTarget ground = verify_target(run, &scene.objects.items[0], eye);
        for (uint32_t column = 0; column < image.width; column++) {
            uint32_t horizon = column_horizon(run, &image, column), exact = image.height;
            for (uint32_t row = image.height - 1; row > horizon; row--) {
                size_t pixel = (size_t)row * image.width + column;
                run->result->wrong += image.t[pixel - image.width] < image.t[pixel];
            }
            while (exact > 0) {
                size_t pixel = (size_t)(exact - 1) * image.width + column;
                if (!verify_pixel_hit(&ground, &image, pixel).found) break;
                exact--;
            }
            verify_note(run, fabs((double)horizon - (double)exact), 1, "rows");
        }
        film_free(&image);
    }
    scene_free(&scene);
}

// A pixel of a sphere seen from outside, against the sphere as the scene has it, whose numbers need not be
// those of the precision at work: where its ray goes, how far its hit is off the surface, and that the light
// above reaches it.
static void check_sphere_pixel(VerifyRun *run, const ExactSphere *sphere, const Film *image, size_t pixel)
{
    const Quad3 d = quad3(verify_vector(&image->ray[3 * pixel]));
    const Quad a = quad3_dot(d, d), b = quad3_dot(sphere->to_eye, d), c = sphere->power;
    const Quad discriminant = b * b - a * c, radius = sphere->radius;
    // how far the line passes outside the sphere or inside, and the distance at which it touches
    const double beside = fabs((double)(discriminant / (2 * a * radius)));
    const double tangent = (double)quad_root(c);
    const bool is_open = beside <= 16 * verify_roundoff(run) * tangent,
               found = verify_pixel_found(image, pixel);
    if (run->tier == TIER_A || is_open) return;
    run->result->wrong += found != (discriminant >= 0 && b < 0);
    if (!found) return;
    const Quad t = image->t[pixel];
    const Quad off = (c + t * (2 * b + t * a)) / (2 * radius); // the hit's power over the diameter
    const double distance = image->t[pixel] * (double)quad_root(a);
    verify_note_error(run, fabs((double)off) / verify_ulp(run, distance), 4);
    const bool faces_light = sphere->to_eye.y + t * d.y > radius / 64;
    run->result->wrong += faces_light && !(image->color[3 * pixel] > 0);
}

// The eye is 1.75 above a sphere of 2^-20 to 2^60 whose numbers are rounded.
void verify_sphere_sizes(VerifyRun *run)
{
    Scene scene = verify_scene("lights:\n  - directional: {direction: [0, -1, 0]}\n"
                               "objects:\n  - sphere: {center: [0, 0, 0], radius: 1}\n");
    const Vector3 eye = {0.3, 1.75, 0.2};
    for (int exponent = -20; exponent <= 60; exponent += 4) {
        const double radius = ldexp(1.1, exponent);
        const Vector3 center = {0.1, -radius, 0.1};
        scene.objects.items[0].as.sphere.center = center;
        scene.objects.items[0].as.sphere.radius = radius;
        const bool is_ground = exponent > 3;
        scene.camera = verify_camera(eye, is_ground ? vector_add(eye, (Vector3){0.1, -1, 1}) : center,
                                     is_ground ? 100 : atan(radius / 1.75) * (150 / M_PI));
        Film image = verify_render(run, &scene, false, 96, 96);
        const Quad3 to_eye = quad3_subtract(quad3(eye), quad3(center));
        const ExactSphere sphere = {to_eye, radius,
                                    to_eye.x * to_eye.x + to_eye.z * to_eye.z +
                                        (to_eye.y - radius) * (to_eye.y + radius)};
        for (size_t pixel = 0; pixel < film_pixel_count(&image); pixel++)
            check_sphere_pixel(run, &sphere, &image, pixel);
        film_free(&image);
    }
    scene_free(&scene);
}

// Seen horizontally the plane ends in every column at the image's middle, whether that lies on a row of
// pixels or between two.
void verify_plane_horizon(VerifyRun *run)
{
    Scene scene = verify_scene("objects:\n  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n");
    const Vector3 eye = {0, 1.7, 0}, ahead = {0, 1.7, 1};
    scene.camera = verify_camera(eye, ahead, 60);
    for (uint32_t height = 511; height <= 512; height++) {
        Film image = verify_render(run, &scene, false, 512, height);
        for (uint32_t column = 0; column < image.width; column++)
            run->result->wrong += column_horizon(run, &image, column) != (height + 1) / 2;
        film_free(&image);
    }
    scene_free(&scene);
}
