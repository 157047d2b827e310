// The time of every stage and launch of a render, as text or JSON.
#pragma once

#include "host/opencl/device.h"
#include "host/render/renderer.h"

typedef enum { TIMING_NONE, TIMING_TEXT, TIMING_JSON } TimingStyle;

bool timing_style_read(const char *value, TimingStyle *style); // value NULL: text

typedef struct {
    double parse_seconds, encode_seconds;
} HostTimes;

// Text goes to stderr, JSON to stdout.
void timing_print(TimingStyle style, const RenderReport *report, const Device *device,
                  const RenderSettings *settings, const HostTimes *host);
