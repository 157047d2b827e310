#include "host/verify/verify.h"

#include "host/base/array.h"
#include "host/base/hash.h"
#include "host/verify/rays.h"
#include <string.h>

enum { CHECKS_MAX = 3 };

// Each case has the tables of its name and separate checks.
static const struct {
    const char *name, *title;
    VerifyCheck *checks[CHECKS_MAX];
} cases[] = {
    {"S1", "sphere, from 100 to a million radii away", {0}},
    {"S2", "sphere seen from up to 10,000 radii away", {verify_far_fringe}},
    {"S3", "tiny sphere", {0}},
    {"S4", "ground sphere, from a millionth of its radius above", {verify_ground_horizon}},
    {"S5", "rays an ulp from a sphere's tangent", {0}},
    {"S6", "inside a sphere, and leaving it", {verify_scaled_directions, verify_leaving_spheres}},
    {"S7", "spheres up to 2^60 times as large as their distance", {verify_sizes}},
    {"P1", "plane up to the horizon", {verify_plane_horizon}},
    {"P2", "a plane's own shadow", {verify_plane_acne}},
    {"P3", "disc's rim from far away", {0}},
    {"P4", "rays in a box's faces", {0}},
    {"P5", "closed room: edges and corners", {verify_points_on_faces}},
    {"P6", "plate thinner than an epsilon", {verify_thin_plate}},
    {"P7", "coincident faces", {verify_coincident_faces}},
    {"P8", "planes, discs and boxes up to 2^60 times as large as their distance", {verify_sizes}},
    {"C1", "along a cylinder's axis", {0}},
    {"C2", "nearly along a cylinder's axis", {0}},
    {"C3", "wire, ten million times as long as thick", {verify_wire}},
    {"C4", "seam between a cylinder's side and caps", {0}},
    {"C5", "cylinder's tangent from far away", {0}},
    {"C6", "cone's apex", {verify_apex}},
    {"C7", "along a cone's side, and its other nappe", {0}},
    {"C8", "cylinders and cones up to 2^60 times as large as their distance", {verify_sizes}},
    {"T1", "torus from a thousand radii away", {verify_far_torus}},
    {"T2", "torus' hole and inner wall", {0}},
    {"T3", "in a torus' equatorial plane", {0}},
    {"T4", "a torus' circle of tangents", {verify_tangent_circle}},
    {"T5", "thin ring", {verify_thin_ring}},
    {"T6", "torus that failed in production", {0}},
    {"T7", "tori up to 2^60 times as large as their distance", {verify_sizes}},
    {"Q1", "paraboloid, from 100 to a million sizes away", {0}},
    {"Q2", "along a paraboloid's axis", {0}},
    {"Q3", "inside a capped paraboloid", {0}},
    {"Q4", "paraboloids up to 2^60 times as large as their distance", {verify_sizes}},
    {"M1", "closed mesh: edges and vertices", {0}},
    {"M2", "closed mesh, far from the origin", {verify_far_mesh}},
    {"M3", "triangles from 2^-40 to 2^40", {verify_scale_ladder}},
    {"M4", "slivers, and triangles seen edge-on", {verify_within_triangle, verify_facing_triangle}},
    {"M5", "degenerate triangles", {verify_degenerate_meshes}},
    {"M6", "BVH against every object; any hit against the closest", {verify_bvh}},
    {"M7", "triangles up to 2^60 times as large as their distance", {verify_sizes}},
    {"M8", "instances at 1e7, mirrored and sheared, scaled by a millionth", {verify_instances}},
    {"R1", "shadow of a sphere, up to where it stands", {verify_contact_shadow}},
    {"R2", "a sphere in a thin coat of glass", {verify_nested_spheres}},
    {"R3", "glass of index 1", {verify_matched_glass}},
    {"R4", "total reflection around the critical angle", {verify_critical_angle}},
    {"R5", "highlights of powers up to a million", {verify_highlights}},
    {"R6", "scenes 2^-20 to 2^20 times as large", {verify_scaled_scenes}},
    {"R7", "mirrored scenes, and exchanged axes", {verify_mirrored_scenes}},
    {"R8", "degenerate cameras", {verify_camera_frames, verify_degenerate_views}},
};

_Static_assert(COUNT_OF(cases) <= VERIFY_CASES_MAX, "VERIFY_CASES_MAX is too small");

bool verify_holds(const VerifyResult *result)
{
    return result->wrong + result->leaks + result->unsound + result->off_surface + result->wrong_normals +
               result->differing ==
           0;
}

const char *verify_case_name(size_t i)
{
    return i < COUNT_OF(cases) ? cases[i].name : NULL;
}

// Returns whether quotients and roots err as much as OpenCL C allows.
static bool is_inexact(const RenderSettings *settings)
{
    return settings->perturb_seed > 0 && settings->precision < PRECISION_STRICT;
}

VerifyTier verify_tier(const RenderSettings *settings)
{
    static const VerifyTier tiers[PRECISION_COUNT] = {
        [PRECISION_SINGLE] = TIER_B,
        [PRECISION_STRICT] = TIER_C,
        [PRECISION_DOUBLE] = TIER_D,
    };
    return is_inexact(settings) ? TIER_A : tiers[settings->precision];
}

void verify_run(Compute *compute, const VerifySettings *settings, const VerifySink *sink,
                VerifyKernels *kernels)
{
    VerifyResult result;
    VerifyRun run = {.compute = compute,
                     .settings = settings,
                     .tier = verify_tier(&settings->render),
                     .inexact = is_inexact(&settings->render),
                     .result = &result,
                     .kernels = kernels};
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        result = (VerifyResult){.name = cases[i].name, .title = cases[i].title, .hash = HASH_START};
        if (sink->start && !sink->start(sink->context, &result)) continue;
        for (size_t k = 0; k < verify_rays_count; k++)
            if (strcmp(verify_rays[k].name, result.name) == 0) verify_rays_run(&run, &verify_rays[k]);
        for (size_t k = 0; k < CHECKS_MAX && cases[i].checks[k]; k++)
            cases[i].checks[k](&run);
        verify_release(&run);
        if (!sink->receive(sink->context, &result)) break;
    }
    renderer_close(run.ray_renderer);
    renderer_close(run.image_renderer);
}
