// Defines macro-tiles: several packets at once, whose rays pass through a common origin.
//
// In the frame of the common origin, one coordinate axis is w and the other two are u and v. A ray there is
// a point (u / w, v / w), and both a packet and a box seen from the origin are rectangles of such points.
// Packets are frusta on a plane across the main axis in Wald, Ize, Kensler, Knoll, Parker, Ray tracing
// animated scenes using coherent grid traversal, SIGGRAPH 2006.
#ifndef MACRO_TILE_H
#define MACRO_TILE_H

#include "traversal/boxes.h"
#include "traversal/query.h"

#if LANES > 1

// Packets with a larger slope in the frame take packet traversal.
#define SLOPE_MAX ((real)(4))

// Rounding bounds in units of roundoff u: a box's slope, relative to itself; a ray's slope, relative to 1;
// and the enlargement of boxes beyond their slack, relative to the coordinates. A box's slope needs 7 u. A
// ray's needs 24 u: a quotient, which may be off by 5 u, and a product, times SLOPE_MAX. In addition, a ray's
// line misses a light by u of each component of the whole ray d, in all 4 u |d|_1, and the difference of a
// plane and the origin is off by 8 u w. The sum is below 64 u of the larger of w and d, which are at most the
// 1-norms, seen from the eye, of the hit or the ray's start plus that of the light.
enum { BOX_SLOPE_SLACK = 32, RAY_SLOPE_SLACK = 64, TILE_POSITION_SLACK = 64 };
// Error bounds in u of a triangle's vertex across a ray: in the full test, relative to its distance from the
// ray's start, and in a block, relative to its distance from the common origin.
enum { VERTEX_TEST_ERROR = 24, VERTEX_BLOCK_ERROR = 16 };
// At `certified` a vertex counts as off by this many errors of the full test (triangle_block.h), which are in
// proportion to 1-norms, up to 2.4 times the distance.
enum { CERTIFIED_VERTEX_ERROR = 6 };
#define NORM1_PER_DISTANCE 2.4f

// The frame of a common origin. Rays count as leaving it along positive w, whichever way they run.
typedef struct {
    uint u_axis, v_axis, w_axis;
    bool leaving;   // rays start at the origin; else they end there
    scalar side;    // -1 if w runs against its axis, else 1
    scalar u, v, w; // the coordinates of the origin
} OriginFrame;

// A rectangle seen from the common origin, at w or beyond.
typedef struct {
    scalar u_min, u_max, v_min, v_max, w;
} SeenRectangle;

// A child of a node.
typedef struct {
    SeenRectangle seen;
    uint index, type; // child_index and child_type of the BvhNode
    uint packets;     // the packets that may hit it, as bits
} TileEntry;

// Rectangles, one per lane: the boxes of a node's children, or a block's primitives.
typedef struct {
    RealLanes u_min, u_max, v_min, v_max, w;
} SeenRectangles;

typedef struct {
    Traversal *traversals; // one per packet, like the rays
    Ray *rays;
    OriginFrame frame;
    uint active;     // packets that still traverse, as bits
    uint unprepared; // packets for which ray_prepare has not been called, as bits
    scalar slack;    // the enlargement of boxes
    // per packet, the slopes of its rays, w per t, and the w up to which they are traversed, -LARGEST in
    // finished lanes
    real u[LANES], v[LANES], w_per_t[LANES], reach[LANES];
    // bounds of these over each packet, one lane per packet, inverted for packets that are not in the tile
    RealLanes u_min, u_max, v_min, v_max, reach_max;
    // bounds over all packets
    scalar tile_u_min, tile_u_max, tile_v_min, tile_v_max, tile_reach_max;
    bool has_shrunk;  // a hit has reduced a reach since tile_reach_max was set
    scalar ray_per_w; // an upper bound of the rays' length per w
    // A vertex of a triangle that counts as hit is off across a ray by at most vertex_error0 + vertex_error1
    // times the distance from the common origin.
    scalar vertex_error0, vertex_error1;
} MacroTile;

