#include "host/render/band.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include <stdlib.h>

enum { GROUPS_OF_UNIT_MIN = 4 }; // with fewer, the other compute units would idle while the last group ends

// Returns the size of a work-item's macro-tile in pixels.
static TileShape item_shape(uint32_t lanes)
{
    const uint32_t width = TILE_WIDTH_OF(lanes), height = TILE_HEIGHT_OF(lanes);
    return (TileShape){width * MACRO_TILE_COLUMNS_OF(lanes), height * MACRO_TILE_ROWS_OF(lanes)};
}

// Returns the work-items of a group, by --work-group or before the device's limits apply. Square groups are
// coherent, since neighboring pixels hit the same objects. A work-item that renders whole tiles is alone in
// its group, because PoCL places the private variables of a group's items next to each other. 64 sets of
// them, each with the rays waiting behind glass, would exceed the cache.
static TileShape group_items(const Renderer *renderer)
{
    const Device *device = renderer->compute->device;
    const size_t *fixed = device->work_group;
    if (fixed[0] > 0) return (TileShape){(uint32_t)fixed[0], (uint32_t)fixed[1]};
    const bool on_cpu = device->type & CL_DEVICE_TYPE_CPU;
    const uint32_t side = renderer->report.lanes > 1 && on_cpu ? 1 : 8;
    return (TileShape){side, side};
}

TileShape group_shape(const Renderer *renderer)
{
    const TileShape item = item_shape(renderer->report.lanes);
    const TileShape group = group_items(renderer);
    return (TileShape){item.width * group.width, item.height * group.height};
}

Film film_of_rows(const Renderer *renderer, uint32_t first_row, uint32_t row_count)
{
    return (Film){.width = renderer->settings.region_width,
                  .height = row_count,
                  .light_count = renderer_light_count(renderer),
                  .first_row = first_row,
                  .is_double = renderer->report.is_double,
                  .real_size = renderer_scalar_size(renderer)};
}

static size_t divide_up(uint32_t count, uint32_t by)
{
    return (count + by - 1) / by; // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult): is defined
}

static size_t words_of_items(const size_t items[2], TileShape item)
{
    return (items[0] * items[1] * item.width * item.height + 31) / 32;
}

size_t film_flag_words(const Renderer *renderer, const Film *film)
{
    const TileShape item = item_shape(renderer->report.lanes);
    const size_t items[] = {divide_up(film->width, item.width), divide_up(film->height, item.height)};
    return words_of_items(items, item);
}

size_t band_film_size(const Film *film, unsigned aovs, BandBuffers *buffers)
{
    // a kernel fills all of its layers, but computes shadows only on request
    const unsigned filled = AOV_COLOR | (aovs & AOVS_OF_HIT ? AOVS_OF_HIT : 0u) |
                            (aovs & AOVS_OF_SAMPLES ? AOVS_OF_SAMPLES : 0u) |
                            (aovs & (AOVS_OF_PATH | AOV_FLAG));
    size_t end = (size_t)padded_size(2 * film_layer_size(film, LAYER_COLOR)); // with its compensation
    if (buffers) {
        buffers->layers = filled;
        buffers->layer_sizes[LAYER_COLOR] = film_layer_size(film, LAYER_COLOR);
    }
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (layer == LAYER_COLOR || !layer_in(filled, layer)) continue;
        if (buffers) {
            buffers->layer_begins[layer] = end;
            buffers->layer_sizes[layer] = film_layer_size(film, layer);
        }
        if (layer != LAYER_SHADOW || aovs & AOV_SHADOW)
            end += (size_t)padded_size(film_layer_size(film, layer));
    }
    return end;
}

void band_buffers_open(BandBuffers *buffers, Renderer *renderer, unsigned aovs, Film film)
{
    buffers->rows = film.height;
    buffers->film = spare_buffer_acquire(renderer, band_film_size(&film, aovs, buffers));
    buffers->ray_counts = spare_buffer_acquire(renderer, RAYS_COUNT * sizeof(uint32_t));
    const bool is_list = renderer->pass != PASS_ALL;
    const size_t words = is_list               ? 4 * film_pixel_count(&film)
                         : renderer->next_pass ? film_flag_words(renderer, &film)
                                               : 0;
    buffers->flags = spare_buffer_acquire(renderer, words * sizeof(uint32_t));
    buffers->center_flags = spare_buffer_acquire(renderer, is_list ? 0 : words * sizeof(uint32_t));
}

