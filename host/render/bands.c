// Renders the region band by band. Each launch is short, so that a desktop stays responsive and an interrupt
// takes effect soon; memory is that of a band.
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/render/pace.h"
#include "host/render/renderer_state.h"
#include <math.h>
#include <stdlib.h>

static const double PASS_SECONDS = 0.1; // of renderer_accumulate, about

enum {
    BAND_BYTES_MAX = 4 << 20, // color and shadow, the one layer that grows with the lights
    GROUPS_OF_UNIT_MIN = 4
};

typedef struct {
    uint32_t width, height;
} TileShape;

// The pixels of a work-item: a macro-tile.
static TileShape item_shape(uint32_t lanes)
{
    TileShape tile = {TILE_WIDTH_OF(lanes), TILE_HEIGHT_OF(lanes)};
    return (TileShape){tile.width * MACRO_TILE_COLUMNS_OF(lanes), tile.height * MACRO_TILE_ROWS_OF(lanes)};
}

// Work-items along each side of a group, before the device's limits. Square groups are coherent: neighboring
// pixels hit the same objects. But a work-item with whole tiles is a group of its own: PoCL places the
// private variables of a group's items side by side, and 64 sets of them, each with the rays waiting behind
// glass, exceed the cache.
static size_t group_side(const Renderer *renderer)
{
    bool on_cpu = renderer->compute->device->type & CL_DEVICE_TYPE_CPU;
    return renderer->report.lanes > 1 && on_cpu ? 1 : 8;
}

// The device buffers a band is rendered into.
typedef struct {
    uint32_t rows;
    cl_mem ray_counts, compensation, layers[LAYER_COUNT];
    cl_mem doubts;        // at `certified`: of each pixel's color, how many of its samples are in doubt
    cl_mem center_doubts; // likewise of its AOVs, 0 or 1
    cl_mem pixels;        // where a list is rendered: x and y of each
} BandBuffers;

// The pixels that a launch renders.
typedef struct {
    cl_uint4 band; // x, y, width, height; of a list its length and 1
    size_t items[2], group[2];
} Place;

// The film of these rows, without its layers.
static Film film_of_rows(const Renderer *renderer, uint32_t first_row, uint32_t row_count)
{
    return (Film){.width = renderer->settings.region_width,
                  .height = row_count,
                  .light_count = (uint32_t)renderer->light_count,
                  .first_row = first_row,
                  .is_double = renderer->report.is_double,
                  .real_size = renderer_scalar_size(renderer)};
}

FilmHeader renderer_film_header(const Renderer *renderer, unsigned aovs)
{
    const Film film = film_of_rows(renderer, 0, renderer->settings.region_height);
    FilmHeader header = film_header(&film);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if ((aovs | AOV_COLOR) >> layer & 1 && film_layer_size(&film, layer) > 0)
            header.layers |= UINT64_C(1) << layer;
    return header;
}

static cl_mem film_buffer(Renderer *renderer, size_t size)
{
    return buffer_create(renderer->compute, size, NULL, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR);
}

static bool layer_in(unsigned layers, Layer layer)
{
    return layers >> layer & 1;
}

// For as many pixels as the film has.
static void buffers_open(BandBuffers *buffers, Renderer *renderer, unsigned aovs, Film film)
{
    // a kernel fills all of its layers, but computes shadows only on request
    unsigned filled = AOV_COLOR | (aovs & AOVS_OF_HIT ? AOVS_OF_HIT : 0u) | (aovs & AOVS_OF_PATH);
    buffers->rows = film.height;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        bool empty = layer == LAYER_SHADOW && !(aovs & AOV_SHADOW);
        if (layer_in(filled, layer))
            buffers->layers[layer] = film_buffer(renderer, empty ? 0 : film_layer_size(&film, layer));
    }
    buffers->compensation = film_buffer(renderer, film_layer_size(&film, LAYER_COLOR));
    buffers->ray_counts = film_buffer(renderer, RAYS_COUNT * sizeof(uint32_t));
    const bool is_list = renderer->repeats != REPEATS_NONE;
    const size_t pixels_size = renderer->repeat || is_list ? film_pixel_count(&film) * sizeof(uint32_t) : 0;
    const size_t doubts_size = renderer->repeat ? pixels_size : 0;
    buffers->doubts = film_buffer(renderer, doubts_size);
    buffers->center_doubts = film_buffer(renderer, doubts_size);
    buffers->pixels = film_buffer(renderer, is_list ? 2 * pixels_size : 0);
}

