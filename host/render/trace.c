// Traces explicit rays.
#include "host/base/memory.h"
#include "host/render/renderer_state.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { TRACE_GROUP = 64, BATCH_RAYS_MAX = 1 << 18 };

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
static size_t result_scalars(KernelKind kind)
{
    return kind == KERNEL_TRACE ? RESULT_SCALARS : CLOSEST_SCALARS;
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

// Returns the hit whose scalars begin at `index`.
static TraceHit hit_at(const Renderer *renderer, KernelKind kind, const void *scalars, size_t index,
                       uint32_t object)
{
    const bool is_double = renderer->report.is_double;
    const double unit = renderer->compiled.unit;
    TraceHit hit = {.object = object,
                    .t = unit * scalar_at(scalars, index + RESULT_T, is_double),
                    .low = unit * scalar_at(scalars, index + RESULT_LOW, is_double),
                    .high = unit * scalar_at(scalars, index + RESULT_HIGH, is_double)};
    vector_at(scalars, index + RESULT_NORMAL, is_double, hit.normal);
    vector_at(scalars, index + RESULT_POSITION, is_double, hit.position);
    for (size_t axis = 0; axis < 3; axis++)
        hit.position[axis] *= unit;
    if (renderer_certifies(renderer) && scalar_at(scalars, index + RESULT_DOUBT, is_double) == 0)
        hit.certainty = renderer->pass == PASS_ALL ? TRACE_CERTAIN : TRACE_CERTAIN_IN_DOUBLE;
    if (kind == KERNEL_TRACE) bounces_read(&hit, scalars, index, is_double, unit);
    return hit;
}

// Returns the rays' scalars as the kernel reads them; the caller frees them.
static void *rays_pack(const Renderer *renderer, const TraceRay *rays, uint32_t count)
{
    bool is_double = renderer->report.is_double;
    double unit = renderer->compiled.unit, farthest = is_double ? DBL_MAX : (double)FLT_MAX;
    void *scalars = memory_allocate((size_t)count * RAY_SCALARS, renderer_scalar_size(renderer));
    for (uint32_t i = 0; i < count; i++) {
        const double *origin = rays[i].origin, *direction = rays[i].direction;
        // the kernel bounds the hits of rays that have no end; ends_apply applies tmax
        const double tmax = renderer_certifies(renderer) ? INFINITY : rays[i].tmax;
        const double ray[RAY_SCALARS] = {
            origin[0] / unit, origin[1] / unit, origin[2] / unit,    direction[0],
            direction[1],     direction[2],     rays[i].tmin / unit, fmin(tmax / unit, farthest)};
        for (size_t k = 0; k < RAY_SCALARS; k++)
            scalar_set(scalars, i * RAY_SCALARS + k, is_double, ray[k]);
        // a coordinate that underflows must not seem to be exactly 0: the kernel flags origins below its
        // range
        for (size_t axis = 0; axis < 3 && renderer_certifies(renderer); axis++)
            if (origin[axis] != 0 && scalar_at(scalars, i * RAY_SCALARS + axis, is_double) == 0)
                scalar_set(scalars, i * RAY_SCALARS + axis, is_double, is_double ? DBL_MIN : (double)FLT_MIN);
    }
    return scalars;
}

// Launches the kernel and returns the launch's seconds.
static double trace_launch(Renderer *renderer, KernelKind kind, uint32_t count, cl_mem rays, cl_mem results,
                           cl_mem objects)
{
    Compute *compute = renderer->compute;
    cl_kernel kernel = renderer_kernel(renderer, kind);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT, sizeof rays, &rays);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 1, sizeof count, &count);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 2, sizeof results, &results);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 3, sizeof objects, &objects);
    const size_t *fixed = compute->device->work_group,
                 items = (count + renderer->report.lanes - 1) / renderer->report.lanes,
                 group = fixed[0] > 0 ? fixed[0] * fixed[1] : TRACE_GROUP;
    return renderer_launch(renderer, kind, 1, NULL, &items, &group);
}

