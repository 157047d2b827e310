// Macro-tile traversal of the BVH: several packets at once, whose rays pass through a common origin.
//
// In the frame of the common origin, one coordinate axis is w and the other two are u and v. A ray there is a
// point (u / w, v / w), a packet a rectangle of such points, and a box seen from the origin is a rectangle as
// well. The children of a node are culled all at once, a lane per child, against the macro-tile's rectangle,
// and where its packets are few, against each one's; else the packets of each child that is left all at once,
// a lane per packet. The rays of each packet that is left are culled all at once, a lane per ray. Packets are
// frusta on a plane across the main axis in Wald, Ize, Kensler, Knoll, Parker, Ray tracing animated scenes
// using coherent grid traversal, SIGGRAPH 2006, and culled in groups in Reshetov, Soupikov, Hurley,
// Multi-level ray tracing algorithm, SIGGRAPH 2005; neither tests lanes of three kinds.
#ifndef MACRO_TILE_H
#define MACRO_TILE_H

#include "traversal/boxes.h"
#include "traversal/primitives.h"
#include "traversal/stack.h"

#if LANES > 1

// Packets with a larger slope in the frame take packet traversal.
#define SLOPE_MAX ((real)(4))
// Slopes below this count as it.
#define SLOPE_MIN (UNIT_ROUNDOFF * UNIT_ROUNDOFF)

// Bounds of rounding, in u, derived in docs/numerics.md. Of slopes: a box's, relative to itself, and a ray's,
// relative to 1. Of positions: what boxes are enlarged by beyond their slack, in the coordinates.
enum { BOX_SLOPE_SLACK = 32, RAY_SLOPE_SLACK = 64, TILE_POSITION_SLACK = 64 };

// The frame of a common origin. Rays are seen as leaving it, whichever way they run; they leave along
// positive w.
typedef struct {
    uint u_axis, v_axis, w_axis;
    bool leaving;   // rays start at the origin; else they end there
    bool reversed;  // w runs against its axis
    scalar u, v, w; // of the origin, on the scene's axes
} OriginFrame;

typedef struct {
    Traversal *traversals; // of each packet, as the rays
    Ray *rays;
    OriginFrame frame;
    uint active;     // packets that still traverse, as bits
    uint unprepared; // packets whose rays ray_prepare has yet to see, as bits
    real slack;      // by which boxes are enlarged: for each lane's rays, from macro_tile_bound on for all
    // of each packet's rays: w per u and per v, w per t, and the w up to which they are traversed, -LARGEST
    // in lanes that are done
    real w_per_u[LANES], w_per_v[LANES], w_per_t[LANES], reach[LANES];
    // bounds of these over each packet, a lane per packet
    RealLanes u_min, u_max, v_min, v_max, reach_max;
    // bounds over all packets
    scalar tile_u_min, tile_u_max, tile_v_min, tile_v_max, tile_reach_max;
    bool has_shrunk; // by a hit since tile_reach_max was set
} MacroTile;

static inline real vector_along(Vector vector, uint axis)
{
    return axis == 0 ? vector.x : axis == 1 ? vector.y : vector.z;
}

static inline scalar scalar4_along(scalar4 vector, uint axis)
{
    return axis == 0 ? vector.x : axis == 1 ? vector.y : vector.z;
}

// The frame whose w axis is the main one of the packet's first active ray.
static inline OriginFrame origin_frame(const Scene *scene, const Ray *ray, mask active)
{
    OriginFrame frame;
    frame.leaving = ray->common_origin == COMMON_ORIGIN_EYE;
    RealLanes x = {ray->direction.x}, y = {ray->direction.y}, z = {ray->direction.z};
    uint lane = lowest_bit(lanes_bits(active));
    scalar4 direction = (scalar4)(x.each[lane], y.each[lane], z.each[lane], 0), size = fabs(direction);
    frame.w_axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    frame.u_axis = frame.w_axis == 0 ? 1 : 0;
    frame.v_axis = frame.w_axis == 2 ? 1 : 2;
    frame.reversed = scalar4_along(direction, frame.w_axis) < 0 ? frame.leaving : !frame.leaving;
    scalar4 origin = scene->header->eye;
    if (!frame.leaving) origin = scene->lights[ray->common_origin - COMMON_ORIGIN_FIRST_LIGHT].position;
    frame.u = scalar4_along(origin, frame.u_axis);
    frame.v = scalar4_along(origin, frame.v_axis);
    frame.w = scalar4_along(origin, frame.w_axis);
    return frame;
}

