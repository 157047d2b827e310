// Writes the trace of a render, which has stages and commands on one time axis, as Chrome's trace viewer and
// Perfetto read it.
#pragma once

#include "host/base/stage.h"
#include "host/render/renderer.h"

// Prints the trace to stdout. It has a row of the host's stages and, for each device, a row of bands, one of
// builds, one of commands and, at `certified`, one for the reference device. `stage` must keep its spans.
void timing_trace_print(Renderer *const *renderers, size_t count, const Stage *stage);
