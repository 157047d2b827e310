// Opens one configuration of one scene and runs it repeatedly.
#pragma once

#include "host/measure/bench.h"
#include "host/render/renderer.h"

typedef struct {
    const Scene *scene;
    RenderSettings settings;
    Renderer *renderer; // NULL if it is not open or not available on the device
} Variant;

// Prepares the runs: counts the rays and, if requested, times the builds. If the device does not support the
// variant, sets the row's failure.
void variant_open(Compute *compute, Variant *variant, BenchRow *row, bool timing_builds);
// Runs the variant once and adds its times to `times`, which is NULL for a warm-up. Returns false if the user
// interrupted.
bool variant_run(Variant *variant, BenchTimes *times);
// Closes the variant and sets it to zeros. Accepts a variant of zeros.
void variant_close(Variant *variant);