static inline void macro_tile_set_reach(MacroTile *tile, uint packet)
{
    const Traversal *traversal = &tile->traversals[packet];
    real t = (real)(1 + 16 * UNIT_ROUNDOFF);
    real limit = IS_CERTIFIED ? traversal->hit.high : traversal->hit.t;
    if (tile->frame.leaving) t = t * real_min(limit, (real)(LARGEST / 2));
    real reach = lanes_select(traversal->active, t * tile->w_per_t[packet], (real)(-LARGEST));
    tile->reach[packet] = reach;
    tile->reach_max.each[packet] = lanes_largest(traversal->active, reach);
}

// Huge for 0, so that its product with a distance keeps the sign.
static inline real slope_inverse(real slope)
{
    const real least = (real)(SLOPE_MIN);
    return reciprocal_estimate(lanes_select(fabs(slope) >= least, slope, least));
}

// Adds a packet with active rays, unless one of its slopes is too large.
static inline void macro_tile_add(MacroTile *tile, const Scene *scene, uint packet)
{
    const OriginFrame *frame = &tile->frame;
    const Ray *ray = &tile->rays[packet];
    const real zero = (real)(0), none = (real)(LARGEST), away = (real)(frame->leaving ? 1 : -1);
    mask active = tile->traversals[packet].active;
    real w = vector_along(ray->direction, frame->w_axis) * (frame->reversed ? -away : away);
    real u = vector_along(ray->direction, frame->u_axis) * away;
    real v = vector_along(ray->direction, frame->v_axis) * away;
    mask steep = (w <= zero) | (fabs(u) > SLOPE_MAX * w) | (fabs(v) > SLOPE_MAX * w);
    if (lanes_any(active & steep)) return;
    real inverse = reciprocal_estimate(lanes_select(active, w, (real)(1)));
    u = u * inverse;
    v = v * inverse;
    tile->w_per_u[packet] = slope_inverse(u);
    tile->w_per_v[packet] = slope_inverse(v);
    tile->w_per_t[packet] = w;
    LaneMinima minima;
    minima.all[0] = lanes_select(active, u, none);
    minima.all[1] = lanes_select(active, -u, none);
    minima.all[2] = lanes_select(active, v, none);
    minima.all[3] = lanes_select(active, -v, none);
    for (uint i = 4; i < MINIMA_COUNT; i++)
        minima.all[i] = none;
    lane_minima_reduce(&minima);
    tile->u_min.each[packet] = minima.each[0];
    tile->u_max.each[packet] = -minima.each[1];
    tile->v_min.each[packet] = minima.each[2];
    tile->v_max.each[packet] = -minima.each[3];
    // the origin counts, too: a shadow ray's line misses the light by u of all of the ray
    real max_norm1 = bounds_max_norm1(ray->origin, scene->header->bounds);
    real slack = real_fma((real)(TILE_POSITION_SLACK * UNIT_ROUNDOFF), max_norm1,
                          box_slack(ray, scene->header->bounds));
    tile->slack = real_max(tile->slack, lanes_select(active, slack, zero));
    tile->active |= 1u << packet;
    macro_tile_set_reach(tile, packet);
}

static inline void macro_tile_bound_reach(MacroTile *tile)
{
    tile->tile_reach_max = lanes_largest(mask_of_bits(tile->active), tile->reach_max.all);
    tile->has_shrunk = false;
}

static inline void macro_tile_bound(MacroTile *tile)
{
    const OriginFrame *frame = &tile->frame;
    scalar origin_slack =
        TILE_POSITION_SLACK * UNIT_ROUNDOFF * (fabs(frame->u) + fabs(frame->v) + fabs(frame->w));
    tile->slack = (real)(lanes_largest(mask_all(), tile->slack) + origin_slack);
    mask members = mask_of_bits(tile->active);
    tile->tile_u_min = -lanes_largest(members, -tile->u_min.all);
    tile->tile_u_max = lanes_largest(members, tile->u_max.all);
    tile->tile_v_min = -lanes_largest(members, -tile->v_min.all);
    tile->tile_v_max = lanes_largest(members, tile->v_max.all);
    macro_tile_bound_reach(tile);
}

// A node's boxes in the frame, a lane per child, and as seen from the origin: rectangles of slopes.
typedef struct {
    RealLanes u_low, u_high, v_low, v_high, w_low, w_high;
    RealLanes u_min, u_max, v_min, v_max;
} ProjectedBoxes;

static inline real box_slope_min(real a, real b)
{
    real least = real_min(a, b);
    return real_fma(fabs(least), (real)(-BOX_SLOPE_SLACK * UNIT_ROUNDOFF), least) -
           (real)(RAY_SLOPE_SLACK * UNIT_ROUNDOFF);
}

