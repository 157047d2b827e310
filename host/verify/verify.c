#include "host/verify/verify.h"
#include "host/base/array.h"
#include "host/import/load.h"

#include "host/base/fault.h"
#include "host/base/hash.h"
#include "host/base/text.h"
#include "host/base/ulp.h"
#include "host/scene/portable.h"
#include "host/verify/rays.h"
#include <float.h>
#include <math.h>
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

size_t verify_part(const VerifyRun *run, size_t count)
{
    return run->settings->quick ? (count + 15) / 16 : count;
}

double verify_roundoff(const VerifyRun *run)
{
    return verify_is_double(run) ? 0x1p-53 : 0x1p-24;
}

double verify_ulp(const VerifyRun *run, double value)
{
    return ulp_of(value, verify_is_double(run) ? DBL_MANT_DIG : FLT_MANT_DIG);
}

double verify_rounded(const VerifyRun *run, double value)
{
    if (verify_is_double(run)) return value;
    volatile float single = (float)value; // volatile: see host/compile/rounding.c
    return single;
}

Vector3 verify_rounded_vector(const VerifyRun *run, Vector3 vector)
{
    return (Vector3){verify_rounded(run, vector.x), verify_rounded(run, vector.y),
                     verify_rounded(run, vector.z)};
}

void verify_round_ray(const VerifyRun *run, TraceRay *ray)
{
    ray->origin = verify_rounded_vector(run, ray->origin);
    ray->direction = verify_rounded_vector(run, ray->direction);
    ray->tmin = verify_rounded(run, ray->tmin);
    ray->tmax = fmin(ray->tmax, verify_is_double(run) ? DBL_MAX : (double)FLT_MAX);
}

TraceRay verify_ray(const VerifyRun *run, Vector3 origin, Vector3 direction)
{
    TraceRay ray = {origin, direction, 0, INFINITY};
    verify_round_ray(run, &ray);
    return ray;
}

static bool is_finite(Vector3 vector)
{
    return vector_is_within(vector, DBL_MAX);
}

static bool is_unit(const VerifyRun *run, Vector3 vector)
{
    return fabs(vector_length(vector) - 1) <= 4 * verify_roundoff(run);
}

static bool is_sound(const VerifyRun *run, const TraceRay *ray, const TraceHit *hit)
{
    if (!verify_is_hit(hit)) return true;
    if (!isfinite(hit->t) || !(hit->t > ray->tmin) || !(hit->t < ray->tmax)) return false;
    if (!is_finite(hit->normal) || !is_finite(hit->position)) return false;
    if (!is_finite(hit->reflected_origin) || !is_finite(hit->reflected_direction)) return false;
    if (!is_finite(hit->refracted_origin) || !is_finite(hit->refracted_direction)) return false;
    return run->tier == TIER_A || is_unit(run, hit->normal);
}

// Extends the hash by FNV-1a (Fowler, Noll, Vo) on 64-bit words, with the upper half folded into the lower.
static void hash_word(VerifyRun *run, uint64_t word)
{
    uint64_t hash = (run->result->hash ^ word) * 0x100000001b3u;
    run->result->hash = hash ^ hash >> 32;
}

static void hash_numbers(VerifyRun *run, const double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        hash_word(run, bits);
    }
}

static void hash_integers(VerifyRun *run, const uint32_t *integers, size_t count)
{
    for (size_t i = 0; i < count; i++)
        hash_word(run, integers[i]);
}

// Hashes a hit, or the `light` of a miss, whose other members have no meaning.
static void hash_hit(VerifyRun *run, const TraceHit *hit)
{
    hash_word(run, hit->object);
    hash_numbers(run, &hit->light, 1);
    if (!verify_is_hit(hit)) return;
    hash_numbers(run, &hit->t, 1);
    hash_numbers(run, &hit->normal.x, 3);
    hash_numbers(run, &hit->position.x, 3);
    hash_numbers(run, &hit->reflected_origin.x, 3);
    hash_numbers(run, &hit->reflected_direction.x, 3);
    hash_numbers(run, &hit->refracted_origin.x, 3);
    hash_numbers(run, &hit->refracted_direction.x, 3);
    hash_numbers(run, &hit->transmission, 1);
}

