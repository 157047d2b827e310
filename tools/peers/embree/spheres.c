#include "spheres.h"

#include "packet.h"
#include <stdalign.h>
#include <string.h>

RTCGeometry spheres_embree(RTCDevice device, Sphere *spheres, size_t count)
{
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    void *room = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                         sizeof *spheres, count);
    memcpy(room, spheres, count * sizeof *spheres);
    return geometry;
}

static void sphere_bounds(const struct RTCBoundsFunctionArguments *arguments)
{
    const Sphere *sphere = (const Sphere *)arguments->geometryUserPtr + arguments->primID;
    struct RTCBounds *bounds = arguments->bounds_o;
    bounds->lower_x = sphere->center.x - sphere->radius;
    bounds->lower_y = sphere->center.y - sphere->radius;
    bounds->lower_z = sphere->center.z - sphere->radius;
    bounds->upper_x = sphere->center.x + sphere->radius;
    bounds->upper_y = sphere->center.y + sphere->radius;
    bounds->upper_z = sphere->center.z + sphere->radius;
}

// Embree passes a callback as many rays as the CPU has lanes, at most 16. Each member of a ray, then each of
// its hit, is an array of that length.
enum { ORG = 0, TNEAR = 3, DIR = 4, TFAR = 8, NG = 12, PRIM_ID = 17, GEOM_ID };

#define RAY_PART(part)   rays[(part)*count + i]
#define RAY_VECTOR(part) ((Vector){RAY_PART(part), RAY_PART((part) + 1), RAY_PART((part) + 2)})

// Finds the first hits of `count` rays with unit directions and sets `hit` for the valid rays that have one.
// Uses the ray's point nearest to the center, so that squares of large numbers do not cancel (Haines and
// others, Precision improvements for ray/sphere intersection, Ray Tracing Gems, 2019).
static inline __attribute__((always_inline)) void
sphere_hits(Sphere sphere, const float *rays, unsigned count, const int *valid, int *hit, float *distance)
{
#pragma omp simd
    for (unsigned i = 0; i < count; i++) {
        Vector to_center = vector_subtract(sphere.center, RAY_VECTOR(ORG)), direction = RAY_VECTOR(DIR);
        float along = vector_dot(to_center, direction);
        Vector across = vector_subtract(to_center, vector_scale(along, direction));
        float inside = sphere.radius * sphere.radius - vector_dot(across, across);
        float half = sqrtf(fmaxf(inside, 0));
        float t = along - half > RAY_PART(TNEAR) ? along - half : along + half;
        bool is_hit = (inside >= 0) & (t > RAY_PART(TNEAR)) & (t < RAY_PART(TFAR));
        hit[i] = is_hit ? valid[i] : 0;
        distance[i] = t;
    }
}

static inline __attribute__((always_inline)) void
intersect(const struct RTCIntersectFunctionNArguments *arguments, unsigned count)
{
    const Sphere sphere = ((const Sphere *)arguments->geometryUserPtr)[arguments->primID];
    float *rays = (float *)(void *)arguments->rayhit;
    unsigned *ids = (unsigned *)(void *)arguments->rayhit;
    const unsigned geometry = arguments->geomID, primitive = arguments->primID;
    alignas(64) int hit[LANES] = {0};
    alignas(64) float distance[LANES];
    sphere_hits(sphere, rays, count, arguments->valid, hit, distance);
    if (!lanes_any(hit)) return;
#pragma omp simd
    for (unsigned i = 0; i < count; i++) {
        Vector point = vector_add(RAY_VECTOR(ORG), vector_scale(distance[i], RAY_VECTOR(DIR)));
        Vector normal = hit[i] ? vector_subtract(point, sphere.center) : RAY_VECTOR(NG);
        RAY_PART(TFAR) = hit[i] ? distance[i] : RAY_PART(TFAR);
        RAY_PART(NG) = normal.x;
        RAY_PART(NG + 1) = normal.y;
        RAY_PART(NG + 2) = normal.z;
        ids[GEOM_ID * count + i] = hit[i] ? geometry : ids[GEOM_ID * count + i];
        ids[PRIM_ID * count + i] = hit[i] ? primitive : ids[PRIM_ID * count + i];
    }
}

static inline __attribute__((always_inline)) void
occlude(const struct RTCOccludedFunctionNArguments *arguments, unsigned count)
{
    const Sphere sphere = ((const Sphere *)arguments->geometryUserPtr)[arguments->primID];
    float *rays = (float *)(void *)arguments->ray;
    alignas(64) int hit[LANES];
    alignas(64) float distance[LANES];
    sphere_hits(sphere, rays, count, arguments->valid, hit, distance);
#pragma omp simd
    for (unsigned i = 0; i < count; i++)
        RAY_PART(TFAR) = hit[i] ? -far_away : RAY_PART(TFAR);
}

// Calls a function with the number of rays, as a constant if it is usual, which lets the compiler vectorize.
#define WITH_COUNT(function, arguments)                                                                      \
    ((arguments)->N == LANES       ? function(arguments, LANES)                                              \
     : (arguments)->N == LANES / 2 ? function(arguments, LANES / 2)                                          \
                                   : function(arguments, (arguments)->N))

static void sphere_intersect(const struct RTCIntersectFunctionNArguments *arguments)
{
    WITH_COUNT(intersect, arguments);
}

static void sphere_occlude(const struct RTCOccludedFunctionNArguments *arguments)
{
    WITH_COUNT(occlude, arguments);
}

RTCGeometry spheres_user(RTCDevice device, Sphere *spheres, size_t count)
{
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, (unsigned)count);
    rtcSetGeometryUserData(geometry, spheres);
    rtcSetGeometryBoundsFunction(geometry, sphere_bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, sphere_intersect);
    rtcSetGeometryOccludedFunction(geometry, sphere_occlude);
    return geometry;
}
