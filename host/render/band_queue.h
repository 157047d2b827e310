// The protocol between what renders the bands of an image and what receives them.
#pragma once

#include "host/render/film.h"

// Receives a band, whose layers are valid until the sink returns. A sink that returns false ends the render.
typedef bool (*BandSink)(void *context, const Film *band);

// Hands out an image's rows and receives their bands, as the functions of a Scheduler do
// (host/render/scheduler.h).
typedef struct {
    BandRows (*acquire)(void *context, uint32_t rows_max, uint32_t step);
    BandSink deliver;
    bool (*has_ended)(void *context); // may be NULL
    void *context;
} BandQueue;
