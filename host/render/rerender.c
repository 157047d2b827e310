#include "host/render/rerender.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include <stdlib.h>
#include <string.h>

// A flagged pixel, as kernels read it (Band in kernels/film.h).
typedef struct {
    uint32_t x, y;  // in the image
    uint32_t index; // in the band
} ListPixel;

typedef struct {
    ListPixel *items;
    size_t count, capacity;
} PixelList;

// Lists the flagged pixels of a band tile by tile, so that neighbors share packets.
static PixelList flagged_list(const Renderer *renderer, BandRows rows, const uint32_t *flags,
                              size_t word_count)
{
    const RenderSettings *settings = &renderer->settings;
    const uint32_t lanes = renderer->report.lanes, columns = MACRO_TILE_COLUMNS_OF(lanes),
                   tile_width = TILE_WIDTH_OF(lanes), tile_height = TILE_HEIGHT_OF(lanes),
                   width = settings->region_width, cell = settings_cell(settings);
    const uint32_t items_of_row = (width + columns * tile_width - 1) / (columns * tile_width);
    PixelList list = {0};
    for (uint32_t i = 0; i < word_count; i++)
        for (uint32_t bits = flags[i]; bits != 0; bits &= bits - 1) {
            const uint32_t number = 32 * i + (uint32_t)__builtin_ctz(bits), lane = number % lanes,
                           tile = number / lanes, which = tile % lanes, item = tile / lanes;
            const uint32_t x =
                (item % items_of_row * columns + which % columns) * tile_width + lane % tile_width;
            const uint32_t y =
                (item / items_of_row * MACRO_TILE_ROWS_OF(lanes) + which / columns) * tile_height +
                lane / tile_width;
            array_push(list, ((ListPixel){settings->region_x + x * cell,
                                          settings->region_y + (rows.first_row + y) * cell, y * width + x}));
        }
    return list;
}

// Copies a layer of the list's pixels, in double, to the band's layer, in float.
static void layer_merge(Renderer *renderer, Layer layer, const BandBuffers *list_buffers,
                        const BandBuffers *band_buffers, const PixelList *list, const Film *band)
{
    Renderer *next_pass = renderer->next_pass; // perhaps on another device
    const size_t components = film_components(band, layer);
    const bool is_length = layer_types[layer] == LAYER_TYPE_LENGTH;
    void *values = band_map(renderer, band_buffers, layer, CL_MAP_READ | CL_MAP_WRITE);
    void *rerendered = memory_allocate(list_buffers->layer_sizes[layer], 1);
    const bool is_read = renderer_read(next_pass, list_buffers->film, list_buffers->layer_begins[layer],
                                       list_buffers->layer_sizes[layer], rerendered);
    for (size_t i = 0; i < list->count && values && is_read; i++)
        for (size_t k = 0; k < components; k++) {
            const size_t from = i * components + k, to = list->items[i].index * components + k;
            if (layer_types[layer] == LAYER_TYPE_INTEGER)
                ((uint32_t *)values)[to] = ((const uint32_t *)rerendered)[from];
            else
                ((float *)values)[to] = (float)(((const double *)rerendered)[from] /
                                                (is_length ? renderer->scene.compiled.unit : 1));
        }
    free(rerendered);
    renderer_unmap(renderer, band_buffers->film, values);
}

static void launches_collect(RenderReport *report, RenderReport *next_report)
{
    for (size_t i = 0; i < next_report->launches.count; i++)
        array_push(report->launches, ((NamedLaunch){"re-render", next_report->launches.items[i].time}));
    for (size_t i = 0; i < next_report->reads.count; i++)
        array_push(report->reads, next_report->reads.items[i]);
    report->build_seconds += next_report->build_seconds;
    report->build_from_cache &= next_report->build_from_cache;
    report->is_out_of_line |= next_report->is_out_of_line;
    for (size_t i = 0; i < next_report->builds.count; i++)
        array_push(report->builds, next_report->builds.items[i]);
    next_report->build_seconds = 0;
    next_report->builds.count = 0;
    next_report->launches.count = next_report->reads.count = 0;
}

// A band whose flagged pixels are re-rendered: the kernel, the layers that it fills, and their buffers.
typedef struct {
    KernelType type;
    unsigned layers, aovs;
    const BandBuffers *buffers;
    Film film;
} RerenderedBand;

void band_clear_flags(Renderer *renderer, const BandBuffers *buffers, BandRows rows)
{
    if (!layer_in(buffers->layers, LAYER_FLAG)) return;
    const Film band = film_of_rows(renderer, rows.first_row, rows.row_count);
    const size_t size = film_layer_size(&band, LAYER_FLAG);
    void *values = band_map(renderer, buffers, LAYER_FLAG, CL_MAP_READ | CL_MAP_WRITE);
    if (values) memset(values, 0, size);
    renderer_unmap(renderer, buffers->film, values);
}

// Raises the value of the layer `flag` of the list's pixels to at least `flag`.
static void flags_raise(Renderer *renderer, const RerenderedBand *band, const PixelList *list, uint32_t flag)
{
    const BandBuffers *buffers = band->buffers;
    if (!layer_in(buffers->layers, LAYER_FLAG)) return;
    uint32_t *values = band_map(renderer, buffers, LAYER_FLAG, CL_MAP_READ | CL_MAP_WRITE);
    for (size_t i = 0; values && i < list->count; i++) {
        uint32_t *value = &values[list->items[i].index];
        if (*value < flag) *value = flag;
    }
    renderer_unmap(renderer, buffers->film, values);
}

