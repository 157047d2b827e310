// Rendering the region band by band: each launch short enough for a desktop to stay usable and for an
// interrupt to be heard, memory that of a band.
#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/render/pace.h"
#include "host/render/renderer_state.h"
#include "host/render/sample_pattern.h"
#include <stdlib.h>

enum {
    BAND_BYTES_LARGEST = 4 << 20, // of one film
    GROUPS_OF_UNIT_LEAST = 4
};

typedef struct {
    uint32_t width, height;
} TileShape;

static TileShape tile_shape(uint32_t lanes)
{
    return (TileShape){TILE_WIDTH_OF(lanes), TILE_HEIGHT_OF(lanes)};
}

// The pixels of all tiles that a work-item carries, as ITEM_TILES in kernels/film.h has it.
static TileShape item_shape(uint32_t lanes)
{
    TileShape shape = tile_shape(lanes);
    if (lanes > 1) shape.width *= ITEM_TILES_LARGEST;
    return shape;
}

// Work-items along each side of a group, fewer where the device takes fewer. Neighboring pixels meet the same
// objects. But a work-item that carries whole tiles of them makes a group of its own: PoCL lays out the
// private variables of a group's items side by side, and those of 64, each with room for the rays that wait
// behind glass, are more than a cache holds.
static size_t group_side(const Renderer *renderer)
{
    bool on_cpu = renderer->compute->device->type & CL_DEVICE_TYPE_CPU;
    return renderer->report.lanes > 1 && on_cpu ? 1 : 8;
}

// The buffers that a band is rendered into, sized for `rows`.
typedef struct {
    uint32_t rows;
    cl_mem offsets, ray_counts, colors, losses, ray, t, normal, position, object, shadow, path;
} Film;

static size_t film_pixels(const Renderer *renderer, uint32_t rows)
{
    return (size_t)renderer->settings.region_width * rows;
}

static size_t film_shadow_size(const Renderer *renderer, uint32_t rows)
{
    return film_pixels(renderer, rows) * renderer->light_count * sizeof(uint32_t);
}

static cl_mem film_buffer(Renderer *renderer, size_t size)
{
    return buffer_create(renderer->compute, size, NULL, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR);
}

static void film_open(Film *film, Renderer *renderer, unsigned aovs, uint32_t rows)
{
    const RenderSettings *settings = &renderer->settings;
    size_t scalar = renderer_scalar_size(renderer), pixels = film_pixels(renderer, rows);
    film->rows = rows;
    film->colors = film_buffer(renderer, pixels * 3 * scalar);
    film->losses = film_buffer(renderer, pixels * 3 * scalar);
    if (aovs & ~(unsigned)AOV_PATH) {
        film->ray = film_buffer(renderer, pixels * 3 * scalar);
        film->t = film_buffer(renderer, pixels * scalar);
        film->normal = film_buffer(renderer, pixels * 3 * scalar);
        film->position = film_buffer(renderer, pixels * 3 * scalar);
        film->object = film_buffer(renderer, pixels * sizeof(uint32_t));
        film->shadow = film_buffer(renderer, aovs & AOV_SHADOW ? film_shadow_size(renderer, rows) : 0);
    }
    if (aovs & AOV_PATH) film->path = film_buffer(renderer, pixels * sizeof(uint32_t));
    film->ray_counts = film_buffer(renderer, RAYS_COUNT * sizeof(uint32_t));
    void *offsets = sample_pattern(settings->sample_count, renderer->report.wide);
    film->offsets =
        buffer_create(renderer->compute, 2 * settings->sample_count * scalar, offsets, CL_MEM_READ_ONLY);
    free(offsets);
}

static void film_close(Film *film)
{
    cl_mem buffers[] = {film->offsets, film->ray_counts, film->colors, film->losses, film->ray, film->t,
                        film->normal,  film->position,   film->object, film->shadow, film->path};
    for (size_t i = 0; i < sizeof buffers / sizeof *buffers; i++)
        buffer_release(buffers[i]);
    *film = (Film){0};
}

typedef struct {
    uint32_t first_row, row_count;
} BandRows;

static LaunchTime band_launch(Renderer *renderer, KernelKind kind, BandRows rows)
{
    TileShape item = item_shape(renderer->report.lanes);
    size_t side = group_side(renderer);
    const size_t group[2] = {side, side};
    const size_t items[2] = {(renderer->settings.region_width + item.width - 1) / item.width,
                             (rows.row_count + item.height - 1) / item.height};
    return renderer_launch(renderer, kind, 2, items, group);
}

static void band_set_place(const Renderer *renderer, cl_kernel kernel, cl_uint argument, BandRows rows)
{
    const RenderSettings *settings = &renderer->settings;
    cl_uint4 band = {
        {settings->region_x, settings->region_y + rows.first_row, settings->region_width, rows.row_count}};
    kernel_argument(renderer->compute, kernel, argument, sizeof band, &band);
}

