// What glint accuracy reports: text or JSON.
#pragma once

#include "host/base/text.h"
#include "host/cli/format.h"
#include "host/measure/accuracy.h"
#include "host/opencl/device.h"

typedef struct {
    const Device *device;
    uint32_t perturb_seed, perturb_scale; // 0: no injected errors
    const AccuracyScene *scenes;
    size_t scene_count;
    const char *folder; // where the arrays were saved, or NULL
} AccuracyReport;

void accuracy_print_text(const AccuracyReport *report, FILE *stream);
extern const ResultTable accuracy_table;           // of accuracy_json
Json *accuracy_json(const AccuracyReport *report); // docs/glint-json.5; to be printed

// Path prefix of the saved arrays of a scene's variant, or of its reference if `variant` is NULL:
// FOLDER/0-scene-single-16-auto-1, for example.
void accuracy_saved_prefix(Text *text, const AccuracyReport *report, size_t scene,
                           const AccuracyVariant *variant);
// The variant's precision, and those of lanes, BVH choice and samples that distinguish it from others of its
// scene.
void accuracy_variant_name(Text *text, const AccuracyScene *scene, const AccuracyVariant *variant);
