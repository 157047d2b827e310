// One configuration of one scene, opened once and run repeatedly.
#pragma once

#include "host/measure/bench.h"
#include "host/render/renderer.h"

typedef struct {
    const Scene *scene;
    RenderSettings settings;
    Renderer *renderer; // NULL: not open, or not available on the device
} Variant;

// Prepares the runs: counts the rays and, if asked, times the builds. What the device cannot do becomes the
// row's failure.
void variant_open(Compute *compute, Variant *variant, BenchRow *row, bool timing_builds);
// One run; `times` NULL: warm-up. False if the user interrupted.
bool variant_run(Variant *variant, BenchTimes *times);
void variant_close(Variant *variant); // and zeroes; accepts a zeroed one
