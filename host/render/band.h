// Renders the pixels of one launch, a band of rows or a list, into the device's buffers.
#pragma once

#include "host/render/launch_range.h"
#include "host/render/scheduler.h"

// The records of a band's ray trees, as kernels read them from a uint4 (kernels/shading/decisions.h).
typedef struct {
    uint32_t slots, first_sample, samples;
    uint32_t begin; // offset in the film's buffer, in ARENA_UNITs
} BandRecords;
_Static_assert(sizeof(BandRecords) == sizeof(cl_uint4), "kernels read it as a vector");

typedef struct {
    uint32_t rows;
    cl_mem film;                      // one layer after another
    unsigned layers;                  // the set of the film's layers
    size_t layer_begins[LAYER_COUNT]; // offsets in the film, in bytes
    size_t layer_sizes[LAYER_COUNT];  // in bytes, for all rows
    cl_mem ray_counts;
    // At `certified`, a bit for each pixel, tile by tile, set where its color is uncertain. In a list, first
    // each pixel's x, y, index in the band and slot in the records, then each pixel's number of uncertain
    // samples.
    cl_mem flags;
    cl_mem center_flags; // the same bits for the AOVs' rays
    cl_mem band_film;    // in a list, receives its colors, or NULL
    BandRecords records; // behind the film; in a list, those of its band
    size_t records_size;
    RerenderCounts rerenders; // since the band's last delivery
} BandBuffers;

// Sets the `layers`, `layer_begins` and `layer_sizes` of the buffer for a film's color and the layers that
// the kernels of these AOVs fill. Returns the buffer's size.
size_t band_film_layout(const Film *film, unsigned aovs, BandBuffers *buffers);

// Provides the buffers for as many pixels as the film has. band_buffers_close keeps them for later bands.
// With `records`, they have room to record ray trees.
void band_buffers_open(BandBuffers *buffers, Pass *pass, unsigned aovs, Film film, bool records);
void band_buffers_close(BandBuffers *buffers, Pass *pass);

// Maps all rows of a layer of the film as pass_map does, however few the band has, because NVIDIA's driver
// takes 1 to 2 ms to map a range whose size differs from the last one's.
void *band_map(Pass *pass, const BandBuffers *buffers, Layer layer, cl_map_flags access);

// Returns the description of the film of these rows, with no layers.
Film film_of_rows(const Pass *pass, uint32_t first_row, uint32_t row_count);

// Arranges the records for the first of the range's samples, as many as fit. Call it before the first of them
// is rendered.
void band_record(Pass *pass, BandBuffers *buffers, const LaunchRange *range);

// Renders samples first..end-1 of the range in launches whose size the kernel's pace decides. Returns false
// if the device failed, or if settings.stop or the queue, which may be NULL, ended the render.
bool samples_render(Pass *pass, const BandBuffers *buffers, const LaunchRange *range, uint32_t first,
                    uint32_t end, const BandQueue *queue);

// Launches a kernel that fills its AOVs (kernels/aovs.h) in launches whose size the kernel's pace decides.
// Returns false if the device failed or settings.stop ended the render.
bool band_fill(Pass *pass, KernelType type, const BandBuffers *buffers, unsigned aovs,
               const LaunchRange *range);