_Static_assert(sizeof((RenderReport){0}.rays) == RAYS_COUNT * sizeof(uint64_t), "one for each RAYS_…");

static void ray_counts_clear(Renderer *renderer, const Film *film)
{
    const uint32_t zeros[RAYS_COUNT] = {0};
    buffer_write(renderer->compute, film->ray_counts, sizeof zeros, zeros);
}

static void ray_counts_add(Renderer *renderer, const Film *film)
{
    uint32_t counts[RAYS_COUNT] = {0};
    buffer_read(renderer->compute, film->ray_counts, sizeof counts, counts);
    for (size_t i = 0; i < RAYS_COUNT; i++)
        renderer->report.rays[i] += counts[i];
}

// One launch for samples first..last-1; returns its seconds, the event's where it can be trusted.
static double band_render(Renderer *renderer, const Film *film, BandRows rows, uint32_t first, uint32_t last)
{
    cl_kernel kernel = renderer_kernel(renderer, KERNEL_RENDER);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT, sizeof(cl_mem), &film->offsets);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 1, sizeof(cl_mem), &film->colors);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 2, sizeof(cl_mem), &film->losses);
    band_set_place(renderer, kernel, FLAT_COUNT + 3, rows);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 4, sizeof first, &first);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 5, sizeof last, &last);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 6, sizeof(cl_mem), &film->ray_counts);
    if (renderer->settings.counting) ray_counts_clear(renderer, film);
    LaunchTime time = band_launch(renderer, KERNEL_RENDER, rows);
    if (renderer->settings.counting) ray_counts_add(renderer, film);
    return time.trusted ? time.event_seconds : time.host_seconds;
}

static void band_aovs(Renderer *renderer, const Film *film, unsigned aovs, BandRows rows)
{
    cl_kernel kernel = renderer_kernel(renderer, KERNEL_AOV);
    band_set_place(renderer, kernel, FLAT_COUNT, rows);
    const cl_mem *buffers[] = {&film->ray,      &film->t,      &film->normal,
                               &film->position, &film->object, &film->shadow};
    for (cl_uint i = 0; i < 6; i++)
        kernel_argument(renderer->compute, kernel, FLAT_COUNT + 1 + i, sizeof(cl_mem), buffers[i]);
    cl_uint shadow_count = aovs & AOV_SHADOW ? (cl_uint)renderer->light_count : 0;
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 7, sizeof shadow_count, &shadow_count);
    band_launch(renderer, KERNEL_AOV, rows);
}

static void band_paths(Renderer *renderer, const Film *film, BandRows rows)
{
    cl_kernel kernel = renderer_kernel(renderer, KERNEL_PATH);
    band_set_place(renderer, kernel, FLAT_COUNT, rows);
    kernel_argument(renderer->compute, kernel, FLAT_COUNT + 1, sizeof(cl_mem), &film->path);
    band_launch(renderer, KERNEL_PATH, rows);
}

// Lengths of the device in the scene's own, in memory of the caller's, or NULL where they are so already, as
// at `double` they always are.
static float *lengths_restored(const Renderer *renderer, const void *lengths, size_t count)
{
    if (renderer->unit == 1 || !lengths) return NULL;
    float *restored = memory_allocate(count, sizeof *restored);
    for (size_t i = 0; i < count; i++)
        restored[i] = ((const float *)lengths)[i] * (float)renderer->unit;
    return restored;
}

static bool band_deliver(Renderer *renderer, const Film *film, unsigned aovs, BandRows rows, BandSink sink,
                         void *context)
{
    const RenderSettings *settings = &renderer->settings;
    size_t scalar = renderer_scalar_size(renderer), pixels = film_pixels(renderer, rows.row_count);
    const struct {
        unsigned aov; // 0: the color, always there
        cl_mem buffer;
        size_t size;
    } parts[] = {
        {0, film->colors, pixels * 3 * scalar},
        {AOV_T, film->t, pixels * scalar},
        {AOV_NORMAL, film->normal, pixels * 3 * scalar},
        {AOV_POSITION, film->position, pixels * 3 * scalar},
        {AOV_OBJECT, film->object, pixels * sizeof(uint32_t)},
        {AOV_SHADOW, film->shadow, film_shadow_size(renderer, rows.row_count)},
        {AOV_RAY, film->ray, pixels * 3 * scalar},
        {AOV_PATH, film->path, pixels * sizeof(uint32_t)},
    };
    enum { PART_COUNT = sizeof parts / sizeof *parts };
    const void *mapped[PART_COUNT] = {NULL};
    for (size_t i = 0; i < PART_COUNT; i++)
        if ((parts[i].aov == 0 || (aovs & parts[i].aov)) && parts[i].size > 0)
            mapped[i] = renderer_map(renderer, parts[i].buffer, parts[i].size);
    float *t = lengths_restored(renderer, mapped[1], pixels),
          *position = lengths_restored(renderer, mapped[3], 3 * pixels);
    // in the order of the parts
    Band band = {.first_row = rows.first_row,
                 .row_count = rows.row_count,
                 .colors = mapped[0],
                 .t = t ? t : mapped[1],
                 .normal = mapped[2],
                 .position = position ? position : mapped[3],
                 .object = mapped[4],
                 .shadow = mapped[5],
                 .ray = mapped[6],
                 .path = mapped[7]};
    double done = (double)(rows.first_row + rows.row_count) / settings->region_height;
    bool go_on = compute_ok(renderer->compute) && sink(context, &band, done);
    free(t);
    free(position);
    for (size_t i = 0; i < PART_COUNT; i++)
        renderer_unmap(renderer, parts[i].buffer, mapped[i]);
    return go_on;
}

