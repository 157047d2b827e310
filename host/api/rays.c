#include "host/api/handles.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/base/parallel.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

GlintStatus glint_tracer_open(GlintDevice *device, const GlintScene *scene,
                              const GlintTraceSettings *settings, GlintTracer **tracer, char **messages)
{
    MessageList list = {0};
    GlintTraceSettings given;
    Precision precision;
    *tracer = NULL;
    if (!struct_read(&given, sizeof given, settings, "GlintTraceSettings", &list) ||
        !precision_read(&precision, given.precision, &list))
        return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    RenderSettings render_settings = settings_of_image(1, 1, precision);
    render_settings.lanes = given.lanes;
    pthread_mutex_lock(&device->mutex);
    Renderer *renderer = device_renderer(device, &scene->scene, &render_settings, &list);
    const GlintStatus status = call_end(&list, device, renderer ? GLINT_DONE : GLINT_WRONG_INPUT, messages);
    if (status == GLINT_DONE) {
        *tracer = memory_allocate_zeroed(1, sizeof **tracer);
        **tracer = (GlintTracer){device, renderer, precision};
    } else {
        renderer_close(renderer);
    }
    pthread_mutex_unlock(&device->mutex);
    return status;
}

void glint_tracer_close(GlintTracer *tracer)
{
    if (!tracer) return;
    pthread_mutex_lock(&tracer->device->mutex);
    renderer_close(tracer->renderer);
    pthread_mutex_unlock(&tracer->device->mutex);
    free(tracer);
}

static void reals_read(double *values, size_t count, GlintReal real, const void *reals, size_t first)
{
    const bool is_double = real == GLINT_FLOAT64;
    const size_t size = is_double ? sizeof(double) : sizeof(float);
    numbers_widen(values, (const char *)reals + first * size, count, is_double);
}

static void ray_read(TraceRay *ray, const GlintRays *rays, size_t index)
{
    *ray = (TraceRay){.tmax = INFINITY};
    reals_read(&ray->origin.x, 3, rays->real, rays->origins, 3 * index);
    reals_read(&ray->direction.x, 3, rays->real, rays->directions, 3 * index);
    if (rays->tmin) reals_read(&ray->tmin, 1, rays->real, rays->tmin, index);
    if (rays->tmax) reals_read(&ray->tmax, 1, rays->real, rays->tmax, index);
}

typedef struct {
    const GlintRays *rays;
    size_t first; // index in `rays` of the batch's first ray
    Precision precision;
    TraceRay *scaled;
    int *exponents;
    pthread_mutex_t mutex; // protects the members below
    size_t wrong;          // index of the first ray that is invalid, or SIZE_MAX
    const char *reason;
} RayBatch;

static void ray_batch_scale(void *context, size_t begin, size_t end)
{
    RayBatch *batch = context;
    const char *reason = NULL;
    for (size_t i = begin; i < end && !reason; i++) {
        const size_t index = batch->first + i;
        ray_read(&batch->scaled[i], batch->rays, index);
        reason = trace_ray_why_not(&batch->scaled[i], batch->precision);
        if (!reason) {
            batch->scaled[i] = trace_ray_scaled(batch->scaled[i], batch->precision, &batch->exponents[i]);
            continue;
        }
        pthread_mutex_lock(&batch->mutex);
        if (index < batch->wrong) {
            batch->wrong = index;
            batch->reason = reason;
        }
        pthread_mutex_unlock(&batch->mutex);
    }
}

bool rays_scale(TraceRay *scaled, int *exponents, const GlintRays *rays, size_t first, size_t count,
                Precision precision, MessageList *messages)
{
    RayBatch batch = {.rays = rays,
                      .first = first,
                      .precision = precision,
                      .scaled = scaled,
                      .mutex = PTHREAD_MUTEX_INITIALIZER,
                      .wrong = SIZE_MAX};
    batch.exponents = exponents; // in the initializer, clang-tidy 14 would not see that it is written to
    parallel_run(count, RAYS_PER_THREAD_MIN, ray_batch_scale, &batch);
    return !batch.reason || message_error(messages, "ray %zu: %s", batch.wrong, batch.reason);
}

static void vector_write(double *vectors, size_t index, Vector3 vector, bool is_hit)
{
    for (size_t axis = 0; axis < 3 && vectors; axis++)
        vectors[3 * index + axis] = is_hit ? (&vector.x)[axis] : 0;
}

// The caller's arrays, or NULL where not wanted.
typedef struct {
    GlintHits hits;
    uint8_t *occluded;
} TraceArrays;

