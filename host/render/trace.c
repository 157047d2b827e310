// Explicit rays.
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

// The scalars of one hit, from `index` on.
static TraceHit hit_at(const void *scalars, size_t index, bool is_double, uint32_t object, double unit)
{
    TraceHit hit = {.object = object,
                    .t = scalar_at(scalars, index + RESULT_T, is_double),
                    .transmission = scalar_at(scalars, index + RESULT_REFRACTED_WEIGHT, is_double),
                    .light = scalar_at(scalars, index + RESULT_TRANSMITTANCE, is_double)};
    vector_at(scalars, index + RESULT_NORMAL, is_double, hit.normal);
    vector_at(scalars, index + RESULT_POSITION, is_double, hit.position);
    vector_at(scalars, index + RESULT_REFLECTED_ORIGIN, is_double, hit.reflected_origin);
    vector_at(scalars, index + RESULT_REFLECTED_DIRECTION, is_double, hit.reflected_direction);
    vector_at(scalars, index + RESULT_REFRACTED_ORIGIN, is_double, hit.refracted_origin);
    vector_at(scalars, index + RESULT_REFRACTED_DIRECTION, is_double, hit.refracted_direction);
    hit.t *= unit;
    for (size_t axis = 0; axis < 3; axis++) {
        hit.position[axis] *= unit;
        hit.reflected_origin[axis] *= unit;
        hit.refracted_origin[axis] *= unit;
    }
    return hit;
}

// The rays' scalars as the kernel reads them; caller frees.
static void *rays_pack(const Renderer *renderer, const TraceRay *rays, uint32_t count)
{
    bool is_double = renderer->report.is_double;
    double unit = renderer->compiled.unit, farthest = is_double ? DBL_MAX : (double)FLT_MAX;
    void *scalars = memory_allocate((size_t)count * RAY_SCALARS, renderer_scalar_size(renderer));
    for (uint32_t i = 0; i < count; i++) {
        const double *origin = rays[i].origin, *direction = rays[i].direction;
        const double ray[RAY_SCALARS] = {
            origin[0] / unit, origin[1] / unit, origin[2] / unit,    direction[0],
            direction[1],     direction[2],     rays[i].tmin / unit, fmin(rays[i].tmax / unit, farthest)};
        for (size_t k = 0; k < RAY_SCALARS; k++)
            scalar_set(scalars, i * RAY_SCALARS + k, is_double, ray[k]);
    }
    return scalars;
}

// Returns the launch's seconds.
static double trace_launch(Renderer *renderer, uint32_t count, cl_mem rays, cl_mem results, cl_mem objects)
{
    Compute *compute = renderer->compute;
    cl_kernel kernel = renderer_kernel(renderer, KERNEL_TRACE);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT, sizeof rays, &rays);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 1, sizeof count, &count);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 2, sizeof results, &results);
    kernel_argument(compute, kernel, SCENE_ARGUMENT_COUNT + 3, sizeof objects, &objects);
    const size_t *fixed = compute->device->work_group,
                 items = (count + renderer->report.lanes - 1) / renderer->report.lanes,
                 group = fixed[0] > 0 ? fixed[0] * fixed[1] : TRACE_GROUP;
    return renderer_launch(renderer, KERNEL_TRACE, 1, NULL, &items, &group);
}

static void hits_unpack(Renderer *renderer, uint32_t count, cl_mem results, cl_mem objects, TraceHit *hits)
{
    Compute *compute = renderer->compute;
    size_t result_size = (size_t)count * RESULT_SCALARS * renderer_scalar_size(renderer);
    const void *result = renderer_map(renderer, results, 0, result_size, CL_MAP_READ);
    const uint32_t *object = renderer_map(renderer, objects, 0, (size_t)count * sizeof *object, CL_MAP_READ);
    for (uint32_t i = 0; i < count && compute_ok(compute); i++)
        hits[i] = hit_at(result, (size_t)i * RESULT_SCALARS, renderer->report.is_double, object[i],
                         renderer->compiled.unit);
    renderer_unmap(renderer, results, result);
    renderer_unmap(renderer, objects, object);
    compute_try(compute, clFinish(compute->queue));
}

static void trace_batch(Renderer *renderer, const TraceRay *rays, uint32_t count, TraceHit *hits)
{
    Compute *compute = renderer->compute;
    size_t scalar = renderer_scalar_size(renderer);
    void *scalars = rays_pack(renderer, rays, count);
    cl_mem ray_buffer =
        buffer_create(compute, (size_t)count * RAY_SCALARS * scalar, scalars, CL_MEM_READ_ONLY);
    free(scalars);
    cl_mem results = buffer_create(compute, (size_t)count * RESULT_SCALARS * scalar, NULL, CL_MEM_WRITE_ONLY);
    cl_mem objects = buffer_create(compute, (size_t)count * sizeof(uint32_t), NULL, CL_MEM_WRITE_ONLY);
    const double seconds = trace_launch(renderer, count, ray_buffer, results, objects);
    pace_note_launch(renderer_pace(renderer, KERNEL_TRACE), count, seconds);
    hits_unpack(renderer, count, results, objects, hits);
    buffer_release(ray_buffer);
    buffer_release(results);
    buffer_release(objects);
}

bool renderer_trace(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits)
{
    const Compute *compute = renderer->compute;
    // the report is of images: a view asks about pixel after pixel
    RenderReport *report = &renderer->report;
    const size_t launch_count = report->launches.count, read_count = report->reads.count;
    Pace *pace = renderer_pace(renderer, KERNEL_TRACE);
    pace_begin_band(pace);
    for (size_t first = 0, count; first < ray_count && compute_ok(compute); first += count) {
        count = ray_count - first < BATCH_RAYS_MAX ? ray_count - first : BATCH_RAYS_MAX;
        if (count > pace_launch_samples(pace)) count = (size_t)pace_launch_samples(pace);
        trace_batch(renderer, rays + first, (uint32_t)count, hits + first);
    }
    report->launches.count = launch_count;
    report->reads.count = read_count;
    return compute_ok(compute);
}
