// Traces explicit rays.
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/render/band.h"
#include "host/render/renderer_state.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { TRACE_GROUP = 64, BATCH_RAYS_MAX = 1 << 18 };

// Rays of one launch.
typedef struct {
    const Pass *pass;
    KernelType type;
    const TraceRay *rays;
    TraceHit *hits;
    void *ray_scalars; // as the kernel reads and writes them
    const void *result_scalars;
    const uint32_t *objects;
} TraceBatch;

static double scalar_at(const void *scalars, size_t index, bool is_double)
{
    return is_double ? ((const double *)scalars)[index] : (double)((const float *)scalars)[index];
}

static Vector3 vector_at(const void *scalars, size_t index, bool is_double, double unit)
{
    const Vector3 stored = {scalar_at(scalars, index, is_double), scalar_at(scalars, index + 1, is_double),
                            scalar_at(scalars, index + 2, is_double)};
    return vector_scale(stored, unit);
}

// Returns how many scalars a kernel stores per ray.
static size_t result_scalars(KernelType type)
{
    return type == KERNEL_TRACE ? RESULT_SCALARS : CLOSEST_SCALARS;
}

static void bounces_read(TraceHit *hit, const void *scalars, size_t index, bool is_double, double unit)
{
    hit->transmission = scalar_at(scalars, index + RESULT_REFRACTED_WEIGHT, is_double);
    hit->light = scalar_at(scalars, index + RESULT_TRANSMITTANCE, is_double);
    hit->reflected_origin = vector_at(scalars, index + RESULT_REFLECTED_ORIGIN, is_double, unit);
    hit->reflected_direction = vector_at(scalars, index + RESULT_REFLECTED_DIRECTION, is_double, 1);
    hit->refracted_origin = vector_at(scalars, index + RESULT_REFRACTED_ORIGIN, is_double, unit);
    hit->refracted_direction = vector_at(scalars, index + RESULT_REFRACTED_DIRECTION, is_double, 1);
}

// Reads the hits `begin` to `end` - 1 of a TraceBatch.
static void hits_read(void *context, size_t begin, size_t end)
{
    const TraceBatch *batch = context;
    const Pass *pass = batch->pass;
    const void *scalars = batch->result_scalars;
    const bool is_double = pass->scene.is_double, certifies = pass->certifies;
    const double unit = pass->scene.compiled.unit;
    const TraceCertainty certainty = pass->type == PASS_ALL ? TRACE_CERTAIN : TRACE_CERTAIN_IN_DOUBLE;
    for (size_t i = begin; i < end; i++) {
        const size_t index = i * result_scalars(batch->type);
        TraceHit *hit = &batch->hits[i];
        hit->object = batch->objects[i];
        hit->t = unit * scalar_at(scalars, index + RESULT_T, is_double);
        hit->low = unit * scalar_at(scalars, index + RESULT_LOW, is_double);
        hit->high = unit * scalar_at(scalars, index + RESULT_HIGH, is_double);
        hit->normal = vector_at(scalars, index + RESULT_NORMAL, is_double, 1);
        hit->position = vector_at(scalars, index + RESULT_POSITION, is_double, unit);
        const bool is_certain = certifies && scalar_at(scalars, index + RESULT_UNCERTAIN, is_double) == 0;
        hit->certainty = is_certain ? certainty : TRACE_UNCERTAIN;
        if (batch->type == KERNEL_TRACE) bounces_read(hit, scalars, index, is_double, unit);
    }
}

// Writes the scalars of the rays `begin` to `end` - 1 of a TraceBatch.
static void rays_write(void *context, size_t begin, size_t end)
{
    const TraceBatch *batch = context;
    const Pass *pass = batch->pass;
    const bool is_double = pass->scene.is_double, certifies = pass->certifies;
    const double unit = pass->scene.compiled.unit, farthest = is_double ? DBL_MAX : (double)FLT_MAX;
    void *scalars = batch->ray_scalars;
    for (size_t i = begin; i < end; i++) {
        const double *origin = &batch->rays[i].origin.x, *direction = &batch->rays[i].direction.x;
        // the kernel bounds the hits of rays that have no end; ends_apply applies tmax
        const double tmax = certifies ? INFINITY : batch->rays[i].tmax;
        const double ray[RAY_SCALARS] = {
            origin[0] / unit, origin[1] / unit, origin[2] / unit,           direction[0],
            direction[1],     direction[2],     batch->rays[i].tmin / unit, fmin(tmax / unit, farthest)};
        for (size_t k = 0; k < RAY_SCALARS; k++) {
            // a coordinate that underflows must not seem to be exactly 0: the kernel flags origins below its
            // range
            const double rounded = is_double ? ray[k] : (double)(float)ray[k];
            const bool underflows = certifies && k < 3 && rounded == 0 && origin[k] != 0;
            if (is_double)
                ((double *)scalars)[i * RAY_SCALARS + k] = underflows ? DBL_MIN : ray[k];
            else
                ((float *)scalars)[i * RAY_SCALARS + k] = underflows ? FLT_MIN : (float)ray[k];
        }
    }
}