void band_buffers_close(BandBuffers *buffers, Renderer *renderer)
{
    spare_buffer_release(renderer, buffers->film);
    spare_buffer_release(renderer, buffers->ray_counts);
    spare_buffer_release(renderer, buffers->flags);
    spare_buffer_release(renderer, buffers->center_flags);
    *buffers = (BandBuffers){0};
}

void *band_map(Renderer *renderer, const BandBuffers *buffers, Layer layer, cl_map_flags access)
{
    return renderer_map(renderer, buffers->film, buffers->layer_begins[layer], buffers->layer_sizes[layer],
                        access);
}

Place band_place(const Renderer *renderer, BandRows rows)
{
    const RenderSettings *settings = &renderer->settings;
    const TileShape item = item_shape(renderer->report.lanes);
    const TileShape group = group_items(renderer);
    return (Place){
        .band = {{settings->region_x, settings->region_y + rows.first_row * settings_cell(settings),
                  settings->region_width, rows.row_count}},
        .item = item,
        .items = {divide_up(settings->region_width, item.width), divide_up(rows.row_count, item.height)},
        .group = {group.width, group.height}};
}

Place list_place(const Renderer *renderer, uint32_t count)
{
    const uint32_t of_item = renderer->report.lanes * renderer->report.lanes;
    const TileShape group = group_items(renderer);
    return (Place){.band = {{0, 0, count, 1}},
                   .item = {of_item, 1},
                   .items = {divide_up(count, of_item), 1},
                   .group = {(size_t)group.width * group.height, 1}};
}

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

// Returns how many of the `left` groups are next, at most `most`. The last two parts are about equal, since a
// small launch would slow the growth of the launches that follow.
static size_t groups_of_part(size_t most, size_t left)
{
    return left <= most ? left : left < 2 * most ? (left + 1) / 2 : most;
}

bool place_next(Place *part, const Place *whole, uint64_t pixels_max)
{
    const size_t *group = whole->group, *items = whole->items;
    size_t column = part->first[0] + part->items[0], row = part->first[1];
    if (column >= items[0]) {
        column = 0;
        row += part->items[1];
    }
    if (row >= items[1]) return false;
    *part = *whole;
    // groups at the edges reach beyond the film
    if (row == 0 && column == 0 && place_pixels(whole) <= pixels_max) return true;
    const size_t group_pixels = group[0] * group[1] * whole->item.width * whole->item.height;
    const size_t most = pixels_max > group_pixels ? (size_t)(pixels_max / group_pixels) : 1;
    const size_t row_groups = (items[0] + group[0] - 1) / group[0];
    const size_t groups_right = (items[0] - column + group[0] - 1) / group[0];
    const size_t rows_below = (items[1] - row + group[1] - 1) / group[1];
    const bool has_whole_rows = column == 0 && most >= row_groups;
    const size_t columns = has_whole_rows ? row_groups : groups_of_part(most, groups_right);
    const size_t rows = has_whole_rows ? groups_of_part(most / row_groups, rows_below) : 1;
    part->first[0] = column;
    part->first[1] = row;
    part->items[0] = least(columns * group[0], items[0] - column);
    part->items[1] = least(rows * group[1], items[1] - row);
    return true;
}

uint64_t place_pixels(const Place *place)
{
    const size_t left = place->first[0] * place->item.width, top = place->first[1] * place->item.height;
    const uint64_t width = least(place->items[0] * place->item.width, place->band.s[2] - left);
    return width * least(place->items[1] * place->item.height, place->band.s[3] - top);
}

Pace *renderer_pace(Renderer *renderer, KernelType type)
{
    const RenderSettings *settings = &renderer->settings;
    const TileShape group = group_shape(renderer);
    Pace *pace = &renderer->paces[type];
    pace->target_seconds = settings->band_seconds > 0 ? settings->band_seconds : 0.1;
    pace->samples_min =
        (double)GROUPS_OF_UNIT_MIN * renderer->compute->device->compute_units * group.width * group.height;
    return pace;
}

