#include "spheres.h"

#include "packet.h"
#include <math.h>
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
enum {
    ORG_X,
    ORG_Y,
    ORG_Z,
    TNEAR,
    DIR_X,
    DIR_Y,
    DIR_Z,
    TFAR = 8,
    NG_X = 12,
    NG_Y,
    NG_Z,
    PRIM_ID = 17,
    GEOM_ID
};

// Finds the first hits of `count` rays with unit directions and sets `hit` for the valid rays that have one.
// Uses the ray's point nearest to the center, so that squares of large numbers do not cancel (Haines and
// others, Precision improvements for ray/sphere intersection, Ray Tracing Gems, 2019).
static inline __attribute__((always_inline)) void
sphere_hits(Sphere sphere, const float *rays, unsigned count, const int *valid, int *hit, float *distance)
{
#pragma omp simd
    for (unsigned i = 0; i < count; i++) {
        float x = sphere.center.x - rays[ORG_X * count + i], y = sphere.center.y - rays[ORG_Y * count + i],
              z = sphere.center.z - rays[ORG_Z * count + i];
        float dx = rays[DIR_X * count + i], dy = rays[DIR_Y * count + i], dz = rays[DIR_Z * count + i];
        float along = x * dx + y * dy + z * dz;
        float px = x - along * dx, py = y - along * dy, pz = z - along * dz;
        float inside = sphere.radius * sphere.radius - (px * px + py * py + pz * pz);
        float half = sqrtf(fmaxf(inside, 0));
        float near = along - half, far = along + half, tnear = rays[TNEAR * count + i];
        float t = near > tnear ? near : far;
        bool met = (inside >= 0) & (t > tnear) & (t < rays[TFAR * count + i]);
        hit[i] = met ? valid[i] : 0;
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
        float t = distance[i];
        float x = rays[ORG_X * count + i] + t * rays[DIR_X * count + i] - sphere.center.x;
        float y = rays[ORG_Y * count + i] + t * rays[DIR_Y * count + i] - sphere.center.y;
        float z = rays[ORG_Z * count + i] + t * rays[DIR_Z * count + i] - sphere.center.z;
        rays[TFAR * count + i] = hit[i] ? t : rays[TFAR * count + i];
        ids[GEOM_ID * count + i] = hit[i] ? geometry : ids[GEOM_ID * count + i];
        ids[PRIM_ID * count + i] = hit[i] ? primitive : ids[PRIM_ID * count + i];
        rays[NG_X * count + i] = hit[i] ? x : rays[NG_X * count + i];
        rays[NG_Y * count + i] = hit[i] ? y : rays[NG_Y * count + i];
        rays[NG_Z * count + i] = hit[i] ? z : rays[NG_Z * count + i];
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
        rays[TFAR * count + i] = hit[i] ? -far_away : rays[TFAR * count + i];
}

// A constant count lets the compiler vectorize the loops.
static void sphere_intersect(const struct RTCIntersectFunctionNArguments *arguments)
{
    if (arguments->N == LANES)
        intersect(arguments, LANES);
    else if (arguments->N == LANES / 2)
        intersect(arguments, LANES / 2);
    else
        intersect(arguments, arguments->N);
}

static void sphere_occlude(const struct RTCOccludedFunctionNArguments *arguments)
{
    if (arguments->N == LANES)
        occlude(arguments, LANES);
    else if (arguments->N == LANES / 2)
        occlude(arguments, LANES / 2);
    else
        occlude(arguments, arguments->N);
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
