// The state and the functions that the hard cases share.
#pragma once

#include "host/verify/verify.h"

typedef struct {
    Compute *compute;
    const VerifySettings *settings;
    VerifyTier tier;
    bool inexact; // quotients and roots are off by as much as OpenCL C allows, up to 2 and 3 ulp
    VerifyResult *result;
    VerifyKernels *kernels;
    // The renderers of the last scenes of verify_trace and verify_render, or NULL. The next scene reuses
    // them with their kernels, because loading kernels takes longer than most scenes.
    Renderer **tracer, **painter;
} VerifyRun;

// The checks of a case that are not in the tables. Each counts its faults in the run's result.
typedef void VerifyCheck(VerifyRun *run);

VerifyCheck verify_scaled_directions; // S6
VerifyCheck verify_leaving_spheres;   // S6
VerifyCheck verify_points_on_faces;   // P5
VerifyCheck verify_coincident_faces;  // P7
VerifyCheck verify_far_mesh;          // M2
VerifyCheck verify_scale_ladder;      // M3
VerifyCheck verify_within_triangle;   // M4
VerifyCheck verify_facing_triangle;   // M4
VerifyCheck verify_degenerate_meshes; // M5
VerifyCheck verify_bvh;               // M6
VerifyCheck verify_instances;         // M8
VerifyCheck verify_critical_angle;    // R4
VerifyCheck verify_camera_frames;     // R8

VerifyCheck verify_far_fringe;       // S2
VerifyCheck verify_ground_horizon;   // S4
VerifyCheck verify_sizes;            // S7, P8, C8, T7, Q4, M7: the shapes of the case
VerifyCheck verify_plane_horizon;    // P1
VerifyCheck verify_plane_acne;       // P2
VerifyCheck verify_thin_plate;       // P6
VerifyCheck verify_wire;             // C3
VerifyCheck verify_apex;             // C6
VerifyCheck verify_far_torus;        // T1
VerifyCheck verify_tangent_circle;   // T4
VerifyCheck verify_thin_ring;        // T5
VerifyCheck verify_contact_shadow;   // R1
VerifyCheck verify_nested_spheres;   // R2
VerifyCheck verify_matched_glass;    // R3
VerifyCheck verify_highlights;       // R5
VerifyCheck verify_scaled_scenes;    // R6
VerifyCheck verify_mirrored_scenes;  // R7
VerifyCheck verify_degenerate_views; // R8

static inline bool verify_is_double(const VerifyRun *run)
{
    return run->tier == TIER_D;
}

// Returns how many of `count` random rays or pixels to use: all, or a sixteenth in a quick run.
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
// Opens a scene, traces rays and counts the unsound hits. Hits are zeros after the device has failed.
void verify_trace(VerifyRun *run, const Scene *scene, bool bvh, const TraceRay *rays, size_t count,
                  TraceHit *hits);
bool verify_same_bits(const TraceHit *a, const TraceHit *b); // compares object, distance and normal

// Records an error of a value in ulp of the value, and counts it as wrong if it exceeds this many.
void verify_record_ulps(VerifyRun *run, double error, double value, double bound);
// Records an error in the given unit, and counts it as wrong if it exceeds the bound.
void verify_record(VerifyRun *run, double error, double bound, const char *unit);

// Reads a built-in scene, formatted as by printf: native YAML without the camera. A text that cannot be read
// is a bug. The caller frees the scene with scene_free.
Scene verify_scene(const char *format, ...) __attribute__((format(printf, 1, 2)));
bool verify_is_refused(const char *text); // whether the YAML reader rejects a scene with an error
Camera verify_camera(Vector3 position, Vector3 look_at, double fov_degrees); // y is up

// Renders all layers of a film and counts the unsound pixels. After the device has failed, they are zeros.
// Free the film with film_free.
Film verify_render(VerifyRun *run, const Scene *scene, bool bvh, uint32_t width, uint32_t height);

static inline bool verify_pixel_found(const Film *image, size_t pixel)
{
    return image->object[pixel] != UINT32_MAX;
}
