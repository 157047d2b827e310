#include "host/base/stage.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct Stage {
    atomic_size_t done;
    pthread_mutex_t mutex; // guards the members below
    Text name;             // empty if no operation is in progress
    size_t total;
    double start_seconds; // when the operation began
    bool keeps_spans;
    pthread_t opener;
    double stage_start_seconds;
    ARRAY_OF(HostSpan) spans;
};

Stage *stage_open(bool keeps_spans)
{
    Stage *stage = memory_allocate_zeroed(1, sizeof *stage);
    stage->keeps_spans = keeps_spans;
    stage->opener = pthread_self();
    pthread_mutex_init(&stage->mutex, NULL);
    return stage;
}

void stage_close(Stage *stage)
{
    if (!stage) return;
    pthread_mutex_destroy(&stage->mutex);
    text_free(&stage->name);
    for (size_t i = 0; i < stage->spans.count; i++)
        free((void *)(uintptr_t)stage->spans.items[i].name);
    free(stage->spans.items);
    free(stage);
}

const HostSpan *stage_spans(const Stage *stage, size_t *count)
{
    *count = stage->spans.count;
    return stage->spans.items;
}

static bool is_ignored(const Stage *stage)
{
    return !stage || (stage->keeps_spans && !pthread_equal(stage->opener, pthread_self()));
}

// Ends the current span. The caller holds the mutex.
static void span_end(Stage *stage, double now)
{
    if (stage->keeps_spans && stage->name.count > 0)
        array_push(stage->spans, ((HostSpan){.name = memory_copy_text(text_c(&stage->name)),
                                             .start_seconds = stage->stage_start_seconds,
                                             .end_seconds = now}));
    stage->stage_start_seconds = now;
}

void stage_begin(Stage *stage, const char *what, const char *path, size_t total)
{
    if (is_ignored(stage)) return;
    pthread_mutex_lock(&stage->mutex);
    const double now = clock_seconds();
    if (stage->name.count == 0) stage->start_seconds = now;
    span_end(stage, now);
    text_free(&stage->name);
    text_appendf(&stage->name, path ? "%s %s" : "%s", what, path ? file_base_name(path) : NULL);
    stage->total = total;
    atomic_store(&stage->done, 0);
    pthread_mutex_unlock(&stage->mutex);
}

void stage_end(Stage *stage)
{
    if (is_ignored(stage)) return;
    pthread_mutex_lock(&stage->mutex);
    span_end(stage, clock_seconds());
    text_free(&stage->name);
    pthread_mutex_unlock(&stage->mutex);
}

void stage_set(Stage *stage, size_t done)
{
    if (stage) atomic_store_explicit(&stage->done, done, memory_order_relaxed);
}

void stage_add(Stage *stage, size_t count)
{
    if (stage) atomic_fetch_add_explicit(&stage->done, count, memory_order_relaxed);
}

bool stage_write(Stage *stage, Text *text, double *seconds)
{
    pthread_mutex_lock(&stage->mutex);
    const bool is_under_way = stage->name.count > 0;
    if (is_under_way) {
        text_append(text, stage->name.items, stage->name.count);
        const double share = stage->total > 0 ? (double)atomic_load(&stage->done) / (double)stage->total : 0;
        if (stage->total > 0) text_appendf(text, " %.0f%%", 100 * (share < 1 ? share : 1));
        *seconds = clock_seconds() - stage->start_seconds;
    }
    pthread_mutex_unlock(&stage->mutex);
    return is_under_way;
}
