// The pixels of one launch, a band of rows or a list, with the device's buffers that it fills.
#pragma once

#include "host/render/renderer_state.h"

typedef struct {
    uint32_t rows;
    cl_mem film;                      // layer after layer
    unsigned layers;                  // in the film, as a set
    size_t layer_begins[LAYER_COUNT]; // in the film, in bytes
    cl_mem ray_counts;
    // at `certified`: of each tile which pixels' colors are in doubt, as bits; of a list's pixels how many
    // samples
    cl_mem doubts;
    cl_mem center_doubts; // likewise of the AOVs
    cl_mem pixels;        // where a list is rendered: x and y of each
    RepeatCounts repeats; // of the band, since its last delivery
} BandBuffers;

// Returns the size of the buffer for a film's color and the layers that the kernels of these AOVs fill.
// Unless `buffers` is NULL, its `layers` and `layer_begins` are set.
size_t band_film_size(const Film *film, unsigned aovs, BandBuffers *buffers);

// For as many pixels as the film has.
void band_buffers_open(BandBuffers *buffers, Renderer *renderer, unsigned aovs, Film film);
void band_buffers_close(BandBuffers *buffers);

// The pixels of a work-item or of a work-group.
typedef struct {
    uint32_t width, height;
} TileShape;
TileShape group_shape(const Renderer *renderer);

// The pixels that a launch renders.
typedef struct {
    cl_uint4 band; // x, y, width, height; of a list its length and 1
    TileShape item;
    size_t first[2], items[2], group[2];
} Place;

Place band_place(const Renderer *renderer, BandRows rows);
// Steps through a place in parts of whole work-groups: rows of them, or a part of one row. Each part has at
// most `pixels_max` pixels, or one group. `part` is a Place of zeros before the first step; returns false
// after the last part.
bool place_next(Place *part, const Place *whole, uint64_t pixels_max);
uint64_t place_pixels(const Place *place);
// The tiles of a film's work-items.
size_t film_tile_count(const Renderer *renderer, const Film *film);
// The first `count` pixels of a list.
Place list_place(const Renderer *renderer, uint32_t count);

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

// Renders samples first..last-1 of the place, in launches of the kernel's pace. Returns false if the device
// failed or settings.stop ended it.
bool band_render(Renderer *renderer, const BandBuffers *buffers, const Place *place, uint32_t first,
                 uint32_t last);

// Launches a kernel that fills the AOVs of its list (kernels/aovs.h), paced and stopped as band_render is.
bool band_fill(Renderer *renderer, KernelKind kind, const BandBuffers *buffers, unsigned aovs,
               const Place *place);
