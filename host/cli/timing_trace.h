// The trace of a render: stages and commands on one time axis, as Chrome's trace viewer and Perfetto read it.
#pragma once

#include "host/base/stage.h"
#include "host/render/renderer.h"

// Prints the trace to stdout: a thread of the host's stages, then for each device one of its commands and one
// of its bands. `stage` keeps its spans.
void timing_trace_print(Renderer *const *renderers, size_t count, const Stage *stage);
