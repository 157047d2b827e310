// Traces explicit rays.
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/render/renderer_state.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { TRACE_GROUP = 64, BATCH_RAYS_MAX = 1 << 18 };

// Rays of one launch.
typedef struct {
    const Renderer *renderer;
    KernelType type;
    const TraceRay *rays;
    TraceHit *hits;
    void *ray_scalars; // as the kernel reads and writes them
    const void *result_scalars;
    const uint32_t *objects;
} TraceBatch;

static void scalar_set(void *scalars, size_t index, bool is_double, double value)
{
    if (is_double)
        ((double *)scalars)[index] = value;
    else
        ((float *)scalars)[index] = (float)value;
}

static double scalar_at(const void *scalars, size_t index, bool is_double)
{
    return is_double ? ((const double *)scalars)[index] : (double)((const float *)scalars)[index];
}

static void vector_at(const void *scalars, size_t index, bool is_double, double vector[3])
{
    for (size_t axis = 0; axis < 3; axis++)
        vector[axis] = scalar_at(scalars, index + axis, is_double);
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
    vector_at(scalars, index + RESULT_REFLECTED_ORIGIN, is_double, hit->reflected_origin);
    vector_at(scalars, index + RESULT_REFLECTED_DIRECTION, is_double, hit->reflected_direction);
    vector_at(scalars, index + RESULT_REFRACTED_ORIGIN, is_double, hit->refracted_origin);
    vector_at(scalars, index + RESULT_REFRACTED_DIRECTION, is_double, hit->refracted_direction);
    for (size_t axis = 0; axis < 3; axis++) {
        hit->reflected_origin[axis] *= unit;
        hit->refracted_origin[axis] *= unit;
    }
}

// Reads the hits `begin` to `end` - 1 of a TraceBatch.
static void hits_read(void *context, size_t begin, size_t end)
{
    const TraceBatch *batch = context;
    const Renderer *renderer = batch->renderer;
    const void *scalars = batch->result_scalars;
    const bool is_double = renderer->report.is_double, certifies = renderer_certifies(renderer);
    const double unit = renderer->scene.compiled.unit;
    const TraceCertainty certainty = renderer->pass == PASS_ALL ? TRACE_CERTAIN : TRACE_CERTAIN_IN_DOUBLE;
    for (size_t i = begin; i < end; i++) {
        const size_t index = i * result_scalars(batch->type);
        TraceHit *hit = &batch->hits[i];
        hit->object = batch->objects[i];
        hit->t = unit * scalar_at(scalars, index + RESULT_T, is_double);
        hit->low = unit * scalar_at(scalars, index + RESULT_LOW, is_double);
        hit->high = unit * scalar_at(scalars, index + RESULT_HIGH, is_double);
        vector_at(scalars, index + RESULT_NORMAL, is_double, hit->normal);
        vector_at(scalars, index + RESULT_POSITION, is_double, hit->position);
        for (size_t axis = 0; axis < 3; axis++)
            hit->position[axis] *= unit;
        const bool is_certain = certifies && scalar_at(scalars, index + RESULT_UNCERTAIN, is_double) == 0;
        hit->certainty = is_certain ? certainty : TRACE_UNCERTAIN;
        if (batch->type == KERNEL_TRACE) bounces_read(hit, scalars, index, is_double, unit);
    }
}

// Writes the scalars of the rays `begin` to `end` - 1 of a TraceBatch.
static void rays_write(void *context, size_t begin, size_t end)
{
    const TraceBatch *batch = context;
    const bool is_double = batch->renderer->report.is_double, certifies = renderer_certifies(batch->renderer);
    const double unit = batch->renderer->scene.compiled.unit,
                 farthest = is_double ? DBL_MAX : (double)FLT_MAX;
    void *scalars = batch->ray_scalars;
    for (size_t i = begin; i < end; i++) {
        const double *origin = batch->rays[i].origin, *direction = batch->rays[i].direction;
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
            scalar_set(scalars, i * RAY_SCALARS + k, is_double,
                       !underflows ? ray[k]
                       : is_double ? DBL_MIN
                                   : (double)FLT_MIN);
        }
    }
}

