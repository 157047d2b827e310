// Prints the report of glint accuracy as text or JSON.
#pragma once

#include "host/base/text.h"
#include "host/cli/format.h"
#include "host/measure/accuracy.h"
#include "host/opencl/device.h"

typedef struct {
    const Device *device;
    uint32_t perturb_seed, perturb_scale; // a seed of 0 means no injected errors
    const AccuracyScene *scenes;
    size_t scene_count;
    const char *folder; // the folder of the saved arrays, or NULL
} AccuracyReport;

void accuracy_print_text(const AccuracyReport *report, FILE *stream);
// Describes the members of accuracy_json.
extern const ResultTable accuracy_table;
// Returns the report as docs/glint-json.5 describes it. The caller prints it.
Json *accuracy_json(const AccuracyReport *report);

// Appends the path prefix of the saved arrays of a scene's variant, or of its reference if `variant` is NULL,
// such as FOLDER/0-scene-single-16-auto-1.
void accuracy_saved_prefix(Text *text, const AccuracyReport *report, size_t scene,
                           const AccuracyVariant *variant);
// Appends the variant's precision, and its lanes, BVH choice and samples where they distinguish it from other
// variants of its scene.
void accuracy_variant_name(Text *text, const AccuracyScene *scene, const AccuracyVariant *variant);
