#include "host/verify/run.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/base/ulp.h"
#include "host/import/load.h"
#include "host/scene/portable.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *verify_allocate(VerifyRun *run, size_t count, size_t size)
{
    void *block = memory_allocate(count, size);
    array_push(run->memory.blocks, block);
    return block;
}

void verify_release_since(VerifyRun *run, const CaseMemory *before)
{
    CaseMemory *memory = &run->memory;
    while (memory->films.count > before->films.count)
        film_free(&memory->films.items[--memory->films.count]);
    while (memory->scenes.count > before->scenes.count)
        scene_free(memory->scenes.items[--memory->scenes.count]);
    while (memory->blocks.count > before->blocks.count)
        free(memory->blocks.items[--memory->blocks.count]);
}

void verify_release(VerifyRun *run)
{
    CaseMemory *memory = &run->memory;
    verify_release_since(run, &(CaseMemory){0});
    free(memory->films.items);
    free(memory->scenes.items);
    free(memory->blocks.items);
    *memory = (CaseMemory){0};
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
    return verify_is_double(run) ? value : rounded_to_float(value);
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
    ray->tmax = fmin(verify_rounded(run, ray->tmax), verify_is_double(run) ? DBL_MAX : (double)FLT_MAX);
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
    OwnedMessageList messages = {0};
    if (!*renderer) {
        *renderer = renderer_open(run->compute, scene, settings, &messages);
    } else if (renderer_move(*renderer, scene, settings, &messages)) {
        renderer_report_restart(*renderer);
    } else {
        renderer_close(*renderer);
        *renderer = NULL;
    }
    message_list_print(&messages, stderr);
    if (!*renderer && compute_ok(run->compute)) fault("a hard case was refused on a suitable device");
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

const TraceHit *verify_trace(VerifyRun *run, const Scene *scene, bool bvh, const TraceRay *rays, size_t count)
{
    const RenderSettings settings = scene_settings(run, bvh, 0, 0);
    TraceHit *hits = verify_allocate(run, count, sizeof *hits);
    scene_assign(run, &run->ray_renderer, scene, &settings);
    verify_trace_opened(run, run->ray_renderer, rays, count, hits);
    return hits;
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
    if (run->settings->receive_image) run->settings->receive_image(run->settings->context, scene, &settings);
    scene_assign(run, &run->image_renderer, scene, &settings);
    if (run->image_renderer && renderer_render_film(run->image_renderer, aovs, &film))
        run->kernels->render_hash = renderer_report(run->image_renderer)->kernel_hash;
    else
        film = film_allocate(width, height, (uint32_t)scene->lights.count, aovs);
    array_push(run->memory.films, film);
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

// Returns an error over its bound, which may be 0.
static double bound_share(double error, double bound)
{
    return bound > 0 ? error / bound : error > 0 ? INFINITY : 0;
}

void verify_record(VerifyRun *run, double error, double bound, const char *unit)
{
    VerifyResult *result = run->result;
    if (!(error <= bound)) result->wrong++;
    if (bound == INFINITY) return;
    if (bound_share(error, bound) > bound_share(result->worst, result->bound) ||
        (result->worst == 0 && bound > result->bound)) {
        result->worst = error;
        result->bound = bound;
        result->unit = unit;
    }
}

void verify_record_ulps(VerifyRun *run, double error, double value, double bound)
{
    verify_record(run, error / verify_ulp(run, value), bound, "ulp");
}

static bool text_read_scene(Scene *scene, const char *text, MessageList *messages)
{
    const Source source = {"verify", text, strlen(text)};
    return scene_read_yaml(scene, &source, &(SceneOptions){0}, messages);
}

// Returns a scene of zeros that lasts until the case ends.
static Scene *scene_allocate(VerifyRun *run)
{
    Scene *scene = verify_allocate(run, 1, sizeof *scene);
    *scene = (Scene){0};
    array_push(run->memory.scenes, scene);
    return scene;
}

Scene *verify_empty_scene(VerifyRun *run)
{
    Scene *scene = scene_allocate(run);
    scene->camera = (Camera){.look_at = {0, 0, 1}, .half_tangent = 1};
    const Material material = material_default();
    scene_add_material(scene, &material, "");
    return scene;
}

Scene *verify_scene(VerifyRun *run, const char *format, ...)
{
    OWNED char *members = NULL;
    ARGUMENTS_FORMAT(members, format);
    OWNED char *text = text_format("camera: {position: [0, 0, 0], look_at: [0, 0, 1], fov: 90}\n%s", members);
    OwnedMessageList messages = {0};
    Scene *scene = scene_allocate(run);
    if (!text_read_scene(scene, text, &messages))
        fault("a scene of verify cannot be read: %s\n%s", message_list_text(&messages), text);
    return scene;
}

bool verify_is_refused(const char *text)
{
    OwnedMessageList messages = {0};
    OwnedScene scene = {0};
    return !text_read_scene(&scene, text, &messages) && message_count(&messages, MESSAGE_ERROR) > 0;
}

Camera verify_camera(Vector3 position, Vector3 look_at, double fov_degrees)
{
    return (Camera){.position = position,
                    .look_at = look_at,
                    .up = {0, 1, 0},
                    .half_tangent = portable_tangent(fov_degrees * (M_PI / 360))};
}
