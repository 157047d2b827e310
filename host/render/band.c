#include "host/render/band.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/compile/features.h"
#include <stdlib.h>

// Holds a sample of 1280x720 pixels if rays are refracted (RECORDED_NODES_OF in kernels/types.h).
static const uint64_t most_record_bytes = 1 << 27;

Film film_of_rows(const Pass *pass, uint32_t first_row, uint32_t row_count)
{
    return (Film){.width = pass->settings.region_width,
                  .height = row_count,
                  .light_count = pass_light_count(pass),
                  .first_row = first_row,
                  .is_double = pass->scene.is_double,
                  .real_size = pass_scalar_size(pass)};
}

size_t band_film_layout(const Film *film, unsigned aovs, BandBuffers *buffers)
{
    // a kernel fills all of its layers, but computes shadows only on request
    const unsigned filled = AOV_COLOR | (aovs & AOVS_OF_HIT ? AOVS_OF_HIT : 0u) |
                            (aovs & AOVS_OF_SAMPLES ? AOVS_OF_SAMPLES : 0u) |
                            (aovs & (AOVS_OF_PATH | AOV_FLAG));
    size_t end = (size_t)padded_size(2 * film_layer_size(film, LAYER_COLOR)); // with its compensation
    buffers->layers = filled;
    buffers->layer_sizes[LAYER_COLOR] = film_layer_size(film, LAYER_COLOR);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (layer == LAYER_COLOR || !layer_in(filled, layer)) continue;
        buffers->layer_begins[layer] = end;
        buffers->layer_sizes[layer] = film_layer_size(film, layer);
        if (layer != LAYER_SHADOW || aovs & AOV_SHADOW)
            end += (size_t)padded_size(film_layer_size(film, layer));
    }
    return end;
}

// Returns whether the pass that re-renders flagged pixels may read what this one records of ray trees. It
// runs after the last sample, and kernels without a BVH or bounces have nothing to record.
static bool pass_records(Pass *pass)
{
    const uint64_t features = pass->scene.compiled.features;
    return pass->type == PASS_ALL && pass->certifies && pass_next(pass)->compute == pass->compute &&
           samples_end(&pass->settings) == pass->settings.sample_count && features & FEATURE_BVH &&
           features & (FEATURE_REFLECTION | FEATURE_TRANSMISSION);
}

// Returns how many bytes the records of a sample take.
static size_t records_sample_size(const Pass *pass, const LaunchRange *range)
{
    const size_t nodes = RECORDED_NODES_OF(pass->scene.compiled.features & FEATURE_TRANSMISSION);
    return 32 * launch_range_flag_words(range) * nodes * RECORD_WORDS * sizeof(uint32_t);
}

// Returns the maximum size of the records of ray trees, which follow the film in its buffer.
static size_t records_size_max(const Pass *pass, size_t film_size)
{
    const Device *device = pass->compute->device;
    uint64_t most = most_record_bytes;
    if (device->memory_bytes > 0 && device->memory_bytes / 32 < most) most = device->memory_bytes / 32;
    if (device->largest_buffer_bytes == 0) return (size_t)most;
    const uint64_t left =
        device->largest_buffer_bytes > film_size ? device->largest_buffer_bytes - film_size : 0;
    return (size_t)(left < most ? left : most);
}

void band_record(Pass *pass, BandBuffers *buffers, const LaunchRange *range)
{
    const size_t samples = samples_rendered(&pass->settings),
                 fitting = buffers->records_size / records_sample_size(pass, range);
    buffers->records.slots = (uint32_t)(32 * launch_range_flag_words(range));
    buffers->records.first_sample = pass->settings.first_sample;
    buffers->records.samples = (uint32_t)(fitting < samples ? fitting : samples);
}

