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

// Prints and writes the report as the options ask. Returns false with a message if the file cannot be
// written.
bool accuracy_print(const AccuracyReport *report, const ReportOptions *options);
// Describes the members of accuracy_json.
extern const ResultTable accuracy_table;
// Returns the report as docs/glint-json.5 describes it. The caller prints it.
Json *accuracy_json(const AccuracyReport *report);

// Returns the path prefix of the saved arrays of a scene's variant, or of its reference if `variant` is NULL,
// such as FOLDER/0-scene-single-16-auto-1. The caller frees it.
Text accuracy_saved_prefix(const AccuracyReport *report, size_t scene, const AccuracyVariant *variant);
// Appends the variant's precision, and its lanes, BVH choice and samples if they distinguish it from other
// variants of its scene.
void accuracy_variant_name(Text *text, const AccuracyScene *scene, const AccuracyVariant *variant);
// Returns a sentence such as "for an error of at most 0.0001: single, 20.6 ms, 3.1e-06; double takes 1.8 to
// 2.1 times as long", which recommends a variant. The caller frees it.
Text accuracy_pick_sentence(const AccuracyScene *scene, size_t pick);
// Returns the reason with this index for which the variant is crossed out, or NULL if there are fewer
// reasons.
const char *accuracy_crossed_words(const AccuracyVariant *variant, size_t index);
// Returns the median of the variant's frame times in milliseconds.
double accuracy_frame_ms(const AccuracyVariant *variant);
