#include "host/api/handles.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

// The size of GlintAllHits in the first version that has it.
enum { ALL_HITS_SIZE_MIN = offsetof(GlintAllHits, position) + sizeof(double *) };

// A hit of a batch's ray.
typedef struct {
    uint32_t ray, object;
    double t;
    Vector3 normal, position;
} BatchHit;

typedef ARRAY_OF(BatchHit) BatchHits;

typedef struct {
    TraceRay *rays;    // scaled, those that may hit more
    uint32_t *indices; // in the batch
    int *exponents;    // by index
    TraceHit *found;
    size_t *ends; // by index: where the hits of the ray end
    BatchHits hits;
} Batch;

static Batch batch_open(size_t count)
{
    return (Batch){.rays = memory_allocate(count, sizeof(TraceRay)),
                   .indices = memory_allocate(count, sizeof(uint32_t)),
                   .exponents = memory_allocate(count, sizeof(int)),
                   .found = memory_allocate(count, sizeof(TraceHit)),
                   .ends = memory_allocate(count + 1, sizeof(size_t))};
}

static void batch_close(Batch *batch)
{
    free(batch->rays);
    free(batch->indices);
    free(batch->exponents);
    free(batch->found);
    free(batch->ends);
    free(batch->hits.items);
}
#define OwnedBatch __attribute__((cleanup(batch_close))) Batch

// Traces the batch's rays from hit to hit, up to `hits_max` each, and lists the hits. Returns false if the
// device failed.
static bool batch_trace(Batch *batch, Renderer *renderer, size_t count, size_t hits_max)
{
    batch->hits.count = 0;
    for (size_t round = 0; round < hits_max && count > 0; round++) {
        if (!renderer_trace_closest(renderer, batch->rays, count, batch->found)) return false;
        size_t left = 0;
        for (size_t i = 0; i < count; i++) {
            TraceHit hit = batch->found[i];
            if (hit.object == UINT32_MAX) continue;
            const uint32_t index = batch->indices[i];
            batch->rays[left] = batch->rays[i];
            batch->rays[left].tmin = hit.t;
            batch->indices[left++] = index;
            trace_hit_unscale(&hit, batch->exponents[index]);
            array_push(batch->hits, ((BatchHit){index, hit.object, hit.t, hit.normal, hit.position}));
        }
        count = left;
    }
    return true;
}

// Appends the batch's hits, sorted by ray. Each ray's hits are already in the order of t.
static void batch_append(Batch *batch, size_t first, size_t count, GlintAllHits *all)
{
    const size_t before = all->count, after = before + batch->hits.count;
    if (after == before) return;
    all->ray = memory_resize(all->ray, after, sizeof *all->ray);
    all->object = memory_resize(all->object, after, sizeof *all->object);
    all->t = memory_resize(all->t, after, sizeof *all->t);
    all->normal = memory_resize(all->normal, 3 * after, sizeof *all->normal);
    all->position = memory_resize(all->position, 3 * after, sizeof *all->position);
    memset(batch->ends, 0, (count + 1) * sizeof *batch->ends);
    for (size_t i = 0; i < batch->hits.count; i++)
        batch->ends[batch->hits.items[i].ray + 1]++;
    for (size_t i = 0; i < count; i++)
        batch->ends[i + 1] += batch->ends[i];
    for (size_t i = 0; i < batch->hits.count; i++) {
        const BatchHit *hit = &batch->hits.items[i];
        const size_t at = before + batch->ends[hit->ray]++;
        all->ray[at] = first + hit->ray;
        all->object[at] = hit->object;
        all->t[at] = hit->t;
        memcpy(all->normal + 3 * at, &hit->normal, sizeof hit->normal);
        memcpy(all->position + 3 * at, &hit->position, sizeof hit->position);
    }
    all->count = after;
}

// Collects all hits. Returns false if the device failed, and false with a message if a ray is invalid.
static bool rays_trace_all(GlintTracer *tracer, const GlintRays *rays, size_t hits_max, GlintAllHits *all,
                           MessageList *messages)
{
    const size_t most = batch_rays(tracer, rays->count);
    OwnedBatch batch = batch_open(most);
    for (size_t first = 0, count; first < rays->count; first += count) {
        count = rays->count - first < most ? rays->count - first : most;
        for (size_t i = 0; i < count; i++)
            batch.indices[i] = (uint32_t)i;
        if (!rays_scale(batch.rays, batch.exponents, rays, first, count, tracer->precision, messages) ||
            !batch_trace(&batch, tracer->renderer, count, hits_max))
            return false;
        batch_append(&batch, first, count, all);
    }
    return true;
}

GlintStatus glint_trace_all(GlintTracer *tracer, const GlintRays *rays, size_t hits_max, GlintAllHits *hits,
                            char **messages)
{
    MessageList list = {0};
    GlintRays given;
    GlintAllHits found = {.size = sizeof found};
    if (!struct_has_size(hits, ALL_HITS_SIZE_MIN, "GlintAllHits", &list))
        return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    struct_write(hits, &found, sizeof found);
    bool is_sound = rays_read(&given, rays, &list);
    if (is_sound && tracer->precision == PRECISION_CERTIFIED)
        is_sound =
            message_error(&list, "precision certified cannot trace all hits, because its bounds hold only "
                                 "for rays from their origins; use single, strict or double");
    if (!is_sound) return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    pthread_mutex_lock(&tracer->device->mutex);
    is_sound = rays_trace_all(tracer, &given, hits_max, &found, &list);
    const GlintStatus status =
        call_end(&list, tracer->device, is_sound ? GLINT_DONE : GLINT_WRONG_INPUT, messages);
    pthread_mutex_unlock(&tracer->device->mutex);
    if (status == GLINT_DONE)
        struct_write(hits, &found, sizeof found);
    else
        glint_all_hits_free(&found);
    return status;
}

void glint_all_hits_free(GlintAllHits *hits)
{
    if (!hits || hits->size < ALL_HITS_SIZE_MIN) return; // without a size it has no arrays
    free(hits->ray);
    free(hits->object);
    free(hits->t);
    free(hits->normal);
    free(hits->position);
    const GlintAllHits none = {0};
    struct_write(hits, &none, sizeof none);
}
