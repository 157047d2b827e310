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

// Where the rays, whose directions are unit, meet the sphere first; `hit` tells which of the valid rays do.
// From the ray's point that is nearest to the center, so that squares of large numbers do not cancel (Haines
// and others, Precision improvements for ray/sphere intersection, Ray Tracing Gems, 2019).
static inline void sphere_meet(Sphere sphere, const struct RTCRay16 *ray, const int *valid, int *hit,
                               float *distance)
{
    FOR_LANES
    {
        float x = sphere.center.x - ray->org_x[i], y = sphere.center.y - ray->org_y[i],
              z = sphere.center.z - ray->org_z[i];
        float dx = ray->dir_x[i], dy = ray->dir_y[i], dz = ray->dir_z[i];
        float along = x * dx + y * dy + z * dz;
        float px = x - along * dx, py = y - along * dy, pz = z - along * dz;
        float inside = sphere.radius * sphere.radius - (px * px + py * py + pz * pz);
        float half = sqrtf(fmaxf(inside, 0));
        float near = along - half, far = along + half;
        float t = near > ray->tnear[i] ? near : far;
        bool met = (inside >= 0) & (t > ray->tnear[i]) & (t < ray->tfar[i]);
        hit[i] = met ? valid[i] : 0;
        distance[i] = t;
    }
}

static void sphere_intersect(const struct RTCIntersectFunctionNArguments *arguments)
{
    const Sphere sphere = ((const Sphere *)arguments->geometryUserPtr)[arguments->primID];
    struct RTCRayHit16 *rays = (struct RTCRayHit16 *)arguments->rayhit;
    const unsigned geometry = arguments->geomID, primitive = arguments->primID;
    alignas(64) int hit[LANES];
    alignas(64) float distance[LANES];
    sphere_meet(sphere, &rays->ray, arguments->valid, hit, distance);
    if (!lanes_any(hit)) return;
    FOR_LANES
    {
        float t = distance[i];
        float x = rays->ray.org_x[i] + t * rays->ray.dir_x[i] - sphere.center.x;
        float y = rays->ray.org_y[i] + t * rays->ray.dir_y[i] - sphere.center.y;
        float z = rays->ray.org_z[i] + t * rays->ray.dir_z[i] - sphere.center.z;
        rays->ray.tfar[i] = hit[i] ? t : rays->ray.tfar[i];
        rays->hit.geomID[i] = hit[i] ? geometry : rays->hit.geomID[i];
        rays->hit.primID[i] = hit[i] ? primitive : rays->hit.primID[i];
        rays->hit.Ng_x[i] = hit[i] ? x : rays->hit.Ng_x[i];
        rays->hit.Ng_y[i] = hit[i] ? y : rays->hit.Ng_y[i];
        rays->hit.Ng_z[i] = hit[i] ? z : rays->hit.Ng_z[i];
    }
}

static void sphere_occlude(const struct RTCOccludedFunctionNArguments *arguments)
{
    const Sphere sphere = ((const Sphere *)arguments->geometryUserPtr)[arguments->primID];
    struct RTCRay16 *rays = (struct RTCRay16 *)arguments->ray;
    alignas(64) int hit[LANES];
    alignas(64) float distance[LANES];
    sphere_meet(sphere, rays, arguments->valid, hit, distance);
    FOR_LANES rays->tfar[i] = hit[i] ? -far_away : rays->tfar[i];
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