// Writes a list's pixels and behind them their counts of uncertain samples, which kernels set at sample 0
// only.
static void list_write(Renderer *renderer, cl_mem flags, const PixelList *list)
{
    const size_t size = list->count * sizeof *list->items,
                 count_size = renderer->settings.first_sample > 0 ? list->count * sizeof(uint32_t) : 0;
    char *bytes = memory_allocate_zeroed(size + count_size, 1);
    memcpy(bytes, list->items, size);
    buffer_write(renderer->compute, flags, size + count_size, bytes);
    free(bytes);
}

// Renders all samples of a list. Returns false if the device failed or settings.stop ended the render.
static bool list_render(Renderer *renderer, const BandBuffers *buffers, const Place *place)
{
    const uint32_t end = samples_end(&renderer->settings);
    Pace *pace = renderer_pace(renderer, KERNEL_RENDER);
    pace_begin_band(pace);
    for (uint32_t first = renderer->settings.first_sample, samples; first < end; first += samples) {
        samples = pace_begin_pass(pace, place_pixels(place), end - first);
        if (!band_render(renderer, buffers, place, first, first + samples)) return false;
    }
    return true;
}

// Renders a list of the band's pixels by `next_pass` and copies them to the band's layers. Unless it is NULL,
// `uncertified` receives the number of uncertain samples that each pixel still has. Returns false if a device
// failed or settings.stop ended the render.
static bool list_rerender(Renderer *renderer, Renderer *next_pass, const RerenderedBand *band,
                          const PixelList *list, uint32_t *uncertified)
{
    const Film film = {.width = (uint32_t)list->count,
                       .height = 1,
                       .light_count = band->film.light_count,
                       .real_size = renderer_scalar_size(next_pass)};
    const Place place = list_place(next_pass, (uint32_t)list->count);
    BandBuffers rerendered = {0};
    band_buffers_open(&rerendered, next_pass, band->aovs, film);
    const bool is_last = samples_end(&next_pass->settings) == next_pass->settings.sample_count;
    rerendered.band_film = is_last && next_pass->compute == renderer->compute ? band->buffers->film : NULL;
    list_write(next_pass, rerendered.flags, list);
    const bool whole = band->type == KERNEL_RENDER
                           ? list_render(next_pass, &rerendered, &place)
                           : band_fill(next_pass, band->type, &rerendered, band->aovs, &place);
    for (Layer layer = 0; layer < LAYER_COUNT && whole; layer++)
        if (layer_in(band->layers, layer) && layer_in(band->aovs | AOV_COLOR, layer) &&
            !(layer == LAYER_COLOR && rerendered.band_film) && film_layer_size(&band->film, layer) > 0)
            layer_merge(renderer, layer, &rerendered, band->buffers, list, &band->film);
    const bool is_read =
        whole &&
        (!uncertified || renderer_read(next_pass, rerendered.flags, list->count * sizeof *list->items,
                                       list->count * sizeof *uncertified, uncertified));
    launches_collect(&renderer->report, &next_pass->report);
    band_buffers_close(&rerendered, next_pass);
    return compute_check_reference(renderer->compute) && is_read;
}

// Keeps the pixels of the list that are uncertified. Returns the number of their uncertified samples.
static uint64_t list_keep_uncertified(PixelList *list, const uint32_t *uncertified)
{
    uint64_t samples = 0;
    size_t kept = 0;
    for (size_t i = 0; i < list->count; i++) {
        samples += uncertified[i];
        if (uncertified[i] > 0) list->items[kept++] = list->items[i];
    }
    list->count = kept;
    return samples;
}

bool band_rerender(Renderer *renderer, KernelType type, unsigned layers, BandBuffers *buffers, unsigned aovs,
                   BandRows rows)
{
    cl_mem flags = type == KERNEL_RENDER ? buffers->flags : buffers->center_flags;
    const RerenderedBand band = {type, layers, aovs, buffers,
                                 film_of_rows(renderer, rows.first_row, rows.row_count)};
    const size_t word_count = film_flag_words(renderer, &band.film);
    uint32_t *words = memory_allocate(word_count, sizeof *words);
    bool is_whole = renderer_read(renderer, flags, 0, word_count * sizeof *words, words);
    PixelList list = {0};
    if (is_whole) list = flagged_list(renderer, rows, words, word_count);
    free(words);
    if (list.count > 0) {
        RerenderCounts *counts = &buffers->rerenders;
        const RenderSettings *settings = &renderer->settings;
        const uint32_t samples_of_pixel = samples_end(settings) - settings->first_sample;
        uint32_t *uncertified = memory_allocate(list.count, sizeof *uncertified);
        counts->rerendered +=
            (uint64_t)list.count * (type == KERNEL_AOV || type == KERNEL_PATH ? 1 : samples_of_pixel);
        flags_raise(renderer, &band, &list, FLAG_RERENDERED);
        is_whole = list_rerender(renderer, renderer->next_pass, &band, &list, uncertified);
        if (is_whole) counts->uncertified += list_keep_uncertified(&list, uncertified);
        if (is_whole && list.count > 0) {
            flags_raise(renderer, &band, &list, FLAG_UNCERTIFIED);
            is_whole = list_rerender(renderer, renderer->next_pass->next_pass, &band, &list, NULL);
        }
        free(uncertified);
    }
    free(list.items);
    return is_whole;
}
