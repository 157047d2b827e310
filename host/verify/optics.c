// Checks of refraction and of the camera's frame.
#include "host/base/array.h"
#include "host/compile/camera_basis.h"
#include "host/verify/run.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { AROUND = 2048, STEEP = 24, ANGLES = 2 * AROUND + 1 + STEEP };

// Makes rays from inside glass of index 1.5 through z = 0, with sines around the critical 2/3 and near 1.
static void angles_make(const VerifyRun *run, TraceRay *rays)
{
    for (int i = 0; i < ANGLES; i++) {
        int j = i - 2 * AROUND;
        double sine = j <= 0 ? 2.0 / 3 + (i - AROUND) * 0x1p-24 : 1 - ldexp(1, -j);
        const Vector3 direction = {sine, 0, sqrt((1 - sine) * (1 + sine))};
        rays[i] = verify_ray(run, (Vector3){0, 0, -1}, direction);
    }
}

// Checks for total reflection where the squared cosine behind the surface is negative, except within 16 u.
void verify_critical_angle(VerifyRun *run)
{
    TraceRay *rays = verify_allocate(run, ANGLES, sizeof *rays);
    angles_make(run, rays);
    Scene *scene =
        verify_scene(run, "materials:\n  glass: {transmission: 1, ior: 1.5}\n"
                          "objects:\n  - plane: {point: [0, 0, 0], normal: [0, 0, 1], material: glass}\n");
    const TraceHit *hits = verify_trace(run, scene, false, rays, ANGLES);
    const double u = verify_roundoff(run);
    for (size_t i = 0; i < ANGLES; i++) {
        const Vector3 refracted = hits[i].refracted_direction;
        if (!verify_is_hit(&hits[i])) {
            run->result->leaks++;
            continue;
        }
        run->result->unsound += hits[i].transmission != 0 && hits[i].transmission != 1;
        if (run->tier == TIER_A) continue;
        long double x = rays[i].direction.x, z = rays[i].direction.z;
        double squared = (double)(1 - 2.25L * (x * x) / (x * x + z * z));
        if (fabs(squared) <= 16 * u) continue;
        bool total = hits[i].transmission == 0;
        if (total != (squared < 0)) {
            run->result->wrong++;
            continue;
        }
        if (total) continue;
        run->result->unsound += fabs(vector_length(refracted) - 1) > 4 * u;
        double cosine = sqrt(squared), bound = 8 * u / cosine;
        verify_record_ulps(run, fabs(refracted.z - cosine), cosine, bound / verify_ulp(run, cosine));
    }
}

static bool is_camera_refused(const char *camera)
{
    char text[200];
    snprintf(text, sizeof text, "camera: {%s}\nobjects: []\n", camera);
    return verify_is_refused(text);
}

static bool is_orthonormal(const Vector3 axes[3])
{
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j <= i; j++) {
            double product = vector_dot(vector_normalize(axes[i]), vector_normalize(axes[j]));
            if (!(fabs(product - (i == j)) <= 1e-6)) return false;
        }
    return true;
}

// Checks that cameras with a useless `up` get a frame, and that cameras that see nothing are refused.
void verify_camera_frames(VerifyRun *run)
{
    static const char *const refused[] = {
        "position: [1, 2, 3], look_at: [1, 2, 3], fov: 40",
        "position: [0, 0, 0], look_at: [0, 0, 1], fov: 0",
        "position: [0, 0, 0], look_at: [0, 0, 1], fov: 180",
        "position: [0, 0, 0], look_at: [0, 0, 1], fov: -20",
        "position: [0, 0, 0], look_at: [0, 0, 1], fov: .nan",
        "position: [0, .nan, 0], look_at: [0, 0, 1], fov: 40",
    };
    static const Camera cameras[] = {
        {.look_at = {0, -1, 0}, .up = {0, 1, 0}, .half_tangent = 1},
        {.look_at = {0, 1, 0}, .up = {0, 1, 0}, .half_tangent = 1},
        {.look_at = {3, 4, 5}, .up = {6, 8, 10}, .half_tangent = 1},
        {.look_at = {3, 4, 5}, .up = {-3, -4, -5}, .half_tangent = 1},
        {.look_at = {0, 0, 1}, .half_tangent = 1},
        {.look_at = {0, -1, 0}, .up = {1e-7, 1, 0}, .half_tangent = 1},
        {.look_at = {0, -1, 0}, .up = {1e-14, 1, 0}, .half_tangent = 1},
        {.look_at = {0, 0, 1}, .up = {0, 1, 0}, .half_tangent = 8.7e-6},
        {.look_at = {0, 0, 1}, .up = {0, 1, 0}, .half_tangent = 1146},
        {.position = {1e7, 1e7, 1e7}, .look_at = {1e7, 1e7 + 1, 1e7}, .up = {0, 1, 0}, .half_tangent = 1},
        {.look_at = {1e-30, 0, 0}, .up = {0, 1e30, 0}, .half_tangent = 1},
        {.look_at = {0, 0, 1e30}, .up = {0, 1e-30, 0}, .half_tangent = 1},
        {.look_at = {0, 0, 3}, .up = {0, 1e300, 0}, .half_tangent = 1},
        {.look_at = {0, 0, 3}, .up = {0, 1e-300, 0}, .half_tangent = 1},
    };
    for (size_t i = 0; i < COUNT_OF(refused); i++)
        run->result->wrong += !is_camera_refused(refused[i]);
    for (size_t i = 0; i < COUNT_OF(cameras); i++) {
        const CameraBasis basis = camera_basis(&cameras[i], 640, 480);
        const Vector3 axes[3] = {basis.forward, basis.right, basis.up};
        run->result->unsound += !is_orthonormal(axes);
    }
}
