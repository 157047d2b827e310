// Renders the region band by band. Each launch is short, so that a desktop stays responsive and an interrupt
// takes effect soon. Only one band at a time is in memory.
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/render/renderer_state.h"
#include "host/render/rerender.h"
#include <math.h>
#include <stdlib.h>

static const double round_seconds = 0.1; // the approximate duration of a round of renderer_accumulate

enum { BAND_BYTES_MAX = 4 << 20 }; // color and shadow, the one layer that grows with the lights

FilmHeader renderer_film_header(const Renderer *renderer, unsigned aovs)
{
    const Pass *pass = &renderer->passes[PASS_ALL];
    const Film film = film_of_rows(pass, 0, pass->settings.region_height);
    FilmHeader header = film_header(&film);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (layer_in(aovs | AOV_COLOR, layer) && film_layer_size(&film, layer) > 0)
            header.layers |= UINT64_C(1) << layer;
    return header;
}

// Returns the device's lengths converted to the scene's unit: `lengths` itself if the unit is 1, as always at
// `double`, else a float copy, which the caller frees.
static void *lengths_restored(const Pass *pass, void *lengths, size_t count)
{
    if (pass->scene.compiled.unit == 1) return lengths;
    float *restored = memory_allocate(count, sizeof *restored);
    for (size_t i = 0; i < count; i++)
        restored[i] = ((const float *)lengths)[i] * (float)pass->scene.compiled.unit;
    return restored;
}

// Delivers layers of a band whose color has `samples` samples.
static bool band_deliver(Pass *pass, BandBuffers *buffers, unsigned layers, BandRows rows, uint32_t samples,
                         const BandQueue *queue)
{
    Film band = film_of_rows(pass, rows.first_row, rows.row_count);
    band.samples = samples;
    band.rerenders = buffers->rerenders;
    buffers->rerenders = (RerenderCounts){0};
    void *mapped[LAYER_COUNT] = {NULL};
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        size_t size = film_layer_size(&band, layer);
        if (!layer_in(layers, layer) || size == 0) continue;
        band.layers[layer] = mapped[layer] = band_map(pass, buffers, layer, CL_MAP_READ);
        if (layer_types[layer] == LAYER_TYPE_LENGTH && mapped[layer])
            band.layers[layer] = lengths_restored(pass, mapped[layer], size / band.real_size);
    }
    bool continues = compute_ok(pass->compute) && queue->deliver(queue->context, &band);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (band.layers[layer] != mapped[layer]) free(band.layers[layer]);
        compute_unmap(pass->compute, buffers->film, mapped[layer]);
    }
    return continues;
}

static uint32_t band_rows(const Pass *pass, const Pace *pace, uint32_t sample_count, uint32_t most)
{
    const RenderSettings *settings = &pass->settings;
    if (settings->band_rows > 0) return settings->band_rows < most ? settings->band_rows : most;
    const TileShape group = group_shape(pass);
    // with fewer rows the device would not be busy
    const uint32_t row_groups = (settings->region_width + group.width - 1) / group.width,
                   busy_groups = (uint32_t)(pace->samples_min / group.width / group.height),
                   least = (busy_groups + row_groups - 1) / row_groups * group.height;
    uint64_t rows = pace_band_samples(pace) / ((uint64_t)settings->region_width * sample_count);
    if (rows < least) rows = least;
    rows -= rows % group.height;
    return rows < most ? (uint32_t)rows : most;
}

static uint32_t rows_max(Pass *pass, unsigned aovs)
{
    const RenderSettings *settings = &pass->settings;
    if (settings->band_rows > 0) return settings->band_rows;
    const Film row = film_of_rows(pass, 0, 1);
    size_t row_bytes = film_layer_size(&row, LAYER_COLOR);
    if (aovs & AOV_SHADOW) row_bytes += film_layer_size(&row, LAYER_SHADOW);
    size_t rows = BAND_BYTES_MAX / row_bytes;
    const size_t step = group_shape(pass).height;
    rows = rows < step ? step : rows - rows % step;
    // the film fits one buffer, even where all of its pixels are re-rendered in double precision
    BandBuffers layout = {0};
    const size_t row_size = band_film_layout(&row, aovs, &layout);
    for (; pass; pass = pass_next(pass)) {
        const uint64_t largest = pass->compute->device->largest_buffer_bytes,
                       fitting = largest / (2 * row_size);
        if (largest > 0 && rows > fitting)
            rows = (size_t)(fitting > step ? fitting - fitting % step : fitting);
    }
    if (rows == 0) rows = 1;
    return rows < settings->region_height ? (uint32_t)rows : settings->region_height;
}

// Renders samples first..end-1 of a band. Returns false if the device failed or the render is stopped.
static bool band_sample(Pass *pass, BandBuffers *buffers, BandRows rows, uint32_t first, uint32_t end,
                        const BandQueue *queue)
{
    const LaunchRange range = launch_range_of_rows(pass, rows);
    if (first == pass->settings.first_sample) flag_layer_clear(pass, buffers, rows);
    if (buffers->records_size > 0) band_record(pass, buffers, &range);
    bool continues = samples_render(pass, buffers, &range, first, end, queue);
    if (continues && pass->certifies && end == samples_end(&pass->settings))
        continues = band_rerender(pass, KERNEL_RENDER, AOV_COLOR, buffers, 0, rows);
    return continues && compute_ok(pass->compute);
}

