#include "host/compile/compile.h"

#include "host/base/clock.h"
#include "host/base/hash.h"
#include "host/compile/instances.h"
#include "host/compile/stages.h"
#include "host/compile/transform.h"

const char *const precision_names[PRECISION_COUNT] = {"single", "strict", "double", "certified"};

const char *const bvh_choice_names[BVH_CHOICE_COUNT] = {"auto", "on", "off"};

static Rounding rounding_from(Vector3 eye, const CompileSettings *settings)
{
    return (Rounding){.eye = eye,
                      .is_double = settings->precision == PRECISION_DOUBLE,
                      .has_eye = settings->shift_to_eye,
                      .certifies = settings->certifies};
}

// Returns the hash of the arrays that the BVH has not ordered yet.
static uint64_t primitives_hash(const CompiledScene *compiled)
{
    uint64_t hash = HASH_START;
    for (size_t type = 0; type < FLAT_COUNT; type++)
        if (is_ordered_by_bvh(type)) hash = flat_array_hash(hash, &compiled->arrays[type]);
    return hash;
}

// Runs the stages on a scene in the device's unit.
static bool stages_run(CompiledScene *compiled, const Scene *scene, const SceneExtent *extent,
                       const CompileSettings *settings, MessageList *messages)
{
    compiled->instances = instances_plan(scene, settings);
    if (!size_fits(compiled, scene, settings, messages) || !features_fit(scene, settings, messages) ||
        !lights_fit(compiled, scene, extent, settings, messages))
        return false;
    textures_flatten(compiled, scene, settings);
    const Rounding rounding = rounding_from(eye_of(scene, settings), settings);
    compiled->eye = rounding.eye;
    stage_begin(settings->stage, "flattening the scene", NULL, 0);
    objects_flatten(compiled, scene, &rounding);
    materials_flatten(compiled, scene, &rounding);
    lights_flatten(compiled, scene, &rounding);
    sky_cells_flatten(compiled, scene);
    if (!numbers_fit(compiled, scene, settings, messages)) return false;
    neighbors_find(compiled, scene, settings);
    compiled->features |= features_of(scene) | settings->extra_features;
    if (compiled->instances) compiled->features |= FEATURE_INSTANCES;
    if (settings->hashes_primitives) compiled->primitives_hash = primitives_hash(compiled);
    double start = clock_seconds();
    bvh_flatten(compiled, settings);
    compiled->bvh_seconds = clock_seconds() - start;
    culling_fill(compiled, settings);
    if (compiled->features & FEATURE_TRANSMISSION) compiled->contact = contact_find(compiled);
    header_write(compiled, scene, settings);
    start = clock_seconds();
    shared_meshes_append(compiled, scene, settings);
    compiled->bvh_seconds += clock_seconds() - start;
    return true;
}

bool scene_compile(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                   MessageList *messages)
{
    double start = clock_seconds();
    const SceneExtent extent = scene_extent(scene);
    sizes_check(scene, &extent, settings, messages);
    *compiled = (CompiledScene){.unit = scene_unit(scene, &extent, settings)};
    __attribute__((cleanup(scene_scaled_free))) Scene scaled = {0};
    if (compiled->unit != 1) scaled = scene_scaled(scene, 1 / compiled->unit);
    bool done = stages_run(compiled, compiled->unit != 1 ? &scaled : scene, &extent, settings, messages);
    if (!done) compiled_scene_free(compiled);
    compiled->flatten_seconds = clock_seconds() - start - compiled->bvh_seconds;
    return done;
}

// Updates what depends on the eye. After a failure the arrays belong to no eye.
static bool eye_move(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                     MessageList *messages)
{
    const Rounding rounding = rounding_from(eye_of(scene, settings), settings);
    compiled->eye = (Vector3){NAN, NAN, NAN}; // equal to no eye, so that the next move sets all
    compiled->eye_offset = (Vector3){0};
    stage_begin(settings->stage, "flattening the scene", NULL, 0);
    objects_move(compiled, scene, &rounding);
    compiled->features |= settings->extra_features;
    materials_flatten(compiled, scene, &rounding);
    lights_flatten(compiled, scene, &rounding);
    if (!numbers_fit(compiled, scene, settings, messages)) return false;
    double start = clock_seconds();
    bvh_refit(compiled);
    compiled->bvh_seconds = clock_seconds() - start;
    culling_fill(compiled, settings);
    if (compiled->features & FEATURE_TRANSMISSION) compiled->contact = contact_find(compiled);
    compiled->eye = rounding.eye;
    return true;
}

// Sets the eye's offset from the arrays' eye, 0 unless a preview. Returns false if the arrays must move.
static bool eye_shift(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings)
{
    const Rounding rounding = rounding_from(compiled->eye, settings);
    const Vector3 offset = point_from_eye(&rounding, eye_of(scene, settings));
    const bool is_same = vector_is_zero(offset) && vectors_equal(compiled->eye, eye_of(scene, settings));
    const bool fits = isfinite(offset.x) && isfinite(offset.y) && isfinite(offset.z);
    // at `certified` the offset's rounding has no bound
    if (!is_same && !(settings->is_preview && fits && !settings->certifies)) return false;
    if (vectors_equal(offset, compiled->eye_offset)) return true;
    compiled->eye_offset = offset;
    culling_fill(compiled, settings);
    return true;
}

bool scene_move(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                MessageList *messages)
{
    double start = clock_seconds();
    const SceneExtent extent = scene_extent(scene);
    const double unit = scene_unit(scene, &extent, settings);
    if (unit != 1 || compiled->unit != 1) {
        CompiledScene moved;
        if (!scene_compile(&moved, scene, settings, messages)) return false;
        compiled_scene_free(compiled);
        *compiled = moved;
        return true;
    }
    compiled->bvh_seconds = 0;
    if (!features_fit(scene, settings, messages) || !lights_fit(compiled, scene, &extent, settings, messages))
        return false;
    shared_meshes_toggle(compiled);
    const bool is_near = eye_shift(compiled, scene, settings);
    const bool fits = is_near ? numbers_fit(compiled, scene, settings, messages)
                              : eye_move(compiled, scene, settings, messages);
    if (fits) header_write(compiled, scene, settings);
    shared_meshes_toggle(compiled);
    if (!fits) return false;
    compiled->flatten_seconds = clock_seconds() - start - compiled->bvh_seconds;
    return true;
}
