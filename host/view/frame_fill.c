// Fills a frame with a film's display values, its distances and the report on its rendering.
#include "host/view/frame_loop_state.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/base/text.h"
#include <stdlib.h>

void frame_free(Frame *frame)
{
    free(frame->pixels);
    free(frame->summary);
    free(frame->distances);
    *frame = (Frame){0};
}

static double seconds_of(const NamedLaunch *launches, size_t count)
{
    double seconds = 0;
    for (size_t i = 0; i < count; i++)
        seconds += launches[i].time.fault ? launches[i].time.host_seconds : launches[i].time.event_seconds;
    return seconds;
}

static char *summary_make(const FrameLoop *loop, uint32_t samples)
{
    const RenderReport *report = renderer_report(loop->renderer);
    double launches = seconds_of(report->launches.items, report->launches.count);
    double reads = seconds_of(report->reads.items, report->reads.count);
    double rays = (double)film_pixel_count(&loop->film) * samples;
    Text text = {0};
    text_appendf(&text, "%s\n", loop->options.device->name);
    text_appendf(&text,
                 "%s, %u lane%s, %ux%u, %u of %u sample%s, %.1f million samples per second of launches\n",
                 precision_names[loop->settings.precision], report->lanes, text_plural(report->lanes),
                 loop->film.width, loop->film.height, samples, loop->settings.sample_count,
                 text_plural(loop->settings.sample_count), rays / launches / 1e6);
    text_appendf(&text, "ms: flatten %.2f, bvh %.2f, upload %.2f, build %.1f, launches %.1f, read-back %.2f",
                 1e3 * report->flatten_seconds, 1e3 * report->bvh_seconds, 1e3 * report->upload_seconds,
                 1e3 * report->build_seconds, 1e3 * launches, 1e3 * reads);
    return text.items;
}

void frame_fill(FrameLoop *loop, uint32_t samples)
{
    const Film *film = &loop->film;
    Frame *frame = &loop->frame;
    const bool fits = frame->width == film->width && frame->height == film->height;
    if (!fits) {
        frame_free(frame);
        frame->pixels = memory_allocate(3 * film_pixel_count(film), 1);
        frame->width = film->width;
        frame->height = film->height;
    }
    free(frame->distances);
    frame->distances = NULL;
    free(frame->summary);
    frame->summary = summary_make(loop, samples);
    frame->largest_error = -1;
    const Camera *camera = &loop->current.camera;
    if (view_aovs[loop->current.view])
        view_aov(frame->pixels, film, loop->current.view,
                 vector_length(vector_subtract(camera->look_at, camera->position)));
    else
        view_color(frame->pixels, film, samples < loop->settings.sample_count ? samples : 1,
                   loop->scene.color_meaning == COLORS_DISPLAY ? TRANSFER_NONE : TRANSFER_SRGB);
}

void distances_fill(FrameLoop *loop)
{
    size_t count = film_pixel_count(&loop->film);
    loop->frame.distances = memory_allocate(count, sizeof *loop->frame.distances);
    numbers_narrow(loop->frame.distances, loop->film.t, count);
}
