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
static TileShape group_items(const Pass *pass)
{
    const Device *device = pass->compute->device;
    const size_t *fixed = device->work_group;
    if (fixed[0] > 0) return (TileShape){(uint32_t)fixed[0], (uint32_t)fixed[1]};
    const bool on_cpu = device->type & CL_DEVICE_TYPE_CPU;
    const uint32_t side = pass->lanes > 1 && on_cpu ? 1 : 8;
    return (TileShape){side, side};
}

TileShape group_shape(const Pass *pass)
{
    const TileShape item = item_shape(pass->lanes);
    const TileShape group = group_items(pass);
    return (TileShape){item.width * group.width, item.height * group.height};
}

Film film_of_rows(const Pass *pass, uint32_t first_row, uint32_t row_count)
{
    return (Film){.width = pass->settings.region_width,
                  .height = row_count,
                  .light_count = pass_light_count(pass),
                  .first_row = first_row,
                  .is_double = pass->scene.is_double,
                  .real_size = pass_scalar_size(pass)};
}

static size_t divide_up(uint32_t count, uint32_t by)
{
    return (count + by - 1) / by; // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult): is defined
}

static size_t words_of_items(const size_t items[2], TileShape item)
{
    return (items[0] * items[1] * item.width * item.height + 31) / 32;
}

