// The state and the functions that the hard cases share.
#pragma once

#include "host/base/array.h"
#include "host/verify/verify.h"

// The memory that a case has allocated.
typedef struct {
    ARRAY_OF(void *) blocks;
    ARRAY_OF(Scene *) scenes;
    ARRAY_OF(Film) films;
} CaseMemory;

// The largest errors of quotients and roots that OpenCL C allows, 2 and 3 ulp, in units of roundoff.
enum { QUOTIENT_ERROR = 4, ROOT_ERROR = 6 };

typedef struct {
    Compute *compute;
    const VerifySettings *settings;
    VerifyTier tier;
    bool inexact; // quotients and roots are off by as much as OpenCL C allows
    VerifyResult *result;
    VerifyKernels *kernels;
    CaseMemory memory;
    // The renderers of the last scenes of verify_trace and verify_render, or NULL. The next scene reuses
    // them with their kernels, because loading kernels takes longer than most scenes.
    Renderer *ray_renderer, *image_renderer;
} VerifyRun;

// The checks of a case that are not in the tables. Each counts its faults in the run's result.
typedef void VerifyCheck(VerifyRun *run);

// The checks of rays, and of the cameras of R8. The table in verify.c names the case of each check.
VerifyCheck verify_scaled_directions, verify_leaving_spheres, verify_points_on_faces, verify_coincident_faces,
    verify_far_mesh, verify_scale_ladder, verify_within_triangle, verify_facing_triangle,
    verify_degenerate_meshes, verify_bvh, verify_instances, verify_critical_angle, verify_camera_frames;
// The checks of images.
VerifyCheck verify_far_fringe, verify_wire, verify_apex, verify_far_torus, verify_tangent_circle,
    verify_thin_ring, verify_ground_horizon, verify_plane_horizon, verify_sizes, verify_plane_acne,
    verify_thin_plate, verify_contact_shadow, verify_nested_spheres, verify_matched_glass, verify_highlights,
    verify_scaled_scenes, verify_mirrored_scenes, verify_degenerate_views;

static inline bool verify_is_double(const VerifyRun *run)
{
    return run->tier == TIER_D;
}

// Allocates memory for the duration of the case.
void *verify_allocate(VerifyRun *run, size_t count, size_t size);
// Ends a case, and frees what it has allocated.
void verify_release(VerifyRun *run);
// Frees what the case has allocated since its memory was `before`, such as a large image that was checked.
void verify_release_since(VerifyRun *run, const CaseMemory *before);

// Returns how many of `count` random rays or pixels to use, which is a sixteenth in a quick run.
size_t verify_part(const VerifyRun *run, size_t count);

double verify_roundoff(const VerifyRun *run); // half a unit in the last place of 1
double verify_ulp(const VerifyRun *run, double value);
double verify_rounded(const VerifyRun *run, double value); // to the precision at work
Vector3 verify_rounded_vector(const VerifyRun *run, Vector3 vector);
// Rounds the ray's numbers as the renderer does, so that exact answers are for the same ray. A tmax beyond
// the precision's range becomes the largest number in it.
void verify_round_ray(const VerifyRun *run, TraceRay *ray);
TraceRay verify_ray(const VerifyRun *run, Vector3 origin, Vector3 direction); // rounded, without a tmax

static inline bool verify_is_hit(const TraceHit *hit)
{
    return hit->object != UINT32_MAX;
}

// Opens a scene as it is, with or without a BVH, until renderer_close. Returns NULL if the device failed.
Renderer *verify_open(VerifyRun *run, const Scene *scene, bool bvh);
// Traces rays in an open scene and counts the unsound hits. After the device has failed, hits are zeros and
// no result is reported.
void verify_trace_opened(VerifyRun *run, Renderer *opened, const TraceRay *rays, size_t count,
                         TraceHit *hits);
// Opens a scene, traces rays and counts the unsound hits. Returns the hits for the duration of the case. They
// are zeros after the device has failed.
const TraceHit *verify_trace(VerifyRun *run, const Scene *scene, bool bvh, const TraceRay *rays,
                             size_t count);
bool verify_same_bits(const TraceHit *a, const TraceHit *b); // compares object, distance and normal

// Records an error of a value in ulp of the value, and counts it as wrong if it exceeds this many.
void verify_record_ulps(VerifyRun *run, double error, double value, double bound);
// Records an error in the given unit, and counts it as wrong if it exceeds the bound.
void verify_record(VerifyRun *run, double error, double bound, const char *unit);

// Returns a scene with a camera, one material and no objects, for the duration of the case.
Scene *verify_empty_scene(VerifyRun *run);
// Reads a built-in scene for the duration of the case. The text, formatted as by printf, is native YAML
// without the camera. A text that cannot be read is a bug.
Scene *verify_scene(VerifyRun *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
bool verify_is_refused(const char *text); // whether the YAML reader rejects a scene with an error
Camera verify_camera(Vector3 position, Vector3 look_at, double fov_degrees); // y is up

// Renders all layers of a film for the duration of the case and counts the unsound pixels. After the device
// has failed, they are zeros.
Film verify_render(VerifyRun *run, const Scene *scene, bool bvh, uint32_t width, uint32_t height);

static inline bool verify_pixel_found(const Film *image, size_t pixel)
{
    return image->object[pixel] != UINT32_MAX;
}