static void hits_unpack(Renderer *renderer, KernelKind kind, uint32_t count, cl_mem results, cl_mem objects,
                        TraceHit *hits)
{
    Compute *compute = renderer->compute;
    size_t result_size = (size_t)count * result_scalars(kind) * renderer_scalar_size(renderer);
    const void *result = renderer_map(renderer, results, 0, result_size, CL_MAP_READ);
    const uint32_t *object = renderer_map(renderer, objects, 0, (size_t)count * sizeof *object, CL_MAP_READ);
    for (uint32_t i = 0; i < count && compute_ok(compute); i++)
        hits[i] = hit_at(renderer, kind, result, i * result_scalars(kind), object[i]);
    renderer_unmap(renderer, results, result);
    renderer_unmap(renderer, objects, object);
    compute_try(compute, clFinish(compute->queue));
}

static void trace_batch(Renderer *renderer, KernelKind kind, const TraceRay *rays, uint32_t count,
                        TraceHit *hits)
{
    Compute *compute = renderer->compute;
    size_t scalar = renderer_scalar_size(renderer);
    void *scalars = rays_pack(renderer, rays, count);
    cl_mem ray_buffer =
        buffer_create(compute, (size_t)count * RAY_SCALARS * scalar, scalars, CL_MEM_READ_ONLY);
    free(scalars);
    cl_mem results =
        buffer_create(compute, (size_t)count * result_scalars(kind) * scalar, NULL, CL_MEM_WRITE_ONLY);
    cl_mem objects = buffer_create(compute, (size_t)count * sizeof(uint32_t), NULL, CL_MEM_WRITE_ONLY);
    const double seconds = trace_launch(renderer, kind, count, ray_buffer, results, objects);
    pace_note_launch(renderer_pace(renderer, kind), count, seconds);
    hits_unpack(renderer, kind, count, results, objects, hits);
    buffer_release(ray_buffer);
    buffer_release(results);
    buffer_release(objects);
}

static bool pass_trace(Renderer *renderer, KernelKind kind, const TraceRay *rays, size_t ray_count,
                       TraceHit *hits)
{
    const Compute *compute = renderer->compute;
    // the report describes images, and a view queries one pixel after another
    RenderReport *report = &renderer->report;
    const size_t launch_count = report->launches.count, read_count = report->reads.count;
    Pace *pace = renderer_pace(renderer, kind);
    pace_begin_band(pace);
    for (size_t first = 0, count; first < ray_count && compute_ok(compute); first += count) {
        count = ray_count - first < BATCH_RAYS_MAX ? ray_count - first : BATCH_RAYS_MAX;
        if (count > pace_launch_samples(pace)) count = (size_t)pace_launch_samples(pace);
        trace_batch(renderer, kind, rays + first, (uint32_t)count, hits + first);
    }
    report->launches.count = launch_count;
    report->reads.count = read_count;
    return compute_ok(compute);
}

static bool rays_trace(Renderer *renderer, KernelKind kind, const TraceRay *rays, size_t ray_count,
                       TraceHit *hits);

// Re-traces the rays whose hits are uncertain.
static bool uncertain_trace(Renderer *repeat, KernelKind kind, const TraceRay *rays, size_t ray_count,
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
    const bool is_done = rays_trace(repeat, kind, chosen, count, found);
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

static bool rays_trace(Renderer *renderer, KernelKind kind, const TraceRay *rays, size_t ray_count,
                       TraceHit *hits)
{
    if (!pass_trace(renderer, kind, rays, ray_count, hits)) return false;
    if (!renderer->repeat) return true;
    ends_apply(rays, ray_count, hits);
    return uncertain_trace(renderer->repeat, kind, rays, ray_count, hits) &&
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

TraceRay trace_ray_scaled(TraceRay ray, double farthest, int *exponent)
{
    double *d = ray.direction;
    frexp(fmax(fmax(fabs(d[0]), fabs(d[1])), fabs(d[2])), exponent);
    for (int axis = 0; axis < 3; axis++)
        d[axis] = ldexp(d[axis], -*exponent);
    ray.tmin = ldexp(ray.tmin, *exponent);
    ray.tmax = fmin(ldexp(ray.tmax, *exponent), farthest);
    return ray;
}

// Returns a bound times 2^exponent, rounded towards `outward` where that is not exact.
static double bound_scaled(double bound, int exponent, double outward)
{
    const double scaled = ldexp(bound, exponent);
    return ldexp(scaled, -exponent) == bound ? scaled : nextafter(scaled, outward);
}

void trace_hit_unscale(TraceHit *hit, int exponent)
{
    hit->t = ldexp(hit->t, -exponent);
    hit->low = bound_scaled(hit->low, -exponent, -INFINITY);
    hit->high = bound_scaled(hit->high, -exponent, INFINITY);
}