size_t film_flag_words(const Pass *pass, const Film *film)
{
    const TileShape item = item_shape(pass->lanes);
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

void band_buffers_open(BandBuffers *buffers, Pass *pass, unsigned aovs, Film film)
{
    buffers->rows = film.height;
    buffers->film = spare_buffer_acquire(&pass->spares, pass->compute, band_film_size(&film, aovs, buffers));
    buffers->ray_counts = spare_buffer_acquire(&pass->spares, pass->compute, RAYS_COUNT * sizeof(uint32_t));
    const bool is_list = pass->type != PASS_ALL;
    const size_t words = is_list           ? 4 * film_pixel_count(&film)
                         : pass->certifies ? film_flag_words(pass, &film)
                                           : 0;
    buffers->flags = spare_buffer_acquire(&pass->spares, pass->compute, words * sizeof(uint32_t));
    buffers->center_flags =
        spare_buffer_acquire(&pass->spares, pass->compute, is_list ? 0 : words * sizeof(uint32_t));
}

void band_buffers_close(BandBuffers *buffers, Pass *pass)
{
    spare_buffer_release(&pass->spares, buffers->film);
    spare_buffer_release(&pass->spares, buffers->ray_counts);
    spare_buffer_release(&pass->spares, buffers->flags);
    spare_buffer_release(&pass->spares, buffers->center_flags);
    *buffers = (BandBuffers){0};
}

void *band_map(Pass *pass, const BandBuffers *buffers, Layer layer, cl_map_flags access)
{
    return pass_map(pass, buffers->film, buffers->layer_begins[layer], buffers->layer_sizes[layer], access);
}

Place band_place(const Pass *pass, BandRows rows)
{
    const RenderSettings *settings = &pass->settings;
    const TileShape item = item_shape(pass->lanes);
    const TileShape group = group_items(pass);
    return (Place){
        .band = {{settings->region_x, settings->region_y + rows.first_row * settings_cell(settings),
                  settings->region_width, rows.row_count}},
        .item = item,
        .items = {divide_up(settings->region_width, item.width), divide_up(rows.row_count, item.height)},
        .group = {group.width, group.height}};
}

Place list_place(const Pass *pass, uint32_t count)
{
    const uint32_t of_item = pass->lanes * pass->lanes;
    const TileShape group = group_items(pass);
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

Pace *pass_pace(Pass *pass, KernelType type)
{
    const RenderSettings *settings = &pass->settings;
    const TileShape group = group_shape(pass);
    Pace *pace = &pass->kernels.paces[type];
    pace->target_seconds = settings->band_seconds > 0 ? settings->band_seconds : 0.1;
    pace->samples_min =
        (double)GROUPS_OF_UNIT_MIN * pass->compute->device->compute_units * group.width * group.height;
    return pace;
}

// Launches the kernel over the place, part by part, with `samples` per pixel.
static bool place_launch(Pass *pass, KernelType type, const Place *place, uint32_t samples)
{
    Pace *pace = pass_pace(pass, type);
    const RenderSettings *settings = &pass->settings;
    Place part = {0};
    while (place_next(&part, place, pace_launch_samples(pace) / samples)) {
        const double seconds = kernels_launch(&pass->kernels, type, 2, part.first, part.items, part.group);
        pace_record_launch(pace, place_pixels(&part) * samples, seconds);
        if (!compute_ok(pass->compute) || (settings->stop && settings->stop(settings->stop_context)))
            return false;
    }
    return true;
}

static void buffer_clear(Pass *pass, cl_mem buffer, size_t size)
{
    void *zeros = memory_allocate_zeroed(size, 1);
    buffer_write(pass->compute, buffer, size, zeros);
    free(zeros);
}

// Clears the flags of a band, which kernels only set.
static void flags_clear(Pass *pass, cl_mem flags, const Place *place)
{
    if (pass->certifies && pass->type == PASS_ALL)
        buffer_clear(pass, flags, words_of_items(place->items, place->item) * sizeof(uint32_t));
}

static void ray_counts_add(Pass *pass, const BandBuffers *buffers)
{
    uint32_t counts[RAYS_COUNT] = {0};
    buffer_read(pass->compute, buffers->ray_counts, sizeof counts, counts);
    for (size_t i = 0; i < RAYS_COUNT; i++)
        pass->report->rays[i] += counts[i];
}

bool band_render(Pass *pass, const BandBuffers *buffers, const Place *place, uint32_t first, uint32_t last)
{
    Compute *compute = pass->compute;
    cl_kernel kernel = kernels_get(&pass->kernels, KERNEL_RENDER);
    const uint32_t cell = settings_cell(&pass->settings);
    const size_t sums_size = (size_t)2 * 3 * place->band.s[2] * place->band.s[3] * pass_scalar_size(pass);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT, pass->sample_offsets);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 1, buffers->film);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 2, sizeof place->band, &place->band);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 3, sizeof first, &first);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 4, sizeof last, &last);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 5, buffers->ray_counts);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 6, sizeof cell, &cell);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 7, buffers->flags);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 8, buffers->band_film);
    if (first == pass->settings.first_sample) {
        flags_clear(pass, buffers->flags, place);
        // kernels set the sums and their compensation to 0 at sample 0 only
        if (first > 0) buffer_clear(pass, buffers->film, sums_size);
    }
    if (pass->settings.counting) buffer_clear(pass, buffers->ray_counts, RAYS_COUNT * sizeof(uint32_t));
    const bool continues = place_launch(pass, KERNEL_RENDER, place, last - first);
    if (pass->settings.counting) ray_counts_add(pass, buffers);
    return continues;
}

bool band_fill(Pass *pass, KernelType type, const BandBuffers *buffers, unsigned aovs, const Place *place)
{
    Compute *compute = pass->compute;
    cl_kernel kernel = kernels_get(&pass->kernels, type);
    LayerOffsets offsets;
#define OFFSET_SET(NAME, name, ...)                                                                          \
    offsets.name = (unsigned)(buffers->layer_begins[LAYER_##NAME] / ARENA_UNIT);
    LAYER_LIST(OFFSET_SET)
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT, sizeof place->band, &place->band);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 1, buffers->film);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 2, sizeof offsets, &offsets);
    const bool is_list = pass->type != PASS_ALL;
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 3,
                  is_list ? buffers->flags : buffers->center_flags);
    const cl_uint shadow_count = aovs & AOV_SHADOW ? pass_light_count(pass) : 0;
    if (type == KERNEL_AOV)
        kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 4, sizeof shadow_count, &shadow_count);
    if (type == KERNEL_COVERAGE)
        kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 4, pass->sample_offsets);
    flags_clear(pass, buffers->center_flags, place);
    pace_begin_band(pass_pace(pass, type));
    return place_launch(pass, type, place, type == KERNEL_COVERAGE ? pass->settings.sample_count : 1);
}