static inline const real *vector_component(const Vector *vector, uint axis)
{
    return axis == 0 ? &vector->x : axis == 1 ? &vector->y : &vector->z;
}

static inline scalar scalar4_along(scalar4 vector, uint axis)
{
    return axis == 0 ? vector.x : axis == 1 ? vector.y : vector.z;
}

// Returns the frame whose w axis is the main axis of the packet's first active ray.
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
    frame.side = scalar4_along(direction, frame.w_axis) < 0 == frame.leaving ? -1 : 1;
    scalar4 origin = scene->header->eye;
    if (!frame.leaving) origin = scene->lights[ray->common_origin - COMMON_ORIGIN_FIRST_LIGHT].position;
    frame.u = scalar4_along(origin, frame.u_axis);
    frame.v = scalar4_along(origin, frame.v_axis);
    frame.w = scalar4_along(origin, frame.w_axis) * frame.side;
    return frame;
}

static inline Vector frame_origin(const OriginFrame *frame)
{
    return (Vector){(real)(frame->u), (real)(frame->v), (real)(frame->w)};
}

// Returns points, one per lane, on the frame's axes, from rows of their x, y and z.
static inline Vector frame_load(const OriginFrame *frame, global const scalar *rows)
{
    return (Vector){real_load(rows + frame->u_axis * LANES), real_load(rows + frame->v_axis * LANES),
                    real_load(rows + frame->w_axis * LANES) * (real)(frame->side)};
}

static inline real tile_reach(const MacroTile *tile, uint packet)
{
    const Traversal *traversal = &tile->traversals[packet];
    real t = BOUND_SLACK; // the product below needs 2 u
    if (tile->frame.leaving) t = t * real_min(hit_limit(&traversal->hit), (real)(LARGEST / 2));
    return lanes_select(traversal->active, t * tile->w_per_t[packet], (real)(-LARGEST));
}

// Bounds the error across a ray of a point at this distance from the common origin.
static inline real tile_point_error(const MacroTile *tile, real distance)
{
    return real_fma(distance, (real)(tile->vertex_error1), (real)(tile->vertex_error0));
}

// Bounds of the packets. The least lane of each counts, so maxima are stored as negatives.
typedef struct {
    real u_min[LANES], u_max[LANES], v_min[LANES], v_max[LANES], reach_max[LANES];
    // At `certified`, maxima over all packets: of the exact rays' distance from these within the bounds of
    // the BVH, plus the length that tmin allows before their start; of the error of their origins; and of
    // the error of a vertex across them, over its distance.
    real position_error, origin_error, vertex_error1;
} PacketBounds;

// Adds a packet with active rays, unless one of its slopes is too large.
static inline void tile_add(MacroTile *tile, PacketBounds *bounds, const Scene *scene, uint packet)
{
    const OriginFrame *frame = &tile->frame;
    const Ray *ray = &tile->rays[packet];
    const real zero = (real)(0), none = (real)(LARGEST), away = (real)(frame->leaving ? 1 : -1);
    mask active = tile->traversals[packet].active;
    real w = *vector_component(&ray->direction, frame->w_axis) * ((real)(frame->side) * away);
    real u = *vector_component(&ray->direction, frame->u_axis) * away;
    real v = *vector_component(&ray->direction, frame->v_axis) * away;
    mask steep = (w <= zero) | (fabs(u) > SLOPE_MAX * w) | (fabs(v) > SLOPE_MAX * w);
    if (lanes_any(active & steep)) return;
    real inverse = reciprocal_estimate(lanes_select(active, w, (real)(1)));
    u = u * inverse;
    v = v * inverse;
    tile->u[packet] = u;
    tile->v[packet] = v;
    tile->w_per_t[packet] = w;
    real reach = tile_reach(tile, packet);
    tile->reach[packet] = reach;
    bounds->u_min[packet] = lanes_select(active, u, none);
    bounds->u_max[packet] = lanes_select(active, -u, none);
    bounds->v_min[packet] = lanes_select(active, v, none);
    bounds->v_max[packet] = lanes_select(active, -v, none);
    bounds->reach_max[packet] = lanes_select(active, -reach, none);
    if (IS_CERTIFIED) {
        real position_error = bounds_position_error(ray, scene->header->bounds) - ray->length * ray->tmin;
        real vertex_error1 = ray->direction_error + (real)((TRIANGLE_ERROR + 1) * UNIT_ROUNDOFF);
        bounds->position_error = real_max(bounds->position_error, lanes_select(active, position_error, zero));
        bounds->origin_error = real_max(bounds->origin_error, lanes_select(active, ray->origin_error, zero));
        bounds->vertex_error1 = real_max(bounds->vertex_error1, lanes_select(active, vertex_error1, zero));
    }
    tile->active |= 1u << packet;
}