static inline ProjectedBoxes project_boxes(const MacroTile *tile, global const scalar *boxes)
{
    const OriginFrame *frame = &tile->frame;
    global const scalar *low = boxes + BVH_LOW * BVH_WIDTH, *high = boxes + BVH_HIGH * BVH_WIDTH;
    const real slack = tile->slack;
    real w_low = real_load(low + frame->w_axis * BVH_WIDTH) - (real)(frame->w);
    real w_high = real_load(high + frame->w_axis * BVH_WIDTH) - (real)(frame->w);
    real w_min = (frame->reversed ? -w_high : w_low) - slack,
         w_max = (frame->reversed ? -w_low : w_high) + slack;
    real u_low = real_load(low + frame->u_axis * BVH_WIDTH) - (real)(frame->u) - slack;
    real u_high = real_load(high + frame->u_axis * BVH_WIDTH) - (real)(frame->u) + slack;
    real v_low = real_load(low + frame->v_axis * BVH_WIDTH) - (real)(frame->v) - slack;
    real v_high = real_load(high + frame->v_axis * BVH_WIDTH) - (real)(frame->v) + slack;
    // a box that reaches back to the origin may be seen anywhere
    mask around = w_min <= slack;
    real near_inverse = reciprocal_estimate(lanes_select(around, slack, w_min));
    real far_inverse = reciprocal_estimate(lanes_select(w_max > slack, w_max, slack));
    const real anywhere = (real)(LARGEST);
    ProjectedBoxes projected;
    projected.u_min.all =
        lanes_select(around, -anywhere, box_slope_min(u_low * near_inverse, u_low * far_inverse));
    projected.u_max.all =
        lanes_select(around, anywhere, -box_slope_min(-u_high * near_inverse, -u_high * far_inverse));
    projected.v_min.all =
        lanes_select(around, -anywhere, box_slope_min(v_low * near_inverse, v_low * far_inverse));
    projected.v_max.all =
        lanes_select(around, anywhere, -box_slope_min(-v_high * near_inverse, -v_high * far_inverse));
    projected.u_low.all = u_low;
    projected.u_high.all = u_high;
    projected.v_low.all = v_low;
    projected.v_high.all = v_high;
    projected.w_low.all = w_min;
    projected.w_high.all = w_max;
    return projected;
}

// Whether any ray of a packet meets a child's box.
static inline bool rays_meet_child(const MacroTile *tile, uint packet, const ProjectedBoxes *boxes,
                                   uint child)
{
    real w_per_u = tile->w_per_u[packet], w_per_v = tile->w_per_v[packet];
    real u_low = (real)(boxes->u_low.each[child]) * w_per_u,
         u_high = (real)(boxes->u_high.each[child]) * w_per_u;
    real v_low = (real)(boxes->v_low.each[child]) * w_per_v,
         v_high = (real)(boxes->v_high.each[child]) * w_per_v;
    real entry = real_max(real_max(real_min(u_low, u_high), real_min(v_low, v_high)),
                          (real)(boxes->w_low.each[child]));
    real exit = real_min(real_min(real_max(u_low, u_high), real_max(v_low, v_high)),
                         real_min((real)(boxes->w_high.each[child]), tile->reach[packet]));
    return lanes_any(entry <= exit);
}

// The packets, of those given, whose rectangle overlaps that of a child's box, a lane per packet.
static inline uint packets_overlap_child(const MacroTile *tile, const ProjectedBoxes *boxes, uint child,
                                         uint packets)
{
    return packets & lanes_bits(((real)(boxes->u_min.each[child]) <= tile->u_max.all) &
                                (tile->u_min.all <= (real)(boxes->u_max.each[child])) &
                                ((real)(boxes->v_min.each[child]) <= tile->v_max.all) &
                                (tile->v_min.all <= (real)(boxes->v_max.each[child])) &
                                ((real)(boxes->w_low.each[child]) <= tile->reach_max.all));
}

// The same of all children, a lane per child: for each the packets, as bits.
static inline integer packets_overlap_children(const MacroTile *tile, const ProjectedBoxes *boxes,
                                               uint packets)
{
    integer overlapping = (integer)(0);
    for (; packets != 0; packets &= packets - 1) {
        uint packet = lowest_bit(packets);
        mask overlaps = (boxes->u_min.all <= (real)(tile->u_max.each[packet])) &
                        ((real)(tile->u_min.each[packet]) <= boxes->u_max.all) &
                        (boxes->v_min.all <= (real)(tile->v_max.each[packet])) &
                        ((real)(tile->v_min.each[packet]) <= boxes->v_max.all) &
                        (boxes->w_low.all <= (real)(tile->reach_max.each[packet]));
        integer with_packet = overlapping | (integer)((scalar_integer)1 << packet);
        overlapping = lanes_select(overlaps, with_packet, overlapping);
    }
    return overlapping;
}