// Traces rays for the AOVs. Returns false if the device failed or the render is stopped.
static bool band_fill_aovs(Pass *pass, BandBuffers *buffers, unsigned aovs, BandRows rows)
{
    const LaunchRange range = launch_range_of_rows(pass, rows);
    const struct {
        KernelType type;
        unsigned layers;
    } fills[] = {{KERNEL_AOV, AOVS_OF_HIT}, {KERNEL_PATH, AOVS_OF_PATH}, {KERNEL_COVERAGE, AOVS_OF_SAMPLES}};
    for (size_t i = 0; i < COUNT_OF(fills); i++) {
        if (!(aovs & fills[i].layers)) continue;
        if (!band_fill(pass, fills[i].type, buffers, aovs, &range)) return false;
        if (pass->certifies && !band_rerender(pass, fills[i].type, fills[i].layers, buffers, aovs, rows))
            return false;
    }
    return true;
}

bool renderer_work(Renderer *renderer, unsigned aovs, const BandQueue *queue)
{
    Pass *pass = &renderer->passes[PASS_ALL];
    const RenderSettings *settings = &pass->settings;
    const Compute *compute = pass->compute;
    const uint32_t step = settings->band_rows > 0 ? settings->band_rows : group_shape(pass).height;
    const uint32_t end = samples_end(settings);
    BandBuffers buffers = {0};
    band_buffers_open(&buffers, pass, aovs, film_of_rows(pass, 0, rows_max(pass, aovs)), true);
    kernels_get(&pass->kernels, KERNEL_RENDER); // builds it before rows wait for it
    Pace *pace = &pass->kernels.paces[KERNEL_RENDER];
    pace_begin_band(pace); // the last render's band may belong to another scene or size
    bool continues = compute_ok(compute);
    while (continues) {
        uint32_t wanted = band_rows(pass, pace, samples_rendered(settings), buffers.rows);
        BandRows rows = queue->acquire(queue->context, wanted, step);
        if (rows.row_count == 0) break;
        const double start = clock_seconds();
        continues = band_sample(pass, &buffers, rows, settings->first_sample, end, queue) &&
                    band_fill_aovs(pass, &buffers, aovs, rows) &&
                    band_deliver(pass, &buffers, aovs | AOV_COLOR, rows, end, queue);
        array_push(renderer->report.bands, ((HostSpan){"band", start, clock_seconds()}));
    }
    band_buffers_close(&buffers, pass);
    return continues && compute_ok(compute);
}

typedef struct {
    BandRows rows;
    BandBuffers buffers;
} AccumulatedBand;

typedef ARRAY_OF(AccumulatedBand) AccumulatedBands;

// Renders the first round, which divides the image into bands, each with separate buffers.
static bool first_round(Pass *pass, AccumulatedBands *bands, unsigned aovs, const BandQueue *queue)
{
    Pace *pace = &pass->kernels.paces[KERNEL_RENDER];
    pace_begin_band(pace);
    const uint32_t height = pass->settings.region_height;
    const uint32_t most = rows_max(pass, aovs);
    bool continues = compute_ok(pass->compute);
    for (uint32_t row = 0; continues && row < height;) {
        uint32_t left = height - row;
        AccumulatedBand band = {.rows = {row, band_rows(pass, pace, 1, left < most ? left : most)}};
        band_buffers_open(&band.buffers, pass, aovs, film_of_rows(pass, 0, band.rows.row_count), false);
        array_push(*bands, band);
        continues = band_sample(pass, &band.buffers, band.rows, 0, 1, queue) &&
                    band_deliver(pass, &band.buffers, AOV_COLOR, band.rows, 1, queue);
        row += band.rows.row_count;
    }
    return continues;
}

bool renderer_accumulate(Renderer *renderer, unsigned aovs, BandSink sink, void *context)
{
    Pass *pass = &renderer->passes[PASS_ALL];
    const uint32_t count = pass->settings.sample_count;
    const unsigned last_layers = AOV_COLOR | (aovs & AOV_FLAG); // the last sample flags pixels
    const BandQueue queue = {.deliver = sink, .context = context};
    AccumulatedBands bands = {0};
    double start = clock_seconds(), seconds_of_sample;
    bool continues = first_round(pass, &bands, aovs, &queue);
    seconds_of_sample = clock_seconds() - start;
    for (size_t i = 0; continues && aovs && i < bands.count; i++) {
        AccumulatedBand *band = &bands.items[i];
        continues = band_fill_aovs(pass, &band->buffers, aovs, band->rows) &&
                    band_deliver(pass, &band->buffers, aovs, band->rows, 1, &queue);
    }
    for (uint32_t first = 1, end; continues && first < count; first = end) {
        end = first + (uint32_t)fmax(1, fmin(round_seconds / seconds_of_sample, count - first));
        start = clock_seconds();
        for (size_t i = 0; continues && i < bands.count; i++) {
            AccumulatedBand *band = &bands.items[i];
            continues = band_sample(pass, &band->buffers, band->rows, first, end, &queue) &&
                        band_deliver(pass, &band->buffers, end < count ? AOV_COLOR : last_layers, band->rows,
                                     end, &queue);
        }
        seconds_of_sample = (clock_seconds() - start) / (end - first);
    }
    for (size_t i = 0; i < bands.count; i++)
        band_buffers_close(&bands.items[i].buffers, pass);
    free(bands.items);
    return continues && compute_ok(pass->compute);
}

static bool film_receive_band(void *film, const Film *band)
{
    film_copy_band(film, band);
    return true;
}

bool renderer_render_film(Renderer *renderer, unsigned aovs, Film *film)
{
    const Pass *pass = &renderer->passes[PASS_ALL];
    const RenderSettings *settings = &pass->settings;
    *film = film_allocate(settings->region_width, settings->region_height, pass_light_count(pass), aovs);
    film->is_double = pass->scene.is_double;
    bool whole = renderer_render(renderer, aovs, film_receive_band, film);
    if (!whole) film_free(film);
    return whole;
}