static void buffers_close(BandBuffers *buffers)
{
    buffer_release(buffers->ray_counts);
    buffer_release(buffers->compensation);
    buffer_release(buffers->doubts);
    buffer_release(buffers->center_doubts);
    buffer_release(buffers->pixels);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        buffer_release(buffers->layers[layer]);
    *buffers = (BandBuffers){0};
}

static uint32_t settings_cell(const RenderSettings *settings)
{
    return settings->cell > 0 ? settings->cell : 1;
}

static Place band_place(const Renderer *renderer, BandRows rows)
{
    const RenderSettings *settings = &renderer->settings;
    TileShape item = item_shape(renderer->report.lanes);
    size_t side = group_side(renderer);
    return (Place){
        .band = {{settings->region_x, settings->region_y + rows.first_row * settings_cell(settings),
                  settings->region_width, rows.row_count}},
        .items = {(settings->region_width + item.width - 1) / item.width,
                  (rows.row_count + item.height - 1) / item.height},
        .group = {side, side}};
}

// The first `count` pixels of a list.
static Place list_place(const Renderer *renderer, uint32_t count)
{
    const uint32_t of_item = renderer->report.lanes * renderer->report.lanes;
    size_t side = group_side(renderer);
    return (Place){
        .band = {{0, 0, count, 1}}, .items = {(count + of_item - 1) / of_item, 1}, .group = {side * side, 1}};
}

_Static_assert(sizeof((RenderReport){0}.rays) == RAYS_COUNT * sizeof(uint64_t), "one for each RAYS_…");

static void ray_counts_clear(Renderer *renderer, const BandBuffers *buffers)
{
    const uint32_t zeros[RAYS_COUNT] = {0};
    buffer_write(renderer->compute, buffers->ray_counts, sizeof zeros, zeros);
}

static void ray_counts_add(Renderer *renderer, const BandBuffers *buffers)
{
    uint32_t counts[RAYS_COUNT] = {0};
    buffer_read(renderer->compute, buffers->ray_counts, sizeof counts, counts);
    for (size_t i = 0; i < RAYS_COUNT; i++)
        renderer->report.rays[i] += counts[i];
}

// One launch for samples first..last-1. Returns its seconds: the event's if trusted, else the host's.
static double band_render(Renderer *renderer, const BandBuffers *buffers, const Place *place, uint32_t first,
                          uint32_t last)
{
    cl_kernel kernel = renderer_kernel(renderer, KERNEL_RENDER);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT, sizeof(cl_mem), &renderer->offsets);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 1, sizeof(cl_mem), &buffers->layers[LAYER_COLOR]);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 2, sizeof(cl_mem), &buffers->compensation);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 3, sizeof place->band, &place->band);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 4, sizeof first, &first);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 5, sizeof last, &last);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 6, sizeof(cl_mem), &buffers->ray_counts);
    const uint32_t cell = settings_cell(&renderer->settings);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 7, sizeof cell, &cell);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 8, sizeof(cl_mem), &buffers->doubts);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 9, sizeof(cl_mem), &buffers->pixels);
    if (renderer->settings.counting) ray_counts_clear(renderer, buffers);
    LaunchTime time = renderer_launch(renderer, KERNEL_RENDER, 2, place->items, place->group);
    if (renderer->settings.counting) ray_counts_add(renderer, buffers);
    return time.trusted ? time.event_seconds : time.host_seconds;
}