// Launches the kernel and returns the launch's seconds.
static double trace_launch(Renderer *renderer, KernelType type, uint32_t count, cl_mem rays, cl_mem results,
                           cl_mem objects)
{
    Compute *compute = renderer->compute;
    cl_kernel kernel = renderer_kernel(renderer, type);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT, rays);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 1, sizeof count, &count);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 2, results);
    kernel_buffer(compute, kernel, SCENE_ARGUMENT_COUNT + 3, objects);
    const size_t *fixed = compute->device->work_group,
                 items = (count + renderer->report.lanes - 1) / renderer->report.lanes,
                 group = fixed[0] > 0 ? fixed[0] * fixed[1] : TRACE_GROUP;
    return renderer_launch(renderer, type, 1, NULL, &items, &group);
}

static void trace_batch(Renderer *renderer, KernelType type, const TraceRay *rays, size_t count,
                        TraceHit *hits)
{
    Compute *compute = renderer->compute;
    const size_t scalar = renderer_scalar_size(renderer), ray_size = count * RAY_SCALARS * scalar,
                 result_size = count * result_scalars(type) * scalar, object_size = count * sizeof(uint32_t);
    cl_mem ray_buffer = spare_buffer_acquire(renderer, ray_size),
           results = spare_buffer_acquire(renderer, result_size),
           objects = spare_buffer_acquire(renderer, object_size);
    TraceBatch batch = {renderer, type, rays, hits};
    batch.ray_scalars = renderer_map(renderer, ray_buffer, 0, ray_size, CL_MAP_WRITE_INVALIDATE_REGION);
    if (compute_ok(compute)) parallel_run(count, RAYS_OF_THREAD_MIN, rays_write, &batch);
    renderer_unmap(renderer, ray_buffer, batch.ray_scalars);
    const double seconds = trace_launch(renderer, type, (uint32_t)count, ray_buffer, results, objects);
    pace_record_launch(renderer_pace(renderer, type), count, seconds);
    batch.result_scalars = renderer_map(renderer, results, 0, result_size, CL_MAP_READ);
    batch.objects = renderer_map(renderer, objects, 0, object_size, CL_MAP_READ);
    if (compute_ok(compute)) parallel_run(count, RAYS_OF_THREAD_MIN, hits_read, &batch);
    renderer_unmap(renderer, results, batch.result_scalars);
    renderer_unmap(renderer, objects, batch.objects);
    compute_try(compute, clFinish(compute->queue));
    spare_buffer_release(renderer, ray_buffer);
    spare_buffer_release(renderer, results);
    spare_buffer_release(renderer, objects);
}

static bool pass_trace(Renderer *renderer, KernelType type, const TraceRay *rays, size_t ray_count,
                       TraceHit *hits)
{
    const Compute *compute = renderer->compute;
    // the report describes images, and a view queries one pixel after another
    RenderReport *report = &renderer->report;
    const size_t launch_count = report->launches.count, read_count = report->reads.count;
    Pace *pace = renderer_pace(renderer, type);
    pace_begin_band(pace);
    for (size_t first = 0, count; first < ray_count && compute_ok(compute); first += count) {
        count = ray_count - first < BATCH_RAYS_MAX ? ray_count - first : BATCH_RAYS_MAX;
        if (count > pace_launch_samples(pace)) count = (size_t)pace_launch_samples(pace);
        trace_batch(renderer, type, rays + first, count, hits + first);
    }
    report->launches.count = launch_count;
    report->reads.count = read_count;
    return compute_ok(compute);
}

static bool rays_trace(Renderer *renderer, KernelType type, const TraceRay *rays, size_t ray_count,
                       TraceHit *hits);

