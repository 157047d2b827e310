#include "tests/frame.h"

#include "host/base/memory.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

RenderSettings frame_settings(uint32_t width, uint32_t height, Precision precision)
{
    return (RenderSettings){.width = width,
                            .height = height,
                            .region_width = width,
                            .region_height = height,
                            .sample_count = 1,
                            .bounce_count = 5,
                            .precision = precision,
                            .shift_to_eye = true};
}

static void widen(double *target, const void *values, size_t count, bool wide)
{
    for (size_t i = 0; i < count; i++)
        target[i] = wide ? ((const double *)values)[i] : (double)((const float *)values)[i];
}

typedef struct {
    Frame *frame;
    bool wide;
} FrameSink;

static bool frame_take_band(void *context, const Band *band, double fraction_done)
{
    (void)fraction_done;
    const FrameSink *sink = context;
    Frame *frame = sink->frame;
    size_t first = (size_t)band->first_row * frame->width, count = (size_t)band->row_count * frame->width;
    widen(frame->colors + 3 * first, band->colors, 3 * count, sink->wide);
    if (frame->t) widen(frame->t + first, band->t, count, sink->wide);
    if (frame->normal) widen(frame->normal + 3 * first, band->normal, 3 * count, sink->wide);
    if (frame->position) widen(frame->position + 3 * first, band->position, 3 * count, sink->wide);
    if (frame->ray) widen(frame->ray + 3 * first, band->ray, 3 * count, sink->wide);
    if (frame->object) memcpy(frame->object + first, band->object, count * sizeof *frame->object);
    if (frame->path) memcpy(frame->path + first, band->path, count * sizeof *frame->path);
    if (frame->shadow && frame->light_count > 0)
        memcpy(frame->shadow + first * frame->light_count, band->shadow,
               count * frame->light_count * sizeof *frame->shadow);
    return true;
}

static Frame frame_open(uint32_t width, uint32_t height, uint32_t light_count, unsigned aovs)
{
    size_t pixels = (size_t)width * height;
    Frame frame = {.width = width, .height = height, .light_count = light_count};
    frame.colors = memory_allocate_zeroed(3 * pixels, sizeof *frame.colors);
    if (aovs & AOV_T) frame.t = memory_allocate_zeroed(pixels, sizeof *frame.t);
    if (aovs & AOV_NORMAL) frame.normal = memory_allocate_zeroed(3 * pixels, sizeof *frame.normal);
    if (aovs & AOV_POSITION) frame.position = memory_allocate_zeroed(3 * pixels, sizeof *frame.position);
    if (aovs & AOV_RAY) frame.ray = memory_allocate_zeroed(3 * pixels, sizeof *frame.ray);
    if (aovs & AOV_PATH) frame.path = memory_allocate_zeroed(pixels, sizeof *frame.path);
    if (aovs & AOV_OBJECT) frame.object = memory_allocate_zeroed(pixels, sizeof *frame.object);
    if (aovs & AOV_SHADOW)
        frame.shadow = memory_allocate_zeroed(pixels * light_count + 1, sizeof *frame.shadow);
    return frame;
}

Frame frame_render(Compute *compute, const Scene *scene, const RenderSettings *settings, unsigned aovs)
{
    MessageList messages = {0};
    Renderer *renderer = renderer_open(compute, scene, settings, &messages);
    message_list_print(&messages, stderr);
    message_list_free(&messages);
    assert_non_null(renderer);
    Frame frame =
        frame_open(settings->region_width, settings->region_height, (uint32_t)scene->lights.count, aovs);
    FrameSink sink = {&frame, renderer_report(renderer)->wide};
    assert_true(renderer_render(renderer, aovs, frame_take_band, &sink));
    renderer_close(renderer);
    return frame;
}

void frame_free(Frame *frame)
{
    free(frame->colors);
    free(frame->t);
    free(frame->normal);
    free(frame->position);
    free(frame->ray);
    free(frame->path);
    free(frame->object);
    free(frame->shadow);
    *frame = (Frame){0};
}

Frame frame_cut(const Frame *frame, uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    Frame cut = frame_open(width, height, 0, 0);
    for (uint32_t row = 0; row < height; row++)
        memcpy(cut.colors + 3 * (size_t)row * width,
               frame->colors + 3 * ((size_t)(y + row) * frame->width + x), 3 * width * sizeof *cut.colors);
    return cut;
}

Frame frame_flipped(const Frame *frame)
{
    Frame flipped = frame_open(frame->width, frame->height, 0, 0);
    for (size_t pixel = 0; pixel < (size_t)frame->width * frame->height; pixel++) {
        size_t column = pixel % frame->width, row_start = pixel - column;
        memcpy(flipped.colors + 3 * pixel, frame->colors + 3 * (row_start + frame->width - 1 - column),
               3 * sizeof *frame->colors);
    }
    return flipped;
}

static void numbers_assert_same(const Frame *frame, const double *values, const double *expected,
                                size_t channels, const char *kind, const char *what)
{
    if (!values || !expected) return;
    size_t count = channels * frame->width * frame->height, differing = 0, first = 0;
    for (size_t i = count; i-- > 0;) {
        if (values[i] == expected[i] || (isnan(values[i]) && isnan(expected[i]))) continue;
        differing++;
        first = i;
    }
    if (differing == 0) return;
    size_t pixel = first / channels;
    fail_msg("%s: %s: %zu of %zu values differ, first at pixel %zu,%zu channel %zu: %.9g, expected %.9g",
             what, kind, differing, count, pixel % frame->width, pixel / frame->width, first % channels,
             values[first], expected[first]);
}

static void integers_assert_same(const Frame *frame, const uint32_t *values, const uint32_t *expected,
                                 size_t channels, const char *kind, const char *what)
{
    if (!values || !expected) return;
    for (size_t i = 0; i < channels * frame->width * frame->height; i++) {
        if (values[i] == expected[i]) continue;
        size_t pixel = i / channels;
        fail_msg("%s: %s differs first at pixel %zu,%zu: %u, expected %u", what, kind, pixel % frame->width,
                 pixel / frame->width, values[i], expected[i]);
    }
}

void frame_assert_same(const Frame *frame, const Frame *expected, const char *what)
{
    assert_int_equal(frame->width, expected->width);
    assert_int_equal(frame->height, expected->height);
    numbers_assert_same(frame, frame->ray, expected->ray, 3, "ray", what);
    integers_assert_same(frame, frame->object, expected->object, 1, "object", what);
    integers_assert_same(frame, frame->path, expected->path, 1, "path", what);
    numbers_assert_same(frame, frame->t, expected->t, 1, "t", what);
    numbers_assert_same(frame, frame->normal, expected->normal, 3, "normal", what);
    numbers_assert_same(frame, frame->position, expected->position, 3, "position", what);
    integers_assert_same(frame, frame->shadow, expected->shadow, frame->light_count, "shadow", what);
    numbers_assert_same(frame, frame->colors, expected->colors, 3, "color", what);
}

size_t frame_count_faulty(const Frame *frame)
{
    size_t count = 0;
    for (size_t i = 0; i < (size_t)frame->width * frame->height; i++) {
        bool faulty = false;
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            faulty |= !isfinite(frame->colors[k]) || frame->colors[k] < 0;
            if (frame->normal) faulty |= !isfinite(frame->normal[k]);
            if (frame->position) faulty |= !isfinite(frame->position[k]);
        }
        if (frame->t) faulty |= isnan(frame->t[i]);
        count += faulty;
    }
    return count;
}