static inline void tile_bound_reach(MacroTile *tile)
{
    tile->tile_reach_max = lanes_largest(mask_of_bits(tile->active), tile->reach_max.all);
    tile->has_shrunk = false;
}

// Returns the enlargement of boxes, from upper bounds of the 1-norms of a hit's distance from the ray's
// start and of its coordinates. `norm1_per_w` is the rays' largest 1-norm per w.
static inline scalar tile_slack(const MacroTile *tile, const Scene *scene, scalar norm1_per_w)
{
    const scalar4 bounds = scene->header->bounds;
    const OriginFrame *frame = &tile->frame;
    const scalar center = fabs(bounds.x) + fabs(bounds.y) + fabs(bounds.z);
    const scalar origin = fabs(frame->u) + fabs(frame->v) + fabs(frame->w);
    const scalar start = frame->leaving ? 0 : tile->tile_reach_max * norm1_per_w;
    const scalar farthest = origin + start + center + bounds.w, largest = 2 * center + farthest;
    const scalar units = BOX_HIT_SLACK * farthest + (BOX_ROUNDING_SLACK + TILE_POSITION_SLACK) * largest +
                         TILE_POSITION_SLACK * origin;
    const scalar slack = units * UNIT_ROUNDOFF;
    return HAS_INSTANCES ? slack + scene->header->bounds_low.w * farthest : slack;
}

// Sets the bounds over all packets, once all have been added.
static inline void tile_bound(MacroTile *tile, const PacketBounds *bounds, const Scene *scene)
{
    tile->reach_max.all = -lanes_smallest_of_each(bounds->reach_max);
    tile_bound_reach(tile);
    real u_min = lanes_smallest_of_each(bounds->u_min), u_max = -lanes_smallest_of_each(bounds->u_max);
    real v_min = lanes_smallest_of_each(bounds->v_min), v_max = -lanes_smallest_of_each(bounds->v_max);
    mask members = mask_of_bits(tile->active);
    scalar steepest_u = lanes_largest(members, real_max(-u_min, u_max)),
           steepest_v = lanes_largest(members, real_max(-v_min, v_max));
    const scalar norm1_per_w = 1 + steepest_u + steepest_v;
    // above sqrt(1 + u^2 + v^2), by less than 1 % below a slope of 1/2
    const scalar squared_slope = steepest_u * steepest_u + steepest_v * steepest_v;
    tile->ray_per_w = (scalar)(1.0001f) * fmin(1 + (scalar)(0.5f) * squared_slope, norm1_per_w);
    tile->slack = tile_slack(tile, scene, norm1_per_w);
    tile->vertex_error0 = 0;
    tile->vertex_error1 = (VERTEX_TEST_ERROR + VERTEX_BLOCK_ERROR) * UNIT_ROUNDOFF;
    if (IS_CERTIFIED) {
        tile->slack += lanes_largest(mask_all(), bounds->position_error);
        const scalar origin = fabs(tile->frame.u) + fabs(tile->frame.v) + fabs(tile->frame.w);
        const scalar error1 = (scalar)(CERTIFIED_VERTEX_ERROR * NORM1_PER_DISTANCE) *
                              lanes_largest(mask_all(), bounds->vertex_error1);
        const scalar origin_error = lanes_largest(mask_all(), bounds->origin_error);
        tile->vertex_error0 = CERTIFIED_VERTEX_ERROR * (origin_error + (scalar)(2 * UNIT_ROUNDOFF) * origin);
        tile->vertex_error1 = error1 + VERTEX_BLOCK_ERROR * UNIT_ROUNDOFF;
    }
    // at an eighth of the distance (triangle_block.h) a vertex' error moves its slopes by as much
    const real wider = (real)(8 * (tile->vertex_error1 + 8 * UNIT_ROUNDOFF) * tile->ray_per_w * norm1_per_w);
    tile->u_min.all = u_min - wider;
    tile->u_max.all = u_max + wider;
    tile->v_min.all = v_min - wider;
    tile->v_max.all = v_max + wider;
    tile->tile_u_min = -lanes_largest(members, -tile->u_min.all);
    tile->tile_u_max = lanes_largest(members, tile->u_max.all);
    tile->tile_v_min = -lanes_largest(members, -tile->v_min.all);
    tile->tile_v_max = lanes_largest(members, tile->v_max.all);
}