// Intersects the primitives of a leaf with the rays of packets.
static inline void tile_intersect_leaf(MacroTile *tile, const Scene *scene, uint kind, uint first,
                                       uint packets)
{
    for (; packets != 0; packets &= packets - 1) {
        uint packet = lowest_bit(packets), bit = 1u << packet;
        if (tile->unprepared & bit) ray_prepare(&tile->rays[packet]);
        tile->unprepared &= ~bit;
        Traversal *traversal = &tile->traversals[packet];
        if (!intersect_leaf(traversal, scene, &tile->rays[packet], kind, first)) continue;
        const scalar before = tile->reach_max.each[packet];
        macro_tile_set_reach(tile, packet);
        tile->has_shrunk = tile->has_shrunk || tile->reach_max.each[packet] < before;
        if (!lanes_any(traversal->active)) tile->active &= ~bit;
    }
}

// Intersects what is in the leaves among a node's children that any of the packets may meet, and pushes the
// other children. Bounds of the reach may be too large after a leaf's hits, which costs tests alone.
static inline void tile_visit_node(MacroTile *tile, TraversalStack *stack, const Scene *scene,
                                   global const BvhNode *node, uint packets)
{
    const uint bottom = stack->count;
    if (tile->has_shrunk) macro_tile_bound_reach(tile);
    ProjectedBoxes projected = project_boxes(tile, (global const scalar *)node->planes);
    uint children = lanes_bits((projected.u_min.all <= (real)(tile->tile_u_max)) &
                               ((real)(tile->tile_u_min) <= projected.u_max.all) &
                               (projected.v_min.all <= (real)(tile->tile_v_max)) &
                               ((real)(tile->tile_v_min) <= projected.v_max.all) &
                               (projected.w_low.all <= (real)(tile->tile_reach_max)) &
                               (projected.w_high.all >= (real)(0)));
    const bool by_packet = popcount(packets) < popcount(children); // the shorter loop runs
    IntegerLanes overlapping;
    if (by_packet) {
        overlapping.all = packets_overlap_children(tile, &projected, packets);
        children &= lanes_bits(overlapping.all != (integer)(0));
    }
    for (; children != 0; children &= children - 1) {
        uint child = lowest_bit(children);
        uint kind = ((global const uint *)node->child_kind)[child];
        uint met = by_packet ? (uint)overlapping.each[child] & tile->active
                             : packets_overlap_child(tile, &projected, child, packets);
        // a sphere's first test costs no more than that of its box
        const bool has_spheres = HAS_SPHERES && kind >> 8 > 0 && (kind & 0xff) == KIND_SPHERES;
        for (uint left = has_spheres ? 0 : met; left != 0; left &= left - 1) {
            uint packet = lowest_bit(left);
            if (!rays_meet_child(tile, packet, &projected, child)) met &= ~(1u << packet);
        }
        if (met == 0) continue;
        uint index = ((global const uint *)node->child_index)[child];
        if (kind == BVH_NODE) {
            stack_push_node(stack, bottom, scene, (StackEntry){index, met, projected.w_low.each[child]});
            continue;
        }
        tile_intersect_leaf(tile, scene, kind, index, met);
        if (tile->active == 0) return;
    }
}

// Traverses the BVH with those of the packets, given as bits, that the common origin's frame suits. All have
// active rays. Returns the others.
static inline uint traverse_bvh_by_tile(Traversal *traversals, const Scene *scene, Ray *rays, uint packets)
{
    MacroTile tile;
    tile.traversals = traversals;
    tile.rays = rays;
    tile.active = 0;
    tile.frame = origin_frame(scene, &rays[lowest_bit(packets)], traversals[lowest_bit(packets)].active);
    tile.slack = (real)(SMALLEST_RATIO);
    tile.u_min.all = tile.u_max.all = tile.v_min.all = tile.v_max.all = tile.reach_max.all = (real)(0);
    for (uint left = packets; left != 0; left &= left - 1)
        macro_tile_add(&tile, scene, lowest_bit(left));
    const uint others = packets & ~tile.active;
    if (tile.active == 0) return others;
    tile.unprepared = tile.active;
    macro_tile_bound(&tile);
    StackEntry entries[STACK_CAPACITY], next = {0, tile.active, -LARGEST};
    // entry distances are from the common origin: nearest the light is farthest from the surface
    TraversalStack stack = {entries, 0, false};
    for (;; next = entries[--stack.count]) {
        uint met = next.lanes & tile.active & lanes_bits((real)(next.entry) <= tile.reach_max.all);
        if (met != 0) tile_visit_node(&tile, &stack, scene, &scene->nodes[next.child_index], met);
        if (stack.count == 0 || tile.active == 0) return others;
    }
}

#endif

#endif
