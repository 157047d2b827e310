// What glint accuracy reports: tables and plain words for people, or JSON.
#pragma once

#include "host/base/json.h"
#include "host/base/text.h"
#include "host/measure/accuracy.h"
#include "host/opencl/device.h"

typedef struct {
    const Device *device;
    uint32_t perturb_seed, perturb_scale; // 0: nothing was made to err
    const AccuracyScene *scenes;
    size_t scene_count;
    const char *folder; // where the arrays were saved; NULL: they were not
} AccuracyReport;

void accuracy_print_text(const AccuracyReport *report, FILE *stream);
Json *accuracy_json(const AccuracyReport *report); // as docs/json.md has it; to be printed

// Where the arrays of a scene's variant are, NULL: of its reference: FOLDER/0-scene-single-16-auto-1, say.
void accuracy_saved_prefix(Text *text, const AccuracyReport *report, size_t scene,
                           const AccuracyVariant *variant);
// The variant's precision, and of lanes, hierarchy and samples what distinguishes it from others of its
// scene.
void accuracy_variant_name(Text *text, const AccuracyScene *scene, const AccuracyVariant *variant);
// Why it is crossed out, in words; `index` counts from 0, NULL after the last.
const char *accuracy_crossed_words(const AccuracyVariant *variant, size_t index);
// "for an error of at most 0.0001: single, 20.6 ms, 3.1e-06".
void accuracy_pick_sentence(Text *text, const AccuracyScene *scene, size_t pick);