void band_buffers_open(BandBuffers *buffers, Pass *pass, unsigned aovs, Film film, bool records)
{
    buffers->rows = film.height;
    const bool is_list = pass->type != PASS_ALL;
    const LaunchRange range = launch_range_of_rows(pass, (BandRows){0, film.height});
    const size_t film_size = band_film_layout(&film, aovs, buffers);
    if (records && pass_records(pass)) {
        const size_t needed = samples_rendered(&pass->settings) * records_sample_size(pass, &range),
                     most = records_size_max(pass, film_size);
        buffers->records_size = needed < most ? needed : most;
        buffers->records.begin = (uint32_t)(film_size / ARENA_UNIT);
    }
    buffers->film = buffer_pool_acquire(&pass->pool, pass->compute, film_size + buffers->records_size);
    buffers->ray_counts = buffer_pool_acquire(&pass->pool, pass->compute, RAYS_COUNT * sizeof(uint32_t));
    const size_t words = is_list           ? (LIST_WORDS + 1) * film_pixel_count(&film)
                         : pass->certifies ? launch_range_flag_words(&range)
                                           : 0;
    buffers->flags = buffer_pool_acquire(&pass->pool, pass->compute, words * sizeof(uint32_t));
    buffers->center_flags =
        buffer_pool_acquire(&pass->pool, pass->compute, is_list ? 0 : words * sizeof(uint32_t));
}

void band_buffers_close(BandBuffers *buffers, Pass *pass)
{
    buffer_pool_release(&pass->pool, buffers->film);
    buffer_pool_release(&pass->pool, buffers->ray_counts);
    buffer_pool_release(&pass->pool, buffers->flags);
    buffer_pool_release(&pass->pool, buffers->center_flags);
    *buffers = (BandBuffers){0};
}

void *band_map(Pass *pass, const BandBuffers *buffers, Layer layer, cl_map_flags access)
{
    return pass_map(pass, buffers->film, buffers->layer_begins[layer], buffers->layer_sizes[layer], access);
}

static void buffer_clear(Pass *pass, cl_mem buffer, size_t size)
{
    OWNED void *zeros = memory_allocate_zeroed(size, 1);
    buffer_write(pass->compute, buffer, size, zeros);
}

// Clears the bits of uncertain pixels, which kernels only set.
static void uncertain_bits_clear(Pass *pass, cl_mem flags, const LaunchRange *range)
{
    if (pass->certifies && pass->type == PASS_ALL)
        buffer_clear(pass, flags, launch_range_flag_words(range) * sizeof(uint32_t));
}

static void ray_counts_add(Pass *pass, const BandBuffers *buffers)
{
    uint32_t counts[RAYS_COUNT] = {0};
    buffer_read(pass->compute, buffers->ray_counts, sizeof counts, counts);
    for (size_t i = 0; i < RAYS_COUNT; i++)
        pass->report->rays[i] += counts[i];
}

// Launches the kernel over the range, part by part, with `samples` per pixel. The rays of each launch are
// counted separately, because a counter has 32 bits.
static bool range_launch(Pass *pass, KernelType type, const BandBuffers *buffers, const LaunchRange *range,
                         uint32_t samples)
{
    Pace *pace = &pass->kernels.paces[type];
    const RenderSettings *settings = &pass->settings;
    const bool is_counting = settings->counting && type == KERNEL_RENDER;
    LaunchRange part = {0};
    while (launch_range_next(&part, range, pace_launch_samples(pace) / samples)) {
        if (is_counting) buffer_clear(pass, buffers->ray_counts, RAYS_COUNT * sizeof(uint32_t));
        const double seconds = kernels_launch(&pass->kernels, type, 2, part.first, part.items, part.group);
        pace_record_launch(pace, launch_range_pixels(&part) * samples, seconds);
        if (is_counting) ray_counts_add(pass, buffers);
        if (!compute_ok(pass->compute) || (settings->stop && settings->stop(settings->stop_context)))
            return false;
    }
    return true;
}

