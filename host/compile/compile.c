#include "host/compile/compile.h"

#include "host/base/clock.h"
#include "host/compile/stages.h"
#include "host/compile/transform.h"

const char *const precision_names[PRECISION_COUNT] = {"fast", "single", "strict", "double"};

const char *const bvh_choice_names[BVH_CHOICE_COUNT] = {"auto", "on", "off"};

// The stages of a scene in the device's unit.
static bool stages_run(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                       MessageList *messages)
{
    if (!lights_fit(compiled, scene, settings, messages) ||
        !textures_load(compiled, scene, settings, messages))
        return false;
    const bool is_double = settings->precision == PRECISION_DOUBLE;
    const Rounding rounding = {settings->shift_to_eye ? scene->camera.position : (Vector3){0}, is_double};
    objects_flatten(compiled, scene, &rounding);
    materials_flatten(compiled, scene, &rounding);
    lights_flatten(compiled, scene, &rounding);
    if (!numbers_fit(compiled, scene, settings, messages)) return false;
    compiled->features |= features_of(scene) | settings->extra_features;
    double start = clock_seconds();
    bvh_flatten(compiled, settings);
    compiled->bvh_seconds = clock_seconds() - start;
    culling_fill(compiled, is_double);
    if (compiled->features & FEATURE_TRANSMISSION) compiled->contact = contact_find(compiled);
    header_write(compiled, scene, settings);
    return true;
}

bool scene_compile(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                   MessageList *messages)
{
    double start = clock_seconds();
    if (!size_fits(scene, messages)) return false;
    *compiled = (CompiledScene){.unit = scene_unit(scene, settings)};
    Scene scaled = {0};
    if (compiled->unit != 1) scaled = scene_scaled(scene, 1 / compiled->unit);
    bool done = stages_run(compiled, compiled->unit != 1 ? &scaled : scene, settings, messages);
    scene_scaled_free(&scaled);
    if (!done) compiled_scene_free(compiled);
    compiled->flatten_seconds = clock_seconds() - start - compiled->bvh_seconds;
    return done;
}