// Re-traces the rays whose hits are uncertain.
static bool uncertain_trace(Renderer *next_pass, KernelType type, const TraceRay *rays, size_t ray_count,
                            TraceHit *hits)
{
    size_t count = 0;
    for (size_t i = 0; i < ray_count; i++)
        count += hits[i].certainty == TRACE_UNCERTAIN;
    if (count == 0) return true;
    TraceRay *chosen = memory_allocate(count, sizeof *chosen);
    TraceHit *found = memory_allocate(count, sizeof *found);
    for (size_t i = 0, k = 0; i < ray_count; i++)
        if (hits[i].certainty == TRACE_UNCERTAIN) chosen[k++] = rays[i];
    const bool is_done = rays_trace(next_pass, type, chosen, count, found);
    for (size_t i = 0, k = 0; i < ray_count; i++)
        if (hits[i].certainty == TRACE_UNCERTAIN) hits[i] = found[k++];
    free(chosen);
    free(found);
    return is_done;
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

static bool rays_trace(Renderer *renderer, KernelType type, const TraceRay *rays, size_t ray_count,
                       TraceHit *hits)
{
    if (!pass_trace(renderer, type, rays, ray_count, hits)) return false;
    if (!renderer->next_pass) return true;
    ends_apply(rays, ray_count, hits);
    return uncertain_trace(renderer->next_pass, type, rays, ray_count, hits) &&
           compute_check_reference(renderer->compute);
}

bool renderer_trace(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    return rays_trace(renderer, KERNEL_TRACE, rays, ray_count, hits);
}

bool renderer_trace_closest(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    return rays_trace(renderer, KERNEL_CLOSEST, rays, ray_count, hits);
}

// Returns value * 2^exponent, rounded once. ldexp takes several times as long as the product.
static double scale_by_power(double value, int exponent, double power)
{
    return isnormal(power) ? value * power : ldexp(value, exponent);
}

static double farthest_of(Precision precision)
{
    return precision < PRECISION_DOUBLE ? (double)FLT_MAX : DBL_MAX;
}

const char *trace_ray_fault(const TraceRay *ray, Precision precision)
{
    bool is_within = isfinite(ray->tmin) && !isnan(ray->tmax), has_direction = false;
    for (int axis = 0; axis < 3; axis++) {
        is_within &= fabs(ray->origin[axis]) <= farthest_of(precision) && isfinite(ray->direction[axis]);
        has_direction |= ray->direction[axis] != 0;
    }
    if (!is_within)
        return "a number is not finite or beyond the precision's range; only tmax may be infinite";
    if (!has_direction) return "a ray's direction cannot be 0 0 0";
    return precision == PRECISION_CERTIFIED && ray->tmin != 0
               ? "at certified a ray starts at its origin, tmin 0"
               : NULL;
}

TraceRay trace_ray_scaled(TraceRay ray, Precision precision, int *exponent)
{
    double *d = ray.direction;
    frexp(fmax(fmax(fabs(d[0]), fabs(d[1])), fabs(d[2])), exponent);
    const double power = ldexp(1, *exponent), inverse = ldexp(1, -*exponent);
    for (int axis = 0; axis < 3; axis++)
        d[axis] = scale_by_power(d[axis], -*exponent, inverse);
    ray.tmin = scale_by_power(ray.tmin, *exponent, power);
    ray.tmax = fmin(scale_by_power(ray.tmax, *exponent, power), farthest_of(precision));
    return ray;
}

void trace_hit_unscale(TraceHit *hit, int exponent)
{
    const double power = ldexp(1, -exponent), inverse = ldexp(1, exponent);
    const double low = hit->low, high = hit->high;
    hit->t = scale_by_power(hit->t, -exponent, power);
    hit->low = scale_by_power(low, -exponent, power);
    hit->high = scale_by_power(high, -exponent, power);
    // where scaling is not exact, bounds are rounded outwards
    if (scale_by_power(hit->low, exponent, inverse) != low) hit->low = nextafter(hit->low, -INFINITY);
    if (scale_by_power(hit->high, exponent, inverse) != high) hit->high = nextafter(hit->high, INFINITY);
}