// Launches the kernel over the place, part by part, with `samples` per pixel.
static bool place_launch(Renderer *renderer, KernelType type, const Place *place, uint32_t samples)
{
    Pace *pace = renderer_pace(renderer, type);
    const RenderSettings *settings = &renderer->settings;
    Place part = {0};
    while (place_next(&part, place, pace_launch_samples(pace) / samples)) {
        const double seconds = renderer_launch(renderer, type, 2, part.first, part.items, part.group);
        pace_record_launch(pace, place_pixels(&part) * samples, seconds);
        if (!compute_ok(renderer->compute) || (settings->stop && settings->stop(settings->stop_context)))
            return false;
    }
    return true;
}

// Clears the flags of a band, which kernels only set.
static void flags_clear(Renderer *renderer, cl_mem flags, const Place *place)
{
    if (!renderer->next_pass || renderer->pass != PASS_ALL) return;
    const size_t word_count = words_of_items(place->items, place->item);
    uint32_t *words = memory_allocate_zeroed(word_count, sizeof *words);
    buffer_write(renderer->compute, flags, word_count * sizeof *words, words);
    free(words);
}

// Sets the sums and their compensation to 0, which kernels do at sample 0 only.
static void sums_clear(Renderer *renderer, const BandBuffers *buffers, const Place *place)
{
    const size_t pixels = (size_t)place->band.s[2] * place->band.s[3],
                 size = 2 * 3 * pixels * renderer_scalar_size(renderer);
    void *zeros = memory_allocate_zeroed(size, 1);
    buffer_write(renderer->compute, buffers->film, size, zeros);
    free(zeros);
}

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

bool band_render(Renderer *renderer, const BandBuffers *buffers, const Place *place, uint32_t first,
                 uint32_t last)
{
    Compute *compute = renderer->compute;
    cl_kernel kernel = renderer_kernel(renderer, KERNEL_RENDER);
    const uint32_t cell = settings_cell(&renderer->settings);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT, renderer->sample_offsets);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 1, buffers->film);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 2, sizeof place->band, &place->band);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 3, sizeof first, &first);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 4, sizeof last, &last);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 5, buffers->ray_counts);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 6, sizeof cell, &cell);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 7, buffers->flags);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 8, buffers->band_film);
    if (first == renderer->settings.first_sample) {
        flags_clear(renderer, buffers->flags, place);
        if (first > 0) sums_clear(renderer, buffers, place);
    }
    if (renderer->settings.counting) ray_counts_clear(renderer, buffers);
    const bool continues = place_launch(renderer, KERNEL_RENDER, place, last - first);
    if (renderer->settings.counting) ray_counts_add(renderer, buffers);
    return continues;
}

bool band_fill(Renderer *renderer, KernelType type, const BandBuffers *buffers, unsigned aovs,
               const Place *place)
{
    Compute *compute = renderer->compute;
    cl_kernel kernel = renderer_kernel(renderer, type);
    LayerOffsets offsets;
#define OFFSET_SET(NAME, name, ...)                                                                          \
    offsets.name = (unsigned)(buffers->layer_begins[LAYER_##NAME] / ARENA_UNIT);
    LAYER_LIST(OFFSET_SET)
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT, sizeof place->band, &place->band);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 1, buffers->film);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 2, sizeof offsets, &offsets);
    const bool is_list = renderer->pass != PASS_ALL;
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 3,
                  is_list ? buffers->flags : buffers->center_flags);
    const cl_uint shadow_count = aovs & AOV_SHADOW ? renderer_light_count(renderer) : 0;
    if (type == KERNEL_AOV)
        kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 4, sizeof shadow_count, &shadow_count);
    if (type == KERNEL_COVERAGE)
        kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 4, renderer->sample_offsets);
    flags_clear(renderer, buffers->center_flags, place);
    pace_begin_band(renderer_pace(renderer, type));
    return place_launch(renderer, type, place, type == KERNEL_COVERAGE ? renderer->settings.sample_count : 1);
}