// Launches a kernel that fills its layers, whose buffers follow the band in its arguments.
static void band_fill(Renderer *renderer, KernelKind kind, unsigned layers, const BandBuffers *buffers,
                      unsigned aovs, const Place *place)
{
    cl_kernel kernel = renderer_kernel(renderer, kind);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT, sizeof place->band, &place->band);
    cl_uint argument = FLAT_COUNT + 1;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (layer_in(layers, layer))
            kernel_argument(renderer->compute, kernel, argument++, sizeof(cl_mem), &buffers->layers[layer]);
    cl_uint shadow_count = aovs & AOV_SHADOW ? (cl_uint)renderer->light_count : 0;
    if (layers & AOV_SHADOW)
        kernel_argument(renderer->compute, kernel, argument++, sizeof shadow_count, &shadow_count);
    kernel_argument(renderer->compute, kernel, argument++, sizeof(cl_mem), &buffers->center_doubts);
    kernel_argument(renderer->compute, kernel, argument, sizeof(cl_mem), &buffers->pixels);
    renderer_launch(renderer, kind, 2, place->items, place->group);
}

// Device lengths converted to the scene's unit: `lengths` itself where the unit is 1, as always at `double`;
// else a float copy, which the caller frees.
static void *lengths_restored(const Renderer *renderer, void *lengths, size_t count)
{
    if (renderer->compiled.unit == 1) return lengths;
    float *restored = memory_allocate(count, sizeof *restored);
    for (size_t i = 0; i < count; i++)
        restored[i] = ((const float *)lengths)[i] * (float)renderer->compiled.unit;
    return restored;
}

// A list's pixels in a band, and what a renderer at double made of them.
typedef struct {
    uint32_t *pixels; // x and y in the image
    uint32_t *index;  // in the band
    uint32_t count;
} PixelList;

// The pixels of a band that have doubts, block by block, so that neighbors share packets.
static PixelList doubts_list(const Renderer *renderer, BandRows rows, const uint32_t *doubts)
{
    enum { BLOCK = 8 };
    const RenderSettings *settings = &renderer->settings;
    const uint32_t width = settings->region_width, cell = settings_cell(settings);
    PixelList list = {0};
    for (size_t i = 0; i < (size_t)width * rows.row_count; i++)
        list.count += doubts[i] != 0;
    if (list.count == 0) return list;
    list.pixels = memory_allocate(list.count, 2 * sizeof *list.pixels);
    list.index = memory_allocate(list.count, sizeof *list.index);
    uint32_t n = 0;
    for (uint32_t block_y = 0; block_y < rows.row_count; block_y += BLOCK)
        for (uint32_t block_x = 0; block_x < width; block_x += BLOCK)
            for (uint32_t y = block_y; y < block_y + BLOCK && y < rows.row_count; y++)
                for (uint32_t x = block_x; x < block_x + BLOCK && x < width; x++) {
                    if (doubts[(size_t)y * width + x] == 0) continue;
                    list.pixels[2 * n] = settings->region_x + x * cell;
                    list.pixels[2 * n + 1] = settings->region_y + (rows.first_row + y) * cell;
                    list.index[n++] = y * width + x;
                }
    return list;
}