// Returns the rectangles, as bits, that the macro-tile may hit. `w_max` is where they end, slack included.
static inline uint tile_sees(const MacroTile *tile, const SeenRectangles *seen, real w_max)
{
    return lanes_bits(
        (seen->u_min.all <= (real)(tile->tile_u_max)) & ((real)(tile->tile_u_min) <= seen->u_max.all) &
        (seen->v_min.all <= (real)(tile->tile_v_max)) & ((real)(tile->tile_v_min) <= seen->v_max.all) &
        (seen->w.all <= (real)(tile->tile_reach_max)) & (w_max >= 0));
}

// Returns the rectangles, one per lane, that a packet may hit.
static inline mask packet_sees(const MacroTile *tile, uint packet, const SeenRectangles *seen)
{
    return (seen->u_min.all <= (real)(tile->u_max.each[packet])) &
           ((real)(tile->u_min.each[packet]) <= seen->u_max.all) &
           (seen->v_min.all <= (real)(tile->v_max.each[packet])) &
           ((real)(tile->v_min.each[packet]) <= seen->v_max.all) &
           (seen->w.all <= (real)(tile->reach_max.each[packet]));
}

// Returns the rays of a packet, as bits, that are within a rectangle and reach it.
static inline uint rays_within(const MacroTile *tile, uint packet, const SeenRectangle *seen)
{
    real u = tile->u[packet], v = tile->v[packet];
    return lanes_bits(((real)(seen->u_min) <= u) & (u <= (real)(seen->u_max)) & ((real)(seen->v_min) <= v) &
                      (v <= (real)(seen->v_max)) & ((real)(seen->w) <= tile->reach[packet]));
}

static inline void tile_prepare(MacroTile *tile, uint packet)
{
    if (tile->unprepared >> packet & 1) ray_prepare(&tile->rays[packet]);
    tile->unprepared &= ~(1u << packet);
}

// Updates the reach of a packet after hits.
static inline void tile_update(MacroTile *tile, uint packet)
{
    const Traversal *traversal = &tile->traversals[packet];
    tile->reach[packet] = tile_reach(tile, packet);
    if (!lanes_any(traversal->active)) tile->active &= ~(1u << packet);
    if (!tile->frame.leaving) return; // rays to a light end at a hit, and the others keep their reach
    tile->reach_max.each[packet] = lanes_largest(traversal->active, tile->reach[packet]);
    tile->has_shrunk = true;
}

#endif

#endif