// Renders samples first..last-1 of the range. Returns false if the device failed or settings.stop ended the
// render.
static bool sweep_render(Pass *pass, const BandBuffers *buffers, const LaunchRange *range, uint32_t first,
                         uint32_t last)
{
    Compute *compute = pass->compute;
    cl_kernel kernel = kernels_get(&pass->kernels, KERNEL_RENDER);
    const uint32_t cell = settings_cell(&pass->settings);
    const size_t sums_size = (size_t)2 * 3 * range->band.s[2] * range->band.s[3] * pass_scalar_size(pass);
    cl_uint argument = SCENE_ARGUMENT_COUNT;
    kernel_buffer(compute, kernel, argument++, pass->sample_offsets);
    kernel_buffer(compute, kernel, argument++, buffers->film);
    kernel_argument(compute, kernel, argument++, sizeof range->band, &range->band);
    kernel_argument(compute, kernel, argument++, sizeof first, &first);
    kernel_argument(compute, kernel, argument++, sizeof last, &last);
    kernel_buffer(compute, kernel, argument++, buffers->ray_counts);
    kernel_argument(compute, kernel, argument++, sizeof cell, &cell);
    kernel_buffer(compute, kernel, argument++, buffers->flags);
    kernel_buffer(compute, kernel, argument++, buffers->band_film);
    kernel_argument(compute, kernel, argument, sizeof buffers->records, &buffers->records);
    if (first == pass->settings.first_sample) {
        uncertain_bits_clear(pass, buffers->flags, range);
        // kernels set the sums and their compensation to 0 at sample 0 only
        if (first > 0) buffer_clear(pass, buffers->film, sums_size);
    }
    return range_launch(pass, KERNEL_RENDER, buffers, range, last - first);
}

bool samples_render(Pass *pass, const BandBuffers *buffers, const LaunchRange *range, uint32_t first,
                    uint32_t end, const BandQueue *queue)
{
    Pace *pace = &pass->kernels.paces[KERNEL_RENDER];
    pace_begin_band(pace);
    for (uint32_t samples; first < end; first += samples) {
        samples = pace_begin_sweep(pace, launch_range_pixels(range), end - first);
        if (!sweep_render(pass, buffers, range, first, first + samples)) return false;
        if (queue && queue->has_ended && queue->has_ended(queue->context)) return false;
    }
    return true;
}

bool band_fill(Pass *pass, KernelType type, const BandBuffers *buffers, unsigned aovs,
               const LaunchRange *range)
{
    Compute *compute = pass->compute;
    cl_kernel kernel = kernels_get(&pass->kernels, type);
    LayerOffsets offsets;
#define OFFSET_SET(NAME, name, ...)                                                                          \
    offsets.name = (unsigned)(buffers->layer_begins[LAYER_##NAME] / ARENA_UNIT);
    LAYER_LIST(OFFSET_SET)
    const bool is_list = pass->type != PASS_ALL;
    const cl_uint shadow_count = aovs & AOV_SHADOW ? pass_light_count(pass) : 0;
    cl_uint argument = SCENE_ARGUMENT_COUNT;
    kernel_argument(compute, kernel, argument++, sizeof range->band, &range->band);
    kernel_buffer(compute, kernel, argument++, buffers->film);
    kernel_argument(compute, kernel, argument++, sizeof offsets, &offsets);
    kernel_buffer(compute, kernel, argument++, is_list ? buffers->flags : buffers->center_flags);
    if (type == KERNEL_AOV) kernel_argument(compute, kernel, argument, sizeof shadow_count, &shadow_count);
    if (type == KERNEL_COVERAGE) kernel_buffer(compute, kernel, argument, pass->sample_offsets);
    uncertain_bits_clear(pass, buffers->center_flags, range);
    pace_begin_band(&pass->kernels.paces[type]);
    return range_launch(pass, type, buffers, range,
                        type == KERNEL_COVERAGE ? pass->settings.sample_count : 1);
}
