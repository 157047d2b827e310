// Culls bounding spheres conservatively, for packets with a common origin.
#ifndef CULL_SPHERE_H
#define CULL_SPHERE_H

#include "scene.h"
#include "traversal/ray.h"

// Returns the lanes whose rays may hit what is inside the sphere. A line along d through a common origin
// misses a sphere around v, seen from there, if (v . d)^2 < p d^2 for the origin's power p = v^2 - r^2, which
// is lowered by 256 u v^2, on the host, and here by 128 u d^2, the ray's cull slack. A shadow ray's |d| is
// the distance to the light; rays from the eye start there and need only the former. For the shape's error
// and a shadow ray's line, which misses the origin by up to u |d|, the sphere is enlarged by 64 u (|v| +
// |d|), which lowers p by at most 192 u v^2 + 64 u d^2. Roundings take 16 u v^2 + 2 u d^2.
static inline mask ray_hits_cull_sphere(const Ray *ray, global const CullSphere *sphere)
{
    global const scalar *center_power = (global const scalar *)sphere;
    real along = real_fma(
        (real)(center_power[0]), ray->direction.x,
        real_fma((real)(center_power[1]), ray->direction.y, (real)(center_power[2]) * ray->direction.z));
    real power = (real)(center_power[3]) - ray_cull_slack(ray);
    return RAY_ACTIVE(ray) & !(along * along < ray->squared * power);
}

// Returns the row of cull spheres of the ray's common origin, or 0 if it has none. The BVH's sphere is
// first, followed by those of the primitives outside it.
static inline global const CullSphere *ray_cull_spheres(const Scene *scene, const Ray *ray)
{
    uint count = scene->header->cull_spheres.x;
    if (ray->common_origin == COMMON_ORIGIN_NONE || count == 0) return 0;
    return scene->cull_spheres + (size_t)(ray->common_origin - COMMON_ORIGIN_EYE) * count;
}

// Bounds of the unit directions in which rays are seen from their common origin. If directions x lie within h
// of c in each component, v . x <= m = v . c + |v| . h, |v| by components, and no ray hits a sphere where
// max(m, 0)^2 < p - 128 u D^2 for the longest shadow ray's length D.
typedef struct {
    scalar4 center, reach; // per component
    scalar slack;          // the largest cull slack
} DirectionBounds;

// Exceeds the error of inverse_root_estimate, 2^-14, and all roundings here and in
// directions_hit_cull_spheres, 20 u.
#define DIRECTION_REACH_SLACK ((scalar)(0x1p-13f))

// Bounds the active rays of `packets`, given as bits. Returns false if a length is too small to square.
static inline bool rays_bound_directions(const Ray *rays, uint packets, DirectionBounds *bounds)
{
    const Ray *first = &rays[lowest_bit(packets)];
    LaneMinima minima;
#pragma unroll
    for (uint i = 0; i < MINIMA_COUNT; i++)
        minima.all[i] = (real)(LARGEST);
// other packets count as the first one, because branches would keep the bounds out of registers
#pragma unroll
    for (uint packet = 0; packet < PACKETS; packet++) {
        const Ray *ray = packets >> packet & 1 ? &rays[packet] : first;
        const mask active = RAY_ACTIVE(ray);
        const real squared = real_max(ray->squared, (real)(SMALLEST_RATIO));
        const Vector unit = vector_scale(ray->direction, inverse_root_estimate(squared));
        const real values[MINIMA_COUNT] = {unit.x, -unit.x, unit.y,  -unit.y,
                                           unit.z, -unit.z, squared, -ray_cull_slack(ray)};
#pragma unroll
        for (uint i = 0; i < MINIMA_COUNT; i++)
            minima.all[i] = lanes_select(active, real_min(values[i], minima.all[i]), minima.all[i]);
    }
    lane_minima_reduce(&minima);
    const scalar *least = minima.each;
    const scalar side = first->common_origin == COMMON_ORIGIN_EYE ? 0.5f : -0.5f; // rays to a light end there
    bounds->center = (scalar4)(least[0] - least[1], least[2] - least[3], least[4] - least[5], 0) * side;
    bounds->reach =
        (scalar4)(-least[0] - least[1], -least[2] - least[3], -least[4] - least[5], 0) * fabs(side) +
        DIRECTION_REACH_SLACK;
    bounds->slack = -least[7];
    return least[6] > SMALLEST_RATIO;
}

// Returns which of the next LANES spheres, as bits, any ray may intersect.
static inline uint directions_hit_cull_spheres(const DirectionBounds *bounds,
                                               global const CullSphere *spheres)
{
    RealLanes x, y, z, power;
    for (uint lane = 0; lane < LANES; lane++) {
        global const scalar *center_power = (global const scalar *)&spheres[lane];
        x.each[lane] = center_power[0];
        y.each[lane] = center_power[1];
        z.each[lane] = center_power[2];
        power.each[lane] = center_power[3];
    }
    const Vector v = {x.all, y.all, z.all}, size = {fabs(x.all), fabs(y.all), fabs(z.all)};
    real along = vector_dot(v, vector_of(bounds->center)) + vector_dot(size, vector_of(bounds->reach));
    along = real_max(along, (real)(0)); // no ray runs behind the origin
    return lanes_bits(!(along * along < power.all - (real)(bounds->slack)));
}

// Without a BVH and bounces, several packets are culled at once. With few spheres each packet's own test is
// faster, and more than GROUP_CULLS_MAX do not fit the bits.
#define HAS_GROUP_CULLS (PACKETS > 1 && !HAS_BVH)
enum { GROUP_CULLS_MIN = 4, GROUP_CULLS_MAX = 32 };

// Returns which primitives with cull spheres any active ray of `packets` may hit. Both are bits; bits beyond
// the last primitive are undefined. If there are more than 32 primitives, all bits are set.
static inline uint packets_near(const Scene *scene, const Ray *rays, uint packets)
{
    const uint count = scene->header->cull_spheres.x; // including the BVH's
    DirectionBounds bounds;
    if (!HAS_GROUP_CULLS || packets == 0 || count <= GROUP_CULLS_MIN || count > 1 + GROUP_CULLS_MAX)
        return ~0u;
    global const CullSphere *spheres = ray_cull_spheres(scene, &rays[lowest_bit(packets)]);
    if (!spheres || !rays_bound_directions(rays, packets, &bounds)) return ~0u;
    uint near = 0;
    for (uint i = 0; i + 1 < count; i += LANES)
        near |= directions_hit_cull_spheres(&bounds, spheres + 1 + i) << i;
    return near;
}

#endif
