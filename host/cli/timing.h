// Reports the time of every stage and launch of a render, as text, JSON or a trace.
#pragma once

#include "host/cli/image_notes.h"
#include "host/measure/pilot.h"

typedef enum { TIMING_NONE, TIMING_TEXT, TIMING_JSON, TIMING_TRACE } TimingStyle;

// Returns whether timing_print writes to standard output.
static inline bool timing_uses_stdout(TimingStyle style)
{
    return style == TIMING_JSON || style == TIMING_TRACE;
}

typedef struct {
    double frame;    // NAN without --frames
    bool is_several; // whether the JSON report is one line of several
    double parse_seconds, encode_seconds;
    const Pilot *pilot;       // the pilot that chose the precision, or NULL
    double render_seconds;    // from the first band to the last, builds included
    RerenderCounts rerenders; // only at `certified`
    Stage *stage;             // keeps its spans; NULL unless they are wanted
} HostTimes;

// Prints the times of all renderers and ranks of the image. Text goes to stderr, JSON and the trace to
// stdout.
void timing_print(TimingStyle style, const ImageOrigin *origin, const HostTimes *host);