// Launches the kernel and returns the launch's seconds.
static double trace_launch(Pass *pass, KernelType type, uint32_t count, cl_mem rays, cl_mem results,
                           cl_mem objects)
{
    Compute *compute = pass->compute;
    cl_kernel kernel = kernels_get(&pass->kernels, type);
    cl_uint argument = SCENE_ARGUMENT_COUNT;
    kernel_buffer(compute, kernel, argument++, rays);
    kernel_argument(compute, kernel, argument++, sizeof count, &count);
    kernel_buffer(compute, kernel, argument++, results);
    kernel_buffer(compute, kernel, argument, objects);
    const size_t *fixed = compute->device->work_group, items = (count + pass->lanes - 1) / pass->lanes,
                 group = fixed[0] > 0 ? fixed[0] * fixed[1] : TRACE_GROUP;
    return kernels_launch(&pass->kernels, type, 1, NULL, &items, &group);
}

static void trace_batch(Pass *pass, KernelType type, const TraceRay *rays, size_t count, TraceHit *hits)
{
    Compute *compute = pass->compute;
    const size_t scalar = pass_scalar_size(pass), ray_size = count * RAY_SCALARS * scalar,
                 result_size = count * result_scalars(type) * scalar, object_size = count * sizeof(uint32_t);
    cl_mem ray_buffer = buffer_pool_acquire(&pass->pool, compute, ray_size),
           results = buffer_pool_acquire(&pass->pool, compute, result_size),
           objects = buffer_pool_acquire(&pass->pool, compute, object_size);
    TraceBatch batch = {pass, type, rays, hits};
    batch.ray_scalars = pass_map(pass, ray_buffer, 0, ray_size, CL_MAP_WRITE_INVALIDATE_REGION);
    if (compute_ok(compute)) parallel_run(count, RAYS_PER_THREAD_MIN, rays_write, &batch);
    compute_unmap(compute, ray_buffer, batch.ray_scalars);
    const double seconds = trace_launch(pass, type, (uint32_t)count, ray_buffer, results, objects);
    pace_record_launch(&pass->kernels.paces[type], count, seconds);
    batch.result_scalars = pass_map(pass, results, 0, result_size, CL_MAP_READ);
    batch.objects = pass_map(pass, objects, 0, object_size, CL_MAP_READ);
    if (compute_ok(compute)) parallel_run(count, RAYS_PER_THREAD_MIN, hits_read, &batch);
    compute_unmap(compute, results, batch.result_scalars);
    compute_unmap(compute, objects, batch.objects);
    compute_try(compute, clFinish(compute->queue));
    buffer_pool_release(&pass->pool, ray_buffer);
    buffer_pool_release(&pass->pool, results);
    buffer_pool_release(&pass->pool, objects);
}

static bool pass_trace(Pass *pass, KernelType type, const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    const Compute *compute = pass->compute;
    // the report describes images, and a view queries one pixel after another
    RenderReport *report = pass->report;
    const size_t launch_count = report->launches.count, read_count = report->reads.count;
    Pace *pace = &pass->kernels.paces[type];
    pace_begin_band(pace);
    for (size_t first = 0, count; first < ray_count && compute_ok(compute); first += count) {
        count = ray_count - first < BATCH_RAYS_MAX ? ray_count - first : BATCH_RAYS_MAX;
        if (count > pace_launch_samples(pace)) count = (size_t)pace_launch_samples(pace);
        trace_batch(pass, type, rays + first, count, hits + first);
    }
    report->launches.count = launch_count;
    report->reads.count = read_count;
    return compute_ok(compute);
}

// Turns certain hits beyond their rays' ends into misses.
static void ends_apply(const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    for (size_t i = 0; i < ray_count; i++) {
        TraceHit *hit = &hits[i];
        // trace_ray_scaled may have rounded the end
        const double end = rays[i].tmax, before = nextafter(end, -INFINITY), after = nextafter(end, INFINITY);
        if (hit->certainty == TRACE_UNCERTAIN || hit->object == UINT32_MAX || hit->high < before) continue;
        if (hit->low <= after) hit->certainty = TRACE_UNCERTAIN;
        if (!(hit->t < end)) hit->object = UINT32_MAX;
    }
}

// Traces the rays in this pass and re-traces those whose hits remain uncertain in the passes after it.
static bool passes_trace(Pass *pass, KernelType type, const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    if (!pass_trace(pass, type, rays, ray_count, hits)) return false;
    if (!pass->certifies) return true;
    ends_apply(rays, ray_count, hits);
    size_t count = 0;
    for (size_t i = 0; i < ray_count; i++)
        count += hits[i].certainty == TRACE_UNCERTAIN;
    if (count == 0) return true;
    OWNED TraceRay *chosen = memory_allocate(count, sizeof *chosen);
    OWNED TraceHit *found = memory_allocate(count, sizeof *found);
    for (size_t i = 0, k = 0; i < ray_count; i++)
        if (hits[i].certainty == TRACE_UNCERTAIN) chosen[k++] = rays[i];
    const bool is_done = passes_trace(pass_next(pass), type, chosen, count, found);
    for (size_t i = 0, k = 0; i < ray_count; i++)
        if (hits[i].certainty == TRACE_UNCERTAIN) hits[i] = found[k++];
    return is_done;
}

static bool rays_trace(Renderer *renderer, KernelType type, const TraceRay *rays, size_t ray_count,
                       TraceHit *hits)
{
    const bool is_done = passes_trace(renderer->passes, type, rays, ray_count, hits);
    return compute_check_reference(renderer->passes->compute) && is_done;
}

bool renderer_trace(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    return rays_trace(renderer, KERNEL_TRACE, rays, ray_count, hits);
}

bool renderer_trace_closest(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    return rays_trace(renderer, KERNEL_CLOSEST, rays, ray_count, hits);
}