// Puts a layer of the list's pixels, of doubles, into the band's, of floats.
static void layer_merge(Renderer *renderer, Layer layer, cl_mem of_list, cl_mem of_band,
                        const PixelList *list, const Film *band)
{
    Renderer *repeat = renderer->repeat;
    const Film film = {.width = list->count,
                       .height = 1,
                       .light_count = band->light_count,
                       .real_size = renderer_scalar_size(repeat)};
    const size_t components = film_components(band, layer), size = film_layer_size(band, layer);
    const bool is_length = layer_types[layer] == LAYER_TYPE_LENGTH;
    void *repeated = memory_allocate(film_layer_size(&film, layer), 1), *values = memory_allocate(size, 1);
    buffer_read(renderer->compute, of_list, film_layer_size(&film, layer), repeated);
    buffer_read(renderer->compute, of_band, size, values);
    for (size_t i = 0; i < list->count; i++)
        for (size_t k = 0; k < components; k++) {
            const size_t from = i * components + k, to = list->index[i] * components + k;
            if (layer_types[layer] == LAYER_TYPE_INTEGER)
                ((uint32_t *)values)[to] = ((const uint32_t *)repeated)[from];
            else
                ((float *)values)[to] =
                    (float)(((const double *)repeated)[from] / (is_length ? renderer->compiled.unit : 1));
        }
    buffer_write(renderer->compute, of_band, size, values);
    free(repeated);
    free(values);
}

static void repeat_launches_take(RenderReport *report, RenderReport *of_repeat)
{
    for (size_t i = 0; i < of_repeat->launches.count; i++)
        array_push(report->launches, ((NamedLaunch){"repeat", of_repeat->launches.items[i].time}));
    report->build_seconds += of_repeat->build_seconds;
    report->build_from_cache &= of_repeat->build_from_cache;
    of_repeat->build_seconds = 0;
    of_repeat->launches.count = 0;
}

// A band of which pixels are repeated: the kernel, the layers that it fills, and their buffers.
typedef struct {
    KernelKind kind;
    unsigned layers, aovs;
    const BandBuffers *buffers;
    Film film;
} RepeatedBand;

// Renders a list of the band's pixels by `repeat`, and puts them into the band's layers. `undecided`: of each
// pixel, how many of its samples `repeat` leaves in doubt; NULL: not asked for.
static void list_repeat(Renderer *renderer, Renderer *repeat, const RepeatedBand *band, const PixelList *list,
                        uint32_t *undecided)
{
    const Film film = {.width = list->count,
                       .height = 1,
                       .light_count = band->film.light_count,
                       .real_size = renderer_scalar_size(repeat)};
    const Place place = list_place(repeat, list->count);
    BandBuffers repeated = {0};
    buffers_open(&repeated, repeat, band->aovs, film);
    buffer_write(repeat->compute, repeated.pixels, list->count * 2 * sizeof *list->pixels, list->pixels);
    if (band->kind == KERNEL_RENDER)
        band_render(repeat, &repeated, &place, 0, renderer->settings.sample_count);
    else
        band_fill(repeat, band->kind, band->layers, &repeated, band->aovs, &place);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (layer_in(band->layers, layer) && layer_in(band->aovs | AOV_COLOR, layer) &&
            film_layer_size(&band->film, layer) > 0)
            layer_merge(renderer, layer, repeated.layers[layer], band->buffers->layers[layer], list,
                        &band->film);
    if (undecided)
        buffer_read(renderer->compute, band->kind == KERNEL_RENDER ? repeated.doubts : repeated.center_doubts,
                    list->count * sizeof *undecided, undecided);
    repeat_launches_take(&renderer->report, &repeat->report);
    buffers_close(&repeated);
}

// Leaves those of the list's pixels that are undecided; returns the number of their undecided samples.
static uint64_t list_keep_undecided(PixelList *list, const uint32_t *undecided)
{
    uint64_t samples = 0;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < list->count; i++) {
        if (undecided[i] == 0) continue;
        samples += undecided[i];
        list->pixels[2 * kept] = list->pixels[2 * i];
        list->pixels[2 * kept + 1] = list->pixels[2 * i + 1];
        list->index[kept++] = list->index[i];
    }
    list->count = kept;
    return samples;
}

