// The pixels of one launch, a band of rows or a list, with the device's buffers that it fills.
#pragma once

#include "host/render/renderer_state.h"

typedef struct {
    uint32_t rows;
    cl_mem ray_counts, compensation, layers[LAYER_COUNT];
    cl_mem doubts;        // at `certified`: of each pixel's color, how many of its samples are in doubt
    cl_mem center_doubts; // likewise of its AOVs, 0 or 1
    cl_mem pixels;        // where a list is rendered: x and y of each
    RepeatCounts repeats; // of the band, since its last delivery
} BandBuffers;

// For as many pixels as the film has.
void band_buffers_open(BandBuffers *buffers, Renderer *renderer, unsigned aovs, Film film);
void band_buffers_close(BandBuffers *buffers);

// The pixels that a launch renders.
typedef struct {
    cl_uint4 band; // x, y, width, height; of a list its length and 1
    size_t items[2], group[2];
} Place;

Place band_place(const Renderer *renderer, BandRows rows);
// The first `count` pixels of a list.
Place list_place(const Renderer *renderer, uint32_t count);

// The pixels of a work-item or of a work-group.
typedef struct {
    uint32_t width, height;
} TileShape;
TileShape group_shape(const Renderer *renderer);

// The film of these rows, without its layers.
Film film_of_rows(const Renderer *renderer, uint32_t first_row, uint32_t row_count);

static inline bool layer_in(unsigned layers, Layer layer)
{
    return layers >> layer & 1;
}

// Columns and rows of the image per pixel that is rendered.
static inline uint32_t settings_cell(const RenderSettings *settings)
{
    return settings->cell > 0 ? settings->cell : 1;
}

// One launch for samples first..last-1. Returns its seconds: the event's if trusted, else the host's.
double band_render(Renderer *renderer, const BandBuffers *buffers, const Place *place, uint32_t first,
                   uint32_t last);

// Launches a kernel that fills its layers, whose buffers follow the band in its arguments.
void band_fill(Renderer *renderer, KernelKind kind, unsigned layers, const BandBuffers *buffers,
               unsigned aovs, const Place *place);
