// Opens one configuration of one scene and runs it repeatedly.
#pragma once

#include "host/measure/bench.h"
#include "host/measure/energy.h"
#include "host/render/renderer.h"

typedef struct {
    const Scene *scene;
    size_t choice; // the index of its --variant
    RenderSettings settings;
    // The driver options of --variant, which are NULL and 0 if not given.
    const char *build_options;
    uint32_t work_group[2];
    Compute *compute; // the command's
    // If the variant has driver options, copies of the device and of `compute` that have these options and
    // share the context and queue. If it has build options, the device also has separate passports.
    Device private_device;
    Compute private_compute;
    Renderer *renderer; // NULL if it is not open or not available on the device
} Variant;

// Returns a copy of the device with the variant's options for the driver.
Device variant_device(const Device *device, const Variant *variant);
// Prepares the runs: counts the rays and, if requested, times the builds. If the device does not support the
// variant, sets the row's failure.
void variant_open(Compute *shared, Variant *variant, BenchRow *row, bool timing_builds);
// Runs the variant once and adds its times to `times`, or discards them if it is NULL, for warm-ups. Returns
// false if the render failed or the user interrupted.
bool variant_run(Variant *variant, BenchTimes *times);
// Renders frames for a second or more, from about one step of the energy counter to another, and stores the
// mean energy of a frame in the row. About a 21st of the time is spent on idle readings, and each end is off
// by at most the frames between two readings. Returns false if a render failed or the user interrupted.
bool variant_run_energy(Variant *variant, EnergyMeter *meter, BenchRow *row);
// Closes the variant and zeroes it. Accepts a zeroed variant.
void variant_close(Variant *variant);