// Renders again in double what a kernel has left in doubt, and as at `double` what that leaves undecided.
static void band_repeat(Renderer *renderer, KernelKind kind, unsigned layers, const BandBuffers *buffers,
                        unsigned aovs, BandRows rows)
{
    cl_mem doubts = kind == KERNEL_RENDER ? buffers->doubts : buffers->center_doubts;
    const RepeatedBand band = {kind, layers, aovs, buffers,
                               film_of_rows(renderer, rows.first_row, rows.row_count)};
    uint32_t *values = renderer_map(renderer, doubts, film_pixel_count(&band.film) * sizeof *values);
    if (!values) return;
    PixelList list = doubts_list(renderer, rows, values);
    renderer_unmap(renderer, doubts, values);
    if (list.count > 0) {
        RepeatCounts *counts = &renderer->report.repeats;
        uint32_t *undecided = memory_allocate(list.count, sizeof *undecided);
        counts->repeated +=
            (uint64_t)list.count * (kind == KERNEL_RENDER ? renderer->settings.sample_count : 1);
        list_repeat(renderer, renderer->repeat, &band, &list, undecided);
        if (compute_ok(renderer->compute)) counts->undecided += list_keep_undecided(&list, undecided);
        if (compute_ok(renderer->compute) && list.count > 0)
            list_repeat(renderer, renderer->repeat->repeat, &band, &list, NULL);
        free(undecided);
    }
    free(list.pixels);
    free(list.index);
}

// Where a band goes: to the queue that has its rows, or to a PassSink with its number of samples.
typedef struct {
    const BandQueue *queue;
    PassSink pass_sink;
    uint32_t samples;
    void *context;
} Delivery;

static bool deliver(const Delivery *delivery, const Film *band)
{
    return delivery->queue ? delivery->queue->give(delivery->queue->context, band)
                           : delivery->pass_sink(delivery->context, band, delivery->samples);
}

static bool band_deliver(Renderer *renderer, const BandBuffers *buffers, unsigned layers, BandRows rows,
                         const Delivery *delivery)
{
    Film band = film_of_rows(renderer, rows.first_row, rows.row_count);
    void *mapped[LAYER_COUNT] = {NULL};
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        size_t size = film_layer_size(&band, layer);
        if (!layer_in(layers, layer) || size == 0) continue;
        band.layers[layer] = mapped[layer] = renderer_map(renderer, buffers->layers[layer], size);
        if (layer_types[layer] == LAYER_TYPE_LENGTH && mapped[layer])
            band.layers[layer] = lengths_restored(renderer, mapped[layer], size / band.real_size);
    }
    bool go_on = compute_ok(renderer->compute) && deliver(delivery, &band);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (band.layers[layer] != mapped[layer]) free(band.layers[layer]);
        renderer_unmap(renderer, buffers->layers[layer], mapped[layer]);
    }
    return go_on;
}

// Rows of whole groups.
static uint32_t rows_step(const Renderer *renderer)
{
    return item_shape(renderer->report.lanes).height * (uint32_t)group_side(renderer);
}

// Enough rows for several groups per compute unit: with fewer, the last group to end would idle the others.
static uint32_t rows_min(const Renderer *renderer)
{
    uint32_t group_width = item_shape(renderer->report.lanes).width * (uint32_t)group_side(renderer);
    uint32_t of_row = (renderer->settings.region_width + group_width - 1) / group_width;
    uint32_t wanted = GROUPS_OF_UNIT_MIN * renderer->compute->device->compute_units;
    return (wanted + of_row - 1) / of_row * rows_step(renderer);
}

static uint32_t band_rows(const Renderer *renderer, const Pace *pace, uint32_t sample_count, uint32_t most)
{
    const RenderSettings *settings = &renderer->settings;
    if (settings->band_rows > 0) return settings->band_rows < most ? settings->band_rows : most;
    uint64_t row_samples = (uint64_t)settings->region_width * sample_count;
    uint64_t rows = pace_band_samples(pace) / row_samples;
    uint32_t least = rows_min(renderer);
    if (rows < least) rows = least;
    rows -= rows % rows_step(renderer);
    return rows < most ? (uint32_t)rows : most;
}

