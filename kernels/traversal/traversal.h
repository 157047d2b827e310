// Finds closest hits and shadows. All queries share one traversal, and with it each shape's test, so that
// they can never disagree.
#ifndef TRAVERSAL_H
#define TRAVERSAL_H

#include "traversal/instance_bvh.h"
#include "traversal/packet.h"
#include "traversal/single.h"
#include "traversal/tile_traversal.h"

// Starts a packet's traversal with what is outside the BVH. `near` has the bits that packets_near returns.
// Returns whether the BVH remains to be traversed.
static inline bool traversal_begin(Traversal *traversal, const Scene *scene, Ray *ray, Query query, uint near)
{
    traversal->query = query;
    traversal->active = ray->active;
    traversal->hit.t = ray->tmax;
    traversal->hit.object = (integer)(-1);
    if (HAS_TRANSMISSION) traversal->optical_depth = (integer)(0);
    if (HAS_FILTERS) traversal->optical_depth_green = traversal->optical_depth_blue = (integer)(0);
    if (HAS_INSTANCES) traversal->within = outside_instances();
    if (IS_CERTIFIED) {
        traversal->hit.low = (real)(LARGEST);                           // of a miss, which is not a rival
        traversal->hit.high = real_min(ray->tmax, (real)(LARGEST / 2)); // below the initial rival
        traversal->rival = (real)(scene->header->sample.y);
        traversal->hit.uncertain = mask_none();
    }
    if (!lanes_any(ray->active)) return false;
    intersect_all_planes(traversal, scene, ray);
    // skipped if the BVH's cull sphere is the only one, since nothing but planes is outside the BVH
    if (near != 0 && scene->header->cull_spheres.x != 1) intersect_outside_bvh(traversal, scene, ray, near);
    if (!HAS_BVH || !lanes_any(traversal->active)) return false;
    global const CullSphere *cull_spheres = ray_cull_spheres(scene, ray);
    return !cull_spheres || lanes_any(ray_hits_cull_sphere(ray, cull_spheres));
}

// Traverses the BVH with `packets`, as bits, for which traversal_begin returned true. Their rays have the
// same common origin, or none. One lane means one packet. At `certified` traversal_classify must follow.
static OUT_OF_LINE void packets_traverse_bvh(Traversal *traversals, const Scene *scene, Ray *rays,
                                             uint packets)
{
#if LANES == 1
    if (packets) traverse_bvh(traversals, scene, rays); // Mesa 22.3 crashes in compiling a loop for it
#else
    if (HAS_BVH && (packets & (packets - 1)) != 0 &&
        rays[lowest_bit(packets)].common_origin != COMMON_ORIGIN_NONE)
        packets = traverse_bvh_by_tile(traversals, scene, rays, packets);
    for (; HAS_BVH && packets != 0; packets &= packets - 1) {
        uint i = lowest_bit(packets);
        traverse_bvh(&traversals[i], scene, &rays[i]);
    }
#endif
}

// Traces one packet.
static OUT_OF_LINE void ray_traverse(Traversal *traversal, const Scene *scene, Ray *ray, Query query)
{
    if (traversal_begin(traversal, scene, ray, query, ~0u)) packets_traverse_bvh(traversal, scene, ray, 1);
    if (IS_CERTIFIED) traversal_classify(traversal);
}

static inline Hit closest_hit(const Scene *scene, Ray *ray)
{
    Traversal traversal;
    ray_traverse(&traversal, scene, ray, CLOSEST_HIT);
    return traversal.hit;
}

static inline Hit closest_opaque_hit(const Scene *scene, Ray *ray)
{
    Traversal traversal;
    ray_traverse(&traversal, scene, ray, CLOSEST_OPAQUE_HIT);
    return traversal.hit;
}

// Returns the fraction of light that passes an optical depth.
static inline real depth_transmittance(integer optical_depth)
{
    const real ln2_of_step = (real)(-LN_2 / OPTICAL_DEPTH_STEPS);
    real passed = real_exp_negative(real_from_integer(optical_depth) * ln2_of_step);
    if (!HAS_FILTERS) return passed;
    // a channel may be occluded where others pass
    return lanes_select(optical_depth < (integer)(OPTICAL_DEPTH_MAX), passed, (real)(0));
}

// Returns the fraction of each channel's light that passes, after a traversal for OCCLUSION.
static inline Vector traversal_filter(const Traversal *traversal)
{
    const Vector none = {(real)(0), (real)(0), (real)(0)};
    Vector passed = {depth_transmittance(traversal->optical_depth),
                     depth_transmittance(traversal->optical_depth_green),
                     depth_transmittance(traversal->optical_depth_blue)};
    return vector_select(traversal->active, passed, none);
}

// Returns the fraction of light that passes in the largest channel, after a traversal for OCCLUSION. It is 1
// if nothing occludes the light and 0 behind an opaque object. Each transparent object transmits its
// fraction, without bending the ray.
static inline real traversal_transmittance(const Traversal *traversal)
{
    const real none = (real)(0), all = (real)(1);
    if (!HAS_TRANSMISSION) return lanes_select(traversal->active, all, none);
    if (HAS_FILTERS) {
        Vector passed = traversal_filter(traversal);
        return real_max_of_3(passed.x, passed.y, passed.z);
    }
    return lanes_select(traversal->active, depth_transmittance(traversal->optical_depth), none);
}

// Returns the fraction of light that passes along each active ray between tmin and tmax.
static inline real transmittance(const Scene *scene, Ray *ray)
{
    Traversal traversal;
    ray_traverse(&traversal, scene, ray, OCCLUSION);
    return traversal_transmittance(&traversal);
}

#endif
