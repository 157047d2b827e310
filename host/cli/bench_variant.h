// One way of rendering one scene, opened to be run again and again.
#pragma once

#include "host/measure/bench.h"
#include "host/render/renderer.h"

typedef struct {
    const Scene *scene;
    RenderSettings settings;
    Renderer *renderer; // NULL: not opened, or it does not fit the device
} Variant;

// All that comes before the runs: counts the rays and, where asked for, measures the builds. What does not
// fit the device becomes the row's failure.
void variant_open(Compute *compute, Variant *variant, BenchRow *row, bool timing_builds);
// One run; `times` NULL: to warm up. False if the user stopped it.
bool variant_run(Variant *variant, BenchTimes *times);
void variant_close(Variant *variant); // and zeroes; accepts a zeroed one