static uint32_t rows_max(const Renderer *renderer, unsigned aovs)
{
    const RenderSettings *settings = &renderer->settings;
    if (settings->band_rows > 0) return settings->band_rows;
    const Film row = film_of_rows(renderer, 0, 1);
    size_t row_bytes = film_layer_size(&row, LAYER_COLOR);
    if (aovs & AOV_SHADOW) row_bytes += film_layer_size(&row, LAYER_SHADOW);
    size_t rows = BAND_BYTES_MAX / row_bytes;
    size_t step = rows_step(renderer);
    rows = rows < step ? step : rows - rows % step;
    return rows < settings->region_height ? (uint32_t)rows : settings->region_height;
}

static bool is_stopped(const Renderer *renderer, const Delivery *delivery)
{
    return (renderer->settings.stop && renderer->settings.stop()) ||
           (delivery->queue && delivery->queue->has_ended(delivery->queue->context));
}

// Samples first..end-1 of a band, in launches of the pace. False: failed or stopped.
static bool band_sample(Renderer *renderer, const BandBuffers *buffers, BandRows rows, Pace *pace,
                        uint32_t first, uint32_t end, const Delivery *delivery)
{
    const RenderSettings *settings = &renderer->settings;
    uint64_t pixels = (uint64_t)settings->region_width * rows.row_count;
    const Place place = band_place(renderer, rows);
    bool go_on = true;
    pace_begin_band(pace);
    while (go_on && first < end) {
        uint32_t samples = pace_launch_samples(pace, pixels, end - first);
        double seconds = band_render(renderer, buffers, &place, first, first + samples);
        pace_note_launch(pace, pixels, samples, seconds);
        first += samples;
        go_on = compute_ok(renderer->compute) && !is_stopped(renderer, delivery);
    }
    if (go_on && renderer->repeat && end == settings->sample_count)
        band_repeat(renderer, KERNEL_RENDER, AOV_COLOR, buffers, 0, rows);
    return go_on && compute_ok(renderer->compute);
}

// One ray per pixel.
static void band_fill_aovs(Renderer *renderer, const BandBuffers *buffers, unsigned aovs, BandRows rows)
{
    const Place place = band_place(renderer, rows);
    const struct {
        KernelKind kind;
        unsigned layers;
    } fills[] = {{KERNEL_AOV, AOVS_OF_HIT}, {KERNEL_PATH, AOVS_OF_PATH}};
    for (size_t i = 0; i < sizeof fills / sizeof *fills; i++) {
        if (!(aovs & fills[i].layers)) continue;
        band_fill(renderer, fills[i].kind, fills[i].layers, buffers, aovs, &place);
        if (renderer->repeat) band_repeat(renderer, fills[i].kind, fills[i].layers, buffers, aovs, rows);
    }
}

static Pace pace_start(const RenderSettings *settings)
{
    return (Pace){.target_seconds = settings->band_seconds > 0 ? settings->band_seconds : 0.1};
}

bool renderer_work(Renderer *renderer, unsigned aovs, const BandQueue *queue)
{
    const RenderSettings *settings = &renderer->settings;
    const Compute *compute = renderer->compute;
    const Delivery delivery = {.queue = queue};
    const uint32_t step = settings->band_rows > 0 ? settings->band_rows : rows_step(renderer);
    BandBuffers buffers = {0};
    buffers_open(&buffers, renderer, aovs, film_of_rows(renderer, 0, rows_max(renderer, aovs)));
    renderer_kernel(renderer, KERNEL_RENDER); // builds it before rows wait for it
    Pace pace = pace_start(settings);
    bool go_on = compute_ok(compute);
    while (go_on) {
        uint32_t wanted = band_rows(renderer, &pace, settings->sample_count, buffers.rows);
        BandRows rows = queue->take(queue->context, wanted, step);
        if (rows.row_count == 0) break;
        go_on = band_sample(renderer, &buffers, rows, &pace, 0, settings->sample_count, &delivery);
        if (!go_on) break;
        band_fill_aovs(renderer, &buffers, aovs, rows);
        go_on = band_deliver(renderer, &buffers, aovs | AOV_COLOR, rows, &delivery);
    }
    buffers_close(&buffers);
    return go_on && compute_ok(compute);
}