// Returns settings with every feature built in, so that one program serves all scenes. Lean settings build
// what an image of the scene needs and, for rays, reflection and transmission. A width of 0 is for rays.
static RenderSettings scene_settings(const VerifyRun *run, bool bvh, uint32_t width, uint32_t height)
{
    const bool image = width > 0;
    const FeatureSet lean_features = image ? 0 : FEATURE_REFLECTION | FEATURE_TRANSMISSION;
    RenderSettings settings = run->settings->render;
    settings.width = settings.region_width = image ? width : 1;
    settings.height = settings.region_height = image ? height : 1;
    settings.bvh = bvh ? BVH_ON : BVH_OFF;
    settings.instances = INSTANCES_SHARED;
    if (!image) settings.bounce_count = 0;
    settings.shift_to_eye = image;
    settings.extra_features = run->settings->lean ? lean_features : FEATURE_ALL;
    return settings;
}

// Opens *renderer, or moves it to another scene. Sets it to NULL if the device fails.
static void scene_assign(const VerifyRun *run, Renderer **renderer, const Scene *scene,
                         const RenderSettings *settings)
{
    MessageList messages = {0};
    if (!*renderer) {
        *renderer = renderer_open(run->compute, scene, settings, &messages);
    } else if (renderer_move(*renderer, scene, settings, &messages)) {
        renderer_report_restart(*renderer);
    } else {
        renderer_close(*renderer);
        *renderer = NULL;
    }
    message_list_print(&messages, stderr);
    message_list_free(&messages);
    if (!*renderer && compute_ok(run->compute)) fault("a hard case does not fit the device");
    if (*renderer) run->kernels->lanes = renderer_report(*renderer)->lanes;
}

Renderer *verify_open(VerifyRun *run, const Scene *scene, bool bvh)
{
    const RenderSettings settings = scene_settings(run, bvh, 0, 0);
    Renderer *renderer = NULL;
    scene_assign(run, &renderer, scene, &settings);
    return renderer;
}

void verify_trace_opened(VerifyRun *run, Renderer *opened, const TraceRay *rays, size_t count, TraceHit *hits)
{
    if (opened && renderer_trace(opened, rays, count, hits))
        run->kernels->trace_hash = renderer_report(opened)->kernel_hash;
    else
        memset(hits, 0, count * sizeof *hits);
    run->result->ray_count += count;
    for (size_t i = 0; i < count; i++) {
        run->result->unsound += !is_sound(run, &rays[i], &hits[i]);
        hash_hit(run, &hits[i]);
    }
}

void verify_trace(VerifyRun *run, const Scene *scene, bool bvh, const TraceRay *rays, size_t count,
                  TraceHit *hits)
{
    const RenderSettings settings = scene_settings(run, bvh, 0, 0);
    scene_assign(run, run->tracer, scene, &settings);
    verify_trace_opened(run, *run->tracer, rays, count, hits);
}

static bool is_pixel_sound(const VerifyRun *run, const Film *image, size_t i)
{
    const Vector3 color = vector_from(&image->color[3 * i]), normal = vector_from(&image->normal[3 * i]);
    if (!is_finite(color) || color.x < 0 || color.y < 0 || color.z < 0) return false;
    if (!is_finite(vector_from(&image->ray[3 * i]))) return false;
    if (image->object[i] == UINT32_MAX) return isinf(image->t[i]);
    if (!(image->t[i] > 0) || !isfinite(image->t[i])) return false;
    if (!is_finite(normal) || !is_finite(vector_from(&image->position[3 * i]))) return false;
    return run->tier == TIER_A || is_unit(run, normal);
}

Film verify_render(VerifyRun *run, const Scene *scene, bool bvh, uint32_t width, uint32_t height)
{
    const unsigned aovs = AOVS_OF_HIT | AOVS_OF_PATH;
    Film film;
    const RenderSettings settings = scene_settings(run, bvh, width, height);
    if (run->settings->picture) run->settings->picture(run->settings->context, scene, &settings);
    scene_assign(run, run->painter, scene, &settings);
    if (*run->painter && renderer_render_film(*run->painter, aovs, &film))
        run->kernels->render_hash = renderer_report(*run->painter)->kernel_hash;
    else
        film = film_allocate(width, height, (uint32_t)scene->lights.count, aovs);
    const size_t pixels = film_pixel_count(&film);
    run->result->ray_count += pixels;
    for (size_t i = 0; i < pixels; i++)
        run->result->unsound += !is_pixel_sound(run, &film, i);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (!film.layers[layer]) continue;
        const size_t count = pixels * film_components(&film, layer);
        if (layer_types[layer] == LAYER_TYPE_INTEGER)
            hash_integers(run, film.layers[layer], count);
        else
            hash_numbers(run, film.layers[layer], count);
    }
    return film;
}