// Rows of whole groups.
static uint32_t rows_step(const Renderer *renderer)
{
    return tile_shape(renderer->report.lanes).height * (uint32_t)group_side(renderer);
}

// As many as give each of the device's units several groups: the last to end would else be waited for.
static uint32_t rows_least(const Renderer *renderer)
{
    uint32_t group_width = item_shape(renderer->report.lanes).width * (uint32_t)group_side(renderer);
    uint32_t of_row = (renderer->settings.region_width + group_width - 1) / group_width;
    uint32_t wanted = GROUPS_OF_UNIT_LEAST * renderer->compute->device->compute_units;
    return (wanted + of_row - 1) / of_row * rows_step(renderer);
}

static uint32_t band_rows(const Renderer *renderer, const Pace *pace, uint32_t most)
{
    const RenderSettings *settings = &renderer->settings;
    if (settings->band_rows > 0) return settings->band_rows < most ? settings->band_rows : most;
    uint64_t row_samples = (uint64_t)settings->region_width * settings->sample_count;
    uint64_t rows = pace_band_samples(pace) / row_samples;
    uint32_t least = rows_least(renderer);
    if (rows < least) rows = least;
    rows -= rows % rows_step(renderer);
    return rows < most ? (uint32_t)rows : most;
}

static uint32_t film_rows_largest(const Renderer *renderer, unsigned aovs)
{
    const RenderSettings *settings = &renderer->settings;
    if (settings->band_rows > 0) return settings->band_rows;
    size_t row_bytes = film_pixels(renderer, 1) * 3 * renderer_scalar_size(renderer);
    if (aovs & AOV_SHADOW) row_bytes += film_shadow_size(renderer, 1);
    size_t rows = BAND_BYTES_LARGEST / row_bytes;
    size_t step = rows_step(renderer);
    rows = rows < step ? step : rows - rows % step;
    return rows < settings->region_height ? (uint32_t)rows : settings->region_height;
}

bool renderer_render(Renderer *renderer, unsigned aovs, BandSink sink, void *context)
{
    const RenderSettings *settings = &renderer->settings;
    const Compute *compute = renderer->compute;
    Film film = {0};
    film_open(&film, renderer, aovs, film_rows_largest(renderer, aovs));
    Pace pace = {.target_seconds = settings->band_seconds > 0 ? settings->band_seconds : 0.1};
    bool go_on = compute_ok(compute);
    BandRows rows = {0};
    while (go_on && rows.first_row < settings->region_height) {
        uint32_t left = settings->region_height - rows.first_row;
        rows.row_count = band_rows(renderer, &pace, left < film.rows ? left : film.rows);
        uint64_t pixels = film_pixels(renderer, rows.row_count);
        pace_begin_band(&pace);
        for (uint32_t first = 0; go_on && first < settings->sample_count;) {
            uint32_t samples = pace_launch_samples(&pace, pixels, settings->sample_count - first);
            double seconds = band_render(renderer, &film, rows, first, first + samples);
            pace_note_launch(&pace, pixels, samples, seconds);
            first += samples;
            go_on = compute_ok(compute) && !(settings->stop && settings->stop());
        }
        if (!go_on) break;
        // one ray a pixel, as the band's first launch had
        if (aovs & ~(unsigned)AOV_PATH) band_aovs(renderer, &film, aovs, rows);
        if (aovs & AOV_PATH) band_paths(renderer, &film, rows);
        go_on = band_deliver(renderer, &film, aovs, rows, sink, context);
        rows.first_row += rows.row_count;
    }
    film_close(&film);
    return go_on && compute_ok(compute);
}
