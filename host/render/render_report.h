// What a renderer reports: its device, its kernels, and the times of what it did.
#pragma once

#include "host/base/array.h"
#include "host/base/stage.h"
#include "host/compile/features.h"
#include "host/opencl/compute.h"
#include "host/render/scheduler.h"

// The time of a kernel launch or a transfer.
typedef struct {
    const char *name; // "render", "aov", "path", "coverage", "re-render", "read-back"
    LaunchTime time;
} NamedLaunch;

typedef struct {
    const Device *device;
    const Device *reference_device; // re-renders flagged pixels at `certified`; NULL if `device` does
    FeatureSet features;
    uint32_t lanes;
    bool is_double; // whether the structs are in double
    uint64_t kernel_hash;
    double flatten_seconds, bvh_seconds, build_seconds, upload_seconds;
    bool build_from_cache;     // whether every program came from the cache
    const char *build_options; // the kernels' options, before those of the device
    bool is_out_of_line;       // whether a driver could not build a kernel with its functions inlined
    uint64_t rays[RAYS_COUNT]; // by RAYS_… (kernels/types.h), if settings.counting
    ARRAY_OF(NamedLaunch) launches, reads;
    ARRAY_OF(HostSpan) builds, bands; // a build has its kernel's name
    WorkerShare share;                // in the last render
} RenderReport;
