// Tests blocks of spheres against the packets of a macro-tile, before the full test (shapes/sphere.h).
//
// A block's spheres are set up in the frame of the common origin, one per lane. Then each packet runs the
// shorter of two loops: over its rays, with one sphere per lane, or over the spheres, with one ray per lane.
// A ray misses a sphere if its line's distance from the center exceeds the radius enlarged by all errors. The
// origin's power cannot decide that, because it is rounded by more than a small sphere's squared radius. Only
// the remaining spheres take the full test.
//
// With the center C, the radius r, the longest shadow ray's length D (0 for rays from the eye) and the unit
// roundoff u, the enlargement is 64 u (|C|_1 + r + D). The full test needs 14 u (|C| + D) + 5 u r, since
// l = f - (b / a) d is off by 14 u |f|, and a discriminant by up to 10 u r^2. The line, which misses the
// origin, and its slopes need 7 u D + 24 u |C|, C minus the origin and its slopes, at most 16, 6 u |C|, and
// the comparison 38 u r. At `certified` the enlargement is above six times the error of the exact ray and 66
// u of the distance.
#ifndef SPHERE_BLOCK_H
#define SPHERE_BLOCK_H

#include "traversal/macro_tile.h"
#include "traversal/primitives.h"

#if LANES > 1

// The enlargement of a sphere, in u of the distances.
enum { SPHERE_BLOCK_ERROR = 64 };

// The spheres of a block as seen from the common origin, one per lane.
typedef struct {
    SeenRectangles seen;
    Vector center; // in the scene's coordinates
    real radius;
    RealLanes u, v; // slopes of the center
    RealLanes size; // the enlarged radius over the center's w, squared
} SphereView;

// Sets the view. Returns those of the first `count` spheres, as bits, that the macro-tile may hit.
static inline uint spheres_see(SphereView *view, const MacroTile *tile, global const SphereBlock *block,
                               uint count)
{
    const OriginFrame *frame = &tile->frame;
    const Vector from = vector_subtract(frame_load(frame, block_row(block, 0)), frame_origin(frame));
    const real radius = real_load(block_row(block, 3)), slack = (real)(tile->slack);
    view->center = block_centers(block);
    view->radius = radius;
    view->seen.w.all = from.z - radius - slack;
    const real size = vector_norm1(from) + radius;
    // too close to the common origin for the slopes to be bounded
    const mask anywhere = !(16 * from.z > size);
    const real inverse =
        lanes_select(anywhere, (real)(0), reciprocal_estimate(lanes_select(anywhere, (real)(1), from.z)));
    const real distance = size + (real)(frame->leaving ? 0 : tile->tile_reach_max * tile->ray_per_w);
    real error = distance * (SPHERE_BLOCK_ERROR * UNIT_ROUNDOFF);
    if (IS_CERTIFIED) error = tile_point_error(tile, distance);
    const real enlarged = (radius + error) * inverse, u = from.x * inverse, v = from.y * inverse;
    const real reach = lanes_select(anywhere, (real)(LARGEST), enlarged * (real)(tile->ray_per_w));
    view->u.all = u;
    view->v.all = v;
    view->size.all = lanes_select(anywhere, (real)(LARGEST), enlarged * enlarged);
    view->seen.u_min.all = u - reach;
    view->seen.u_max.all = u + reach;
    view->seen.v_min.all = v - reach;
    view->seen.v_max.all = v + reach;
    return tile_sees(tile, &view->seen, from.z + radius + slack) & ((1u << count) - 1);
}

// Returns whether lines of slopes u and v pass centers within the radius whose square over w is `size`.
static inline mask line_hits_sphere(real u, real v, real center_u, real center_v, real size)
{
    const real du = u - center_u, dv = v - center_v, turn = real_fma(du, v, -(dv * u));
    return real_fma(du, du, real_fma(dv, dv, turn * turn)) <=
           size * real_fma(u, u, real_fma(v, v, (real)(1)));
}

// Returns the spheres, of those given as bits, whose full test a packet needs. Loops over the rays, with one
// sphere per lane.
static inline ALWAYS_INLINE uint spheres_test_rays(const MacroTile *tile, const SphereView *view, uint packet,
                                                   uint rays, uint spheres, bool is_shadow)
{
    uint remaining = 0;
    const Ray *ray = &tile->rays[packet];
    for (; rays != 0; rays &= rays - 1) {
        const uint lane = lowest_bit(rays);
        const real u = real_of_lane(&tile->u[packet], lane), v = real_of_lane(&tile->v[packet], lane);
        mask perhaps = line_hits_sphere(u, v, view->u.all, view->v.all, view->size.all) &
                       (view->seen.w.all <= real_of_lane(&tile->reach[packet], lane));
        if (is_shadow && !IS_CERTIFIED)
            perhaps = perhaps &
                      !ray_leaves_sphere(vector_subtract(vector_of_lane(&ray->origin, lane), view->center),
                                         vector_of_lane(&ray->direction, lane),
                                         real_of_lane(&ray->tmin, lane), view->radius);
        remaining |= lanes_bits(perhaps);
    }
    return remaining & spheres;
}

// Returns the spheres whose full test a packet needs. Loops over the spheres, with one ray per lane.
static inline ALWAYS_INLINE uint spheres_test_each(const MacroTile *tile, const SphereView *view, uint packet,
                                                   uint spheres, bool is_shadow)
{
    uint remaining = 0;
    const Ray *ray = &tile->rays[packet];
    const real u = tile->u[packet], v = tile->v[packet], reach = tile->reach[packet];
    for (; spheres != 0; spheres &= spheres - 1) {
        const uint lane = lowest_bit(spheres);
        mask perhaps = line_hits_sphere(u, v, (real)(view->u.each[lane]), (real)(view->v.each[lane]),
                                        (real)(view->size.each[lane])) &
                       ((real)(view->seen.w.each[lane]) <= reach);
        if (is_shadow && !IS_CERTIFIED)
            perhaps = perhaps &
                      !ray_leaves_sphere(vector_subtract(ray->origin, vector_of_lane(&view->center, lane)),
                                         ray->direction, ray->tmin, real_of_lane(&view->radius, lane));
        if (lanes_any(perhaps)) remaining |= 1u << lane;
    }
    return remaining;
}

// Intersects the spheres of a block with the entry's packets.
static inline ALWAYS_INLINE void tile_visit_spheres(MacroTile *tile, const Scene *scene,
                                                    const TileEntry *leaf, bool is_shadow)
{
    if (tile->has_shrunk) tile_bound_reach(tile);
    SphereView view;
    global const SphereBlock *block = &scene->sphere_blocks[leaf->index];
    const uint spheres = spheres_see(&view, tile, block, leaf_count(leaf->type));
    if (spheres == 0) return;
    for (uint packets = leaf->packets; packets != 0; packets &= packets - 1) {
        const uint packet = lowest_bit(packets);
        const uint near = spheres & lanes_bits(packet_sees(tile, packet, &view.seen));
        if (near == 0) continue;
        const uint rays = rays_within(tile, packet, &leaf->seen);
        const uint left = popcount(rays) <= popcount(near)
                              ? spheres_test_rays(tile, &view, packet, rays, near, is_shadow)
                              : spheres_test_each(tile, &view, packet, near, is_shadow);
        if (left == 0) continue;
        tile_prepare(tile, packet);
        if (intersect_block_spheres(&tile->traversals[packet], scene, &tile->rays[packet], block, left))
            tile_update(tile, packet);
    }
}

#endif

#endif
