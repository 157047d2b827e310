// Adds JSON members that several reports share.
#pragma once

#include "host/base/json.h"
#include "host/measure/bench.h"
#include "host/opencl/device.h"
#include "host/render/renderer.h"

// Opens a report. Its first members are the versions of its schema and of glint and, unless `device` is NULL,
// the device.
Json *report_json_open(unsigned schema, const Device *device);
void text_json(Json *json, const char *key, Text text);          // frees the text
void summary_json(Json *json, const char *key, Summary seconds); // in milliseconds
// Adds the reason for a missing figure to the open object.
void unavailable_json(Json *json, const char *reason);
// Adds an object with the reason for a missing value.
void missing_json(Json *json, const char *key, const char *reason);
void figure_json(Json *json, const char *key, double scale, Figure figure);
// Adds the board, the place on the PCI bus and the UUID, each of which is null if unknown.
void device_identity_json(Json *json, const Device *device);
void counts_json(Json *json, const char *key, const size_t *counts, size_t count);
void numbers_json(Json *json, const char *key, double scale, const double *numbers, size_t count);
void ratio_json(Json *json, const Comparison *comparison);    // adds ratio, low and high
void perturb_json(Json *json, uint32_t seed, uint32_t scale); // nothing for seed 0
// Adds all options that the kernels of a report were compiled with.
void build_options_json(Json *json, const RenderReport *report);
// Adds the times at which a command of the report was queued, submitted, started and ended, and a kernel's
// sizes.
void command_json(Json *json, const RenderReport *report, const LaunchTime *time);
void times_json(Json *json, const BenchRow *row); // frame_ms, kernel_ms and the clock of the latter
void rays_json(Json *json, const BenchRow *row);  // rays, mrays_per_s
