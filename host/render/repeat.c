#include "host/render/repeat.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include <stdlib.h>

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
    band_buffers_open(&repeated, repeat, band->aovs, film);
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
    band_buffers_close(&repeated);
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

void band_repeat(Renderer *renderer, KernelKind kind, unsigned layers, BandBuffers *buffers, unsigned aovs,
                 BandRows rows)
{
    cl_mem doubts = kind == KERNEL_RENDER ? buffers->doubts : buffers->center_doubts;
    const RepeatedBand band = {kind, layers, aovs, buffers,
                               film_of_rows(renderer, rows.first_row, rows.row_count)};
    uint32_t *values = renderer_map(renderer, doubts, film_pixel_count(&band.film) * sizeof *values);
    if (!values) return;
    PixelList list = doubts_list(renderer, rows, values);
    renderer_unmap(renderer, doubts, values);
    if (list.count > 0) {
        RepeatCounts *counts = &buffers->repeats;
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
