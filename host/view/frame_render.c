// Renders a coarse frame for each request of a moving camera, and then the image in rounds.
#include "host/view/frame_loop_state.h"

#include "host/base/clock.h"
#include "host/view/pixel_facts.h"
#include <math.h>
#include <time.h>

enum { REST_NANOSECONDS = 150 * 1000 * 1000 };

static bool is_last(const Film *film, const Film *band)
{
    return band->first_row + band->height == film->height;
}

void probe_answer(FrameLoop *loop)
{
    uint32_t pixel[2];
    if (!probe_acquire(loop, pixel)) return;
    const PixelView view = {loop->renderer, &loop->scene, loop->options.scene_path, loop->current.size,
                            &loop->settings};
    facts_publish(loop, pixel_facts(&view, pixel[0], pixel[1]));
}

static void rendering_show(FrameLoop *loop, const Film *band)
{
    stage_begin(loop->stage, "rendering", NULL, loop->film.height);
    stage_set(loop->stage, band->first_row + band->height);
}

static bool preview_receive(void *context, const Film *band)
{
    film_copy_band(context, band);
    return true;
}

static bool round_receive(void *context, const Film *band)
{
    const uint32_t samples = band->samples;
    FrameLoop *loop = context;
    film_copy_band(&loop->film, band);
    if (!atomic_load(&loop->first_is_due)) probe_answer(loop);
    if (samples == 1) rendering_show(loop, band);
    if (!is_last(&loop->film, band)) return true;
    const bool is_first = samples == 1 && band->layers[LAYER_COLOR];
    if (is_first && loop->current.is_moving && !loop->has_preview)
        preview_record(&loop->preview, 1, loop->move_seconds, clock_seconds() - loop->render_start,
                       (double)film_pixel_count(&loop->film));
    if (is_first && view_aovs[loop->current.view]) return true; // its AOVs follow the first round
    frame_fill(loop, samples);
    if (!is_first) distances_fill(loop);
    frame_publish(loop, samples);
    return true;
}

static void film_fit(FrameLoop *loop, unsigned aovs)
{
    Film *film = &loop->film;
    film->rerenders = (RerenderCounts){0}; // bands add theirs
    const uint32_t light_count = (uint32_t)loop->scene.lights.count;
    bool fits = film->width == loop->settings.width && film->height == loop->settings.height &&
                film->light_count == light_count;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        fits = fits && (film->layers[layer] || !layer_in(aovs, layer));
    if (fits) return;
    film_free(film);
    *film = film_allocate(loop->settings.width, loop->settings.height, light_count, aovs);
}

void renderers_close(FrameLoop *loop)
{
    renderer_close(loop->renderer);
    renderer_close(loop->reference);
    loop->renderer = loop->reference = NULL;
}

void failure_publish(FrameLoop *loop)
{
    message_publish(loop, compute_failure_text(&loop->compute));
    renderers_close(loop);
    compute_close(&loop->compute);
}

// Halves the compile time, because a move uses several threads and compiling uses one.
double move_guess(const Renderer *renderer)
{
    return renderer_report(renderer)->flatten_seconds / 2;
}

// Opens or moves the renderer for an image of the divisor. Returns false with a message if it cannot.
static bool renderer_prepare(FrameLoop *loop, uint32_t divisor, uint32_t samples, bool is_preview)
{
    const double start = clock_seconds();
    RenderSettings *settings = &loop->settings;
    const ImageSize size = loop->current.size;
    settings->width = settings->region_width = (size.width + divisor - 1) / divisor;
    settings->height = settings->region_height = (size.height + divisor - 1) / divisor;
    settings->sample_count = samples;
    settings->is_preview = is_preview;
    loop->scene.camera = loop->current.camera;
    MessageList messages = {0};
    if (loop->renderer && settings->precision != loop->current.precision) renderers_close(loop);
    settings->precision = loop->current.precision;
    const bool moves = loop->renderer != NULL;
    bool prepared;
    if (moves) {
        prepared = renderer_move(loop->renderer, &loop->scene, settings, &messages);
        renderer_report_restart(loop->renderer);
    } else {
        if (!loop->compute.context) compute_open(&loop->compute, loop->options.device);
        loop->renderer = renderer_open(&loop->compute, &loop->scene, settings, &messages);
        prepared = loop->renderer != NULL;
        if (prepared) loop->expected_move = move_guess(loop->renderer);
    }
    messages_publish(loop, &messages);
    loop->render_start = clock_seconds();
    loop->move_seconds = moves ? loop->render_start - start : 0;
    if (!is_preview) loop->expected_move = fmax(0.7 * loop->expected_move, loop->move_seconds);
    return prepared;
}

bool camera_rests(FrameLoop *loop)
{
    return !news_await(loop, loop->expected_move > PREVIEW_SECONDS ? REST_NANOSECONDS : 0);
}

bool request_begin(FrameLoop *loop)
{
    const FrameRequest *request = &loop->current;
    loop->divisor =
        request->is_moving ? preview_divisor(&loop->preview, request->size.width, request->size.height) : 1;
    loop->has_preview = request->is_moving && (loop->divisor > 1 || loop->expected_move > PREVIEW_SECONDS);
    return loop->has_preview;
}

bool preview_render(FrameLoop *loop)
{
    const unsigned aovs = view_aovs[loop->current.view];
    if (!renderer_prepare(loop, loop->divisor, 1, true)) return false;
    film_fit(loop, aovs);
    atomic_store(&loop->first_is_due, true);
    if (!renderer_render(loop->renderer, aovs, preview_receive, &loop->film)) return false;
    preview_record(&loop->preview, loop->divisor, loop->move_seconds, clock_seconds() - loop->render_start,
                   (double)film_pixel_count(&loop->film));
    frame_fill(loop, 1);
    frame_publish(loop, 0);
    return true;
}

bool rounds_render(FrameLoop *loop)
{
    const View view = loop->current.view;
    const unsigned aovs = AOV_T | view_aovs[view];
    const uint32_t samples = view == VIEW_COLOR ? loop->options.settings.sample_count : 1;
    if (!renderer_prepare(loop, 1, samples, false)) return false;
    film_fit(loop, aovs);
    atomic_store(&loop->first_is_due, loop->current.is_moving && !loop->has_preview);
    return renderer_accumulate(loop->renderer, aovs, round_receive, loop);
}

typedef struct {
    FrameLoop *loop;
    Film *film;
} Reference;

static bool reference_receive(void *context, const Film *band)
{
    Reference *reference = context;
    film_copy_band(reference->film, band);
    rendering_show(reference->loop, band);
    return true;
}

bool errors_render(FrameLoop *loop)
{
    RenderSettings settings = loop->settings;
    settings.precision = PRECISION_DOUBLE;
    settings.lanes = 0;
    MessageList messages = {0};
    const bool moves = loop->reference != NULL;
    if (!moves) loop->reference = renderer_open(&loop->compute, &loop->scene, &settings, &messages);
    const bool prepared =
        moves ? renderer_move(loop->reference, &loop->scene, &settings, &messages) : loop->reference != NULL;
    messages_publish(loop, &messages);
    if (!prepared) return false;
    OwnedFilm film = film_allocate(settings.width, settings.height, loop->film.light_count, 0);
    Reference reference = {loop, &film};
    if (!renderer_render(loop->reference, 0, reference_receive, &reference)) return false;
    frame_fill(loop, 1);
    loop->frame.largest_error = view_error(loop->frame.pixels, &loop->film, &film);
    distances_fill(loop);
    frame_publish(loop, 1);
    return true;
}