bool verify_same_bits(const TraceHit *a, const TraceHit *b)
{
    if (a->object != b->object || !verify_is_hit(a)) return a->object == b->object;
    return memcmp(&a->t, &b->t, sizeof a->t) == 0 && memcmp(&a->normal, &b->normal, sizeof a->normal) == 0;
}

void verify_record(VerifyRun *run, double error, double bound, const char *unit)
{
    VerifyResult *result = run->result;
    if (!(error <= bound)) result->wrong++;
    if (bound == INFINITY) return;
    double part = bound > 0 ? error / bound : error > 0 ? INFINITY : 0;
    double worst_part = result->bound > 0 ? result->worst / result->bound : result->worst > 0 ? INFINITY : 0;
    if (part > worst_part || (result->worst == 0 && bound > result->bound)) {
        result->worst = error;
        result->bound = bound;
        result->unit = unit;
    }
}

void verify_record_ulps(VerifyRun *run, double error, double value, double bound)
{
    verify_record(run, error / verify_ulp(run, value), bound, "ulp");
}

Scene verify_scene(const char *objects)
{
    Text text = {0};
    text_appendf(&text, "camera: {position: [0, 0, 0], look_at: [0, 0, 1], fov: 90}\n%s", objects);
    Source source = {"verify", text_c(&text), text.count};
    MessageList messages = {0};
    Scene scene = {0};
    if (!scene_read_yaml(&scene, &source, &(SceneOptions){0}, &messages))
        fault("a scene of verify cannot be read: %s\n%s", message_list_text(&messages), source.bytes);
    message_list_free(&messages);
    text_free(&text);
    return scene;
}

bool verify_is_refused(const char *text)
{
    Source source = {"verify", text, strlen(text)};
    MessageList messages = {0};
    Scene scene = {0};
    bool read = scene_read_yaml(&scene, &source, &(SceneOptions){0}, &messages);
    bool refused = !read && message_count(&messages, MESSAGE_ERROR) > 0;
    message_list_free(&messages);
    scene_free(&scene);
    return refused;
}

Camera verify_camera(Vector3 position, Vector3 look_at, double fov_degrees)
{
    return (Camera){.position = position,
                    .look_at = look_at,
                    .up = {0, 1, 0},
                    .half_tangent = portable_tangent(fov_degrees * (M_PI / 360))};
}

const char *verify_case_name(size_t i)
{
    return i < COUNT_OF(cases) ? cases[i].name : NULL;
}

static bool is_chosen(const VerifyChoice *choice, const char *name)
{
    for (size_t i = 0; choice && i < choice->count; i++)
        if (strcmp(choice->names[i], name) == 0) return true;
    return !choice;
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

void verify_run(Compute *compute, const VerifySettings *settings, const VerifyChoice *choice,
                const VerifySink *sink, VerifyKernels *kernels)
{
    Renderer *tracer = NULL, *painter = NULL;
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        if (!is_chosen(choice, cases[i].name)) continue;
        VerifyResult result = {.name = cases[i].name, .title = cases[i].title, .hash = HASH_START};
        if (sink->start && !sink->start(sink->context, &result)) continue;
        VerifyRun run = {.compute = compute,
                         .settings = settings,
                         .tier = verify_tier(&settings->render),
                         .inexact = is_inexact(&settings->render),
                         .result = &result,
                         .kernels = kernels,
                         .tracer = &tracer,
                         .painter = &painter};
        for (size_t k = 0; k < verify_rays_count; k++)
            if (strcmp(verify_rays[k].name, result.name) == 0) verify_rays_run(&run, &verify_rays[k]);
        for (size_t k = 0; k < CHECKS_MAX && cases[i].checks[k]; k++)
            cases[i].checks[k](&run);
        if (!sink->receive(sink->context, &result)) break;
    }
    renderer_close(tracer);
    renderer_close(painter);
}
