#include "host/render/rerender.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include <stdlib.h>
#include <string.h>

// A flagged pixel, as kernels read it (Band in kernels/film.h).
typedef struct {
    uint32_t x, y;  // in the image
    uint32_t index; // in the band
    uint32_t slot;  // in the records of the band's ray trees
} ListPixel;
_Static_assert(sizeof(ListPixel) == LIST_WORDS * sizeof(uint32_t), "kernels read it as words");

typedef ARRAY_OF(ListPixel) PixelList;

// Lists the flagged pixels of a band tile by tile, so that neighbors share packets.
static PixelList flagged_list(const Pass *pass, BandRows rows, const uint32_t *flags, size_t word_count)
{
    const RenderSettings *settings = &pass->settings;
    const uint32_t lanes = pass->lanes, columns = MACRO_TILE_COLUMNS_OF(lanes),
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
            array_push(
                list, ((ListPixel){settings->region_x + x * cell,
                                   settings->region_y + (rows.first_row + y) * cell, y * width + x, number}));
        }
    return list;
}

// A band whose flagged pixels are re-rendered: its pass, the kernel, the layers that it fills, and their
// buffers.
typedef struct {
    Pass *pass;
    KernelType type;
    unsigned layers, aovs;
    const BandBuffers *buffers;
    Film film;
} RerenderedBand;

// Copies a layer of the list's pixels, which another pass rendered in double, to the band's layer, in float.
static void layer_merge(const RerenderedBand *band, Layer layer, const PixelList *list, Pass *other,
                        const BandBuffers *list_buffers)
{
    const size_t components = film_components(&band->film, layer);
    const double unit = layer_types[layer] == LAYER_TYPE_LENGTH ? band->pass->scene.compiled.unit : 1;
    void *values = band_map(band->pass, band->buffers, layer, CL_MAP_READ | CL_MAP_WRITE);
    OWNED void *rerendered = memory_allocate(list_buffers->layer_sizes[layer], 1);
    const bool is_read = pass_read(other, list_buffers->film, list_buffers->layer_begins[layer],
                                   list_buffers->layer_sizes[layer], rerendered);
    for (size_t i = 0; i < list->count && values && is_read; i++)
        for (size_t k = 0; k < components; k++) {
            const size_t from = i * components + k, to = list->items[i].index * components + k;
            if (layer_types[layer] == LAYER_TYPE_INTEGER)
                ((uint32_t *)values)[to] = ((const uint32_t *)rerendered)[from];
            else
                ((float *)values)[to] = (float)(((const double *)rerendered)[from] / unit);
        }
    compute_unmap(band->pass->compute, band->buffers->film, values);
}

void flag_layer_clear(Pass *pass, const BandBuffers *buffers, BandRows rows)
{
    if (!layer_in(buffers->layers, LAYER_FLAG)) return;
    const Film band = film_of_rows(pass, rows.first_row, rows.row_count);
    const size_t size = film_layer_size(&band, LAYER_FLAG);
    void *values = band_map(pass, buffers, LAYER_FLAG, CL_MAP_READ | CL_MAP_WRITE);
    if (values) memset(values, 0, size);
    compute_unmap(pass->compute, buffers->film, values);
}

_Static_assert((int)FLAG_RERENDERED == PASS_FLAGGED && (int)FLAG_UNCERTIFIED == PASS_UNCERTIFIED,
               "a pixel's flag is the last pass that renders it");

// Raises the value of the layer `flag` of the list's pixels to at least `flag`.
static void flags_raise(const RerenderedBand *band, const PixelList *list, uint32_t flag)
{
    const BandBuffers *buffers = band->buffers;
    if (!layer_in(buffers->layers, LAYER_FLAG)) return;
    uint32_t *values = band_map(band->pass, buffers, LAYER_FLAG, CL_MAP_READ | CL_MAP_WRITE);
    for (size_t i = 0; values && i < list->count; i++) {
        uint32_t *value = &values[list->items[i].index];
        if (*value < flag) *value = flag;
    }
    compute_unmap(band->pass->compute, buffers->film, values);
}