typedef struct {
    BandRows rows;
    BandBuffers buffers;
} PassBand;

typedef struct {
    PassBand *items;
    size_t count, capacity;
} PassBands;

// The first pass divides the image into bands, each with buffers of its own.
static bool first_pass(Renderer *renderer, PassBands *bands, unsigned aovs, Pace *pace, Delivery *delivery)
{
    const uint32_t height = renderer->settings.region_height;
    const uint32_t most = rows_max(renderer, aovs);
    bool go_on = compute_ok(renderer->compute);
    delivery->samples = 1;
    for (uint32_t row = 0; go_on && row < height;) {
        uint32_t left = height - row;
        PassBand band = {.rows = {row, band_rows(renderer, pace, 1, left < most ? left : most)}};
        buffers_open(&band.buffers, renderer, aovs, film_of_rows(renderer, 0, band.rows.row_count));
        array_push(*bands, band);
        go_on = band_sample(renderer, &band.buffers, band.rows, pace, 0, 1, delivery) &&
                band_deliver(renderer, &band.buffers, AOV_COLOR, band.rows, delivery);
        row += band.rows.row_count;
    }
    return go_on;
}

static bool aov_pass(Renderer *renderer, const PassBands *bands, unsigned aovs, const Delivery *delivery)
{
    const RenderSettings *settings = &renderer->settings;
    bool go_on = true;
    for (size_t i = 0; go_on && i < bands->count; i++) {
        const PassBand *band = &bands->items[i];
        band_fill_aovs(renderer, &band->buffers, aovs, band->rows);
        go_on = band_deliver(renderer, &band->buffers, aovs, band->rows, delivery) &&
                !(settings->stop && settings->stop());
    }
    return go_on;
}

bool renderer_accumulate(Renderer *renderer, unsigned aovs, PassSink sink, void *context)
{
    const uint32_t count = renderer->settings.sample_count;
    Delivery delivery = {.pass_sink = sink, .context = context};
    PassBands bands = {0};
    Pace pace = pace_start(&renderer->settings);
    double start = clock_seconds(), seconds_of_sample;
    bool go_on = first_pass(renderer, &bands, aovs, &pace, &delivery);
    seconds_of_sample = clock_seconds() - start;
    if (go_on && aovs) go_on = aov_pass(renderer, &bands, aovs, &delivery);
    while (go_on && delivery.samples < count) {
        uint32_t first = delivery.samples;
        delivery.samples += (uint32_t)fmax(1, fmin(PASS_SECONDS / seconds_of_sample, count - first));
        start = clock_seconds();
        for (size_t i = 0; go_on && i < bands.count; i++) {
            const PassBand *band = &bands.items[i];
            go_on = band_sample(renderer, &band->buffers, band->rows, &pace, first, delivery.samples,
                                &delivery) &&
                    band_deliver(renderer, &band->buffers, AOV_COLOR, band->rows, &delivery);
        }
        seconds_of_sample = (clock_seconds() - start) / (delivery.samples - first);
    }
    for (size_t i = 0; i < bands.count; i++)
        buffers_close(&bands.items[i].buffers);
    free(bands.items);
    return go_on && compute_ok(renderer->compute);
}

static bool film_take_band(void *film, const Film *band, double fraction_done)
{
    (void)fraction_done;
    film_copy_band(film, band);
    return true;
}

bool renderer_render_film(Renderer *renderer, unsigned aovs, Film *film)
{
    const RenderSettings *settings = &renderer->settings;
    *film =
        film_allocate(settings->region_width, settings->region_height, (uint32_t)renderer->light_count, aovs);
    film->is_double = renderer->report.is_double;
    bool whole = renderer_render(renderer, aovs, film_take_band, film);
    if (!whole) film_free(film);
    return whole;
}