static void hit_write(const TraceArrays *arrays, size_t index, TraceHit *hit, int exponent)
{
    const GlintHits *hits = &arrays->hits;
    const bool is_hit = hit->object != UINT32_MAX, is_certain = hit->certainty != TRACE_UNCERTAIN;
    trace_hit_unscale(hit, exponent);
    if (hits->object) hits->object[index] = hit->object;
    if (hits->t) hits->t[index] = is_hit ? hit->t : (double)INFINITY;
    if (hits->low) hits->low[index] = !is_hit ? (double)INFINITY : is_certain ? hit->low : hit->t;
    if (hits->high) hits->high[index] = !is_hit ? (double)INFINITY : is_certain ? hit->high : hit->t;
    vector_write(hits->normal, index, hit->normal, is_hit);
    vector_write(hits->position, index, hit->position, is_hit);
    static const uint8_t certainties[] = {[TRACE_UNCERTAIN] = GLINT_UNCERTAIN,
                                          [TRACE_CERTAIN] = GLINT_CERTAIN,
                                          [TRACE_CERTAIN_IN_DOUBLE] = GLINT_CERTAIN_IN_DOUBLE};
    if (hits->certainty) hits->certainty[index] = certainties[hit->certainty];
    if (arrays->occluded) arrays->occluded[index] = is_hit;
}

typedef struct {
    const TraceArrays *arrays;
    size_t first; // index in `arrays` of the batch's first hit
    TraceHit *found;
    const int *exponents;
} HitBatch;

static void hit_batch_write(void *context, size_t begin, size_t end)
{
    const HitBatch *batch = context;
    for (size_t i = begin; i < end; i++)
        hit_write(batch->arrays, batch->first + i, &batch->found[i], batch->exponents[i]);
}

// Traces rays in batches to bound memory. Returns false with a message if a ray is invalid, or without one
// if the device failed.
static bool batches_trace(GlintTracer *tracer, const GlintRays *rays, const TraceArrays *arrays,
                          MessageList *messages)
{
    const size_t batch = batch_rays(tracer, rays->count);
    OWNED TraceRay *scaled = memory_allocate(batch, sizeof *scaled);
    OWNED TraceHit *found = memory_allocate(batch, sizeof *found);
    OWNED int *exponents = memory_allocate(batch, sizeof *exponents);
    for (size_t first = 0, count; first < rays->count; first += count) {
        count = rays->count - first < batch ? rays->count - first : batch;
        if (!rays_scale(scaled, exponents, rays, first, count, tracer->precision, messages) ||
            !renderer_trace_closest(tracer->renderer, scaled, count, found))
            return false;
        HitBatch hits = {arrays, first, found, exponents};
        parallel_run(count, RAYS_PER_THREAD_MIN, hit_batch_write, &hits);
    }
    return true;
}

bool rays_read(GlintRays *read, const GlintRays *given, MessageList *messages)
{
    if (!struct_read(read, sizeof *read, given, "GlintRays", messages)) return false;
    if (!real_is_known(read->real, messages)) return false;
    if (read->count > 0 && (!read->origins || !read->directions))
        return message_error(messages, "rays need origins and directions");
    return true;
}

static GlintStatus call_trace(GlintTracer *tracer, const GlintRays *rays, const TraceArrays *arrays,
                              MessageList *list, char **messages)
{
    pthread_mutex_lock(&tracer->device->mutex);
    const bool is_sound = batches_trace(tracer, rays, arrays, list);
    const GlintStatus status =
        call_end(list, tracer->device, is_sound ? GLINT_DONE : GLINT_WRONG_INPUT, messages);
    pthread_mutex_unlock(&tracer->device->mutex);
    return status;
}

GlintStatus glint_trace(GlintTracer *tracer, const GlintRays *rays, GlintHits *hits, char **messages)
{
    MessageList list = {0};
    GlintRays given;
    TraceArrays arrays = {0};
    if (!rays_read(&given, rays, &list) ||
        !struct_read(&arrays.hits, sizeof arrays.hits, hits, "GlintHits", &list))
        return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    return call_trace(tracer, &given, &arrays, &list, messages);
}

GlintStatus glint_trace_occlusion(GlintTracer *tracer, const GlintRays *rays, GlintOcclusion *occlusion,
                                  char **messages)
{
    MessageList list = {0};
    GlintRays given;
    GlintOcclusion output;
    if (!rays_read(&given, rays, &list) ||
        !struct_read(&output, sizeof output, occlusion, "GlintOcclusion", &list))
        return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    const TraceArrays arrays = {.hits.certainty = output.certainty, .occluded = output.occluded};
    return call_trace(tracer, &given, &arrays, &list, messages);
}