// Writes a list's pixels and behind them their counts of uncertain samples, which kernels set at sample 0
// only.
static void list_write(Pass *pass, cl_mem flags, const PixelList *list)
{
    const size_t size = list->count * sizeof *list->items,
                 count_size = pass->settings.first_sample > 0 ? list->count * sizeof(uint32_t) : 0;
    OWNED char *bytes = memory_allocate_zeroed(size + count_size, 1);
    memcpy(bytes, list->items, size);
    buffer_write(pass->compute, flags, size + count_size, bytes);
}

// Keeps the pixels of a rendered list that the pass flags. Adds their uncertain samples to the count.
static bool list_keep_flagged(Pass *pass, const BandBuffers *buffers, PixelList *list, uint64_t *sample_count)
{
    OWNED uint32_t *uncertain = memory_allocate(list->count, sizeof *uncertain);
    const bool is_read = pass_read(pass, buffers->flags, list->count * sizeof *list->items,
                                   list->count * sizeof *uncertain, uncertain);
    size_t kept = 0;
    for (size_t i = 0; i < list->count && is_read; i++) {
        *sample_count += uncertain[i];
        if (uncertain[i] > 0) list->items[kept++] = list->items[i];
    }
    list->count = kept;
    return is_read;
}

// Renders a list of the band's pixels in another pass, copies them to the band's layers and keeps those that
// the pass flags. Returns false if a device failed or settings.stop ended the render.
static bool list_rerender(Pass *pass, const RerenderedBand *band, PixelList *list, uint64_t *uncertified)
{
    const Film film = {.width = (uint32_t)list->count,
                       .height = 1,
                       .light_count = band->film.light_count,
                       .real_size = pass_scalar_size(pass)};
    const LaunchRange range = launch_range_of_list(pass, (uint32_t)list->count);
    BandBuffers buffers = {0};
    band_buffers_open(&buffers, pass, band->aovs, film, false);
    const uint32_t first = pass->settings.first_sample, end = samples_end(&pass->settings);
    if (end == pass->settings.sample_count && pass->compute == band->pass->compute) {
        buffers.band_film = band->buffers->film;
        buffers.records = band->buffers->records;
    }
    list_write(pass, buffers.flags, list);
    bool is_whole = band->type == KERNEL_RENDER ? samples_render(pass, &buffers, &range, first, end, NULL)
                                                : band_fill(pass, band->type, &buffers, band->aovs, &range);
    for (Layer layer = 0; layer < LAYER_COUNT && is_whole; layer++)
        if (layer_in(band->layers, layer) && layer_in(band->aovs | AOV_COLOR, layer) &&
            !(layer == LAYER_COLOR && buffers.band_film) && film_layer_size(&band->film, layer) > 0)
            layer_merge(band, layer, list, pass, &buffers);
    if (is_whole && pass->certifies) is_whole = list_keep_flagged(pass, &buffers, list, uncertified);
    band_buffers_close(&buffers, pass);
    return compute_check_reference(band->pass->compute) && is_whole;
}

bool band_rerender(Pass *pass, KernelType type, unsigned layers, BandBuffers *buffers, unsigned aovs,
                   BandRows rows)
{
    const RerenderedBand band = {pass, type,    layers,
                                 aovs, buffers, film_of_rows(pass, rows.first_row, rows.row_count)};
    const LaunchRange range = launch_range_of_rows(pass, rows);
    const size_t word_count = launch_range_flag_words(&range);
    OWNED uint32_t *words = memory_allocate(word_count, sizeof *words);
    bool is_whole = pass_read(pass, type == KERNEL_RENDER ? buffers->flags : buffers->center_flags, 0,
                              word_count * sizeof *words, words);
    PixelList list = {0};
    if (is_whole) list = flagged_list(pass, rows, words, word_count);
    const bool has_samples = type != KERNEL_AOV && type != KERNEL_PATH;
    const uint32_t samples = has_samples ? samples_rendered(&pass->settings) : 1;
    buffers->rerenders.rerendered += (uint64_t)list.count * samples;
    for (Pass *next = pass_next(pass); next && is_whole && list.count > 0; next = pass_next(next)) {
        flags_raise(&band, &list, (uint32_t)next->type);
        is_whole = list_rerender(next, &band, &list, &buffers->rerenders.uncertified);
    }
    free(list.items);
    return is_whole;
}
