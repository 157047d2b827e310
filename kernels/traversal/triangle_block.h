// Tests blocks of triangles against the packets of a macro-tile, before the full test (shapes/triangle.h).
//
// In the frame of the common origin an edge from a to b and the origin span a plane of normal a x b. A ray
// of slopes u and v has the edge value (u, v, 1) . (a x b), its distance from the edge times the lengths of
// the edge and of (u, v, 1). A block's triangles are set up one per lane. Then each packet runs the shorter
// of two loops: over its rays, with one triangle per lane, or over the triangles, with one ray per lane. A
// ray misses a triangle if an edge value is below minus its error. Only the rest take the full test. A shadow
// ray is occluded without it if all three values exceed the error.
//
// Let L be the length of (u, v, 1), D the longest edge, W the distance from the common origin to the farther
// of the vertices and the ray's start, S that from the start to the vertices, and u also the unit roundoff.
// Across the ray the full test is off by 8.8 u S, or 18.4 u S with a root off by 3 ulp (docs/numerics.md).
// The block is off by 13 u W: vertices minus origin, the line, which misses the origin, and slopes by 9 u,
// a x (b - a) and its sums by 4 u over the edge's length. A vertex is thus off by less than
// q = 24 u S + 16 u W, and an edge value by E = L D q:
// - The full test is exact for vertices within q. No value of a hit is below -E, and all above E hit.
// - Values inside have the sign of the volume a x (b - a) . c, which is rounded by 8 u of 12 u W^2 D. At a
//   point w d + e of the triangle, |e| <= q, the volume is w n . d + n . e. If its sign is uncertain and
//   8 w >= W, the values' sum |n . d| is below 18 E. Values of a hit are then at most 20 E and, with the
//   wrong sign, at least -24 E.
// - At w >= W / 8, q moves slopes by 8 (24 + 16) u L (1 + |u| + |v|), and they are rounded by 8 u.
// - The normal (b - a) x (c - b) is off by 4 u of 24 u D^2, and the full test's height by 4 to 5 u.
// - At `certified` the full test passes values down to -(5.7 e D + 12.1 e^2) for a vertex' error e across the
//   ray. With q = 6 e and 1-norms up to 2.4 times the distance, L q (D + 4 q) is more.
#ifndef TRIANGLE_BLOCK_H
#define TRIANGLE_BLOCK_H

#include "traversal/macro_tile.h"
#include "traversal/primitives.h"

#if LANES > 1

// The triangles of a block as seen from the common origin, in its frame, one per lane.
typedef struct {
    SeenRectangles seen;
    Vector edges[3]; // a x b, b x c and c x a, signed so that values inside are positive
    RealLanes error; // the error of the edge values
    // Used by shadow rays. `w_far` is an upper bound on the triangle's w, or LARGEST if it may reach the
    // light. `vertex` is on the frame's axes, but not from its origin, and `normal` faces either side.
    RealLanes w_far;
    Vector vertex, normal;
    real normal_squared, longest;
} BlockView;

// Set if shadow rays that certainly miss a triangle's plane, and those that certainly hit the triangle, skip
// the full test.
#define BLOCKS_TEST_SIDES (!IS_CERTIFIED)
#define BLOCKS_OCCLUDE    (BLOCKS_TEST_SIDES && !HAS_TRANSMISSION && !HAS_CUTOUTS)

// Returns a x b, each component within 2 u of the product of the lengths.
static inline Vector block_cross(Vector a, Vector b)
{
    return (Vector){real_fma(a.y, b.z, -(a.z * b.y)), real_fma(a.z, b.x, -(a.x * b.z)),
                    real_fma(a.x, b.y, -(a.y * b.x))};
}

static inline real real_flip(real a, integer sign)
{
    return real_from_bits(bits_from_real(a) ^ sign);
}

static inline Vector vector_flip(Vector a, integer sign)
{
    return (Vector){real_flip(a.x, sign), real_flip(a.y, sign), real_flip(a.z, sign)};
}

// A block's vertices and edges in the frame, and bounds of each triangle.
typedef struct {
    Vector vertex; // a, on the frame's axes but not from its origin
    Vector a, b, c, ab, bc, ca;
    real low, high, longest; // least and largest w of the vertices; the longest edge
    real to_vertices;        // distance from the common origin to the vertices of a triangle that is hit
    real distance;           // that distance, or the one to the rays' starts if it is larger
    mask is_near;            // too close to the common origin for its slopes to be bounded
} BlockVertices;

static inline BlockVertices block_load(const MacroTile *tile, global const TriangleBlock *block)
{
    const OriginFrame *frame = &tile->frame;
    const Vector origin = frame_origin(frame);
    global const scalar *rows = (global const scalar *)block->rows;
    BlockVertices at;
    const Vector b = frame_load(frame, rows + 3 * LANES), c = frame_load(frame, rows + 6 * LANES);
    at.vertex = frame_load(frame, rows);
    // not from the differences below, whose rounding at a far origin exceeds the lengths of the edges
    at.ab = vector_subtract(b, at.vertex);
    at.bc = vector_subtract(c, b);
    at.ca = vector_subtract(at.vertex, c);
    at.a = vector_subtract(at.vertex, origin);
    at.b = vector_subtract(b, origin);
    at.c = vector_subtract(c, origin);
    at.low = real_min_of_3(at.a.z, at.b.z, at.c.z);
    at.high = real_max_of_3(at.a.z, at.b.z, at.c.z);
    real longest_squared =
        real_max_of_3(vector_dot(at.ab, at.ab), vector_dot(at.bc, at.bc), vector_dot(at.ca, at.ca));
    at.longest = 1.0001f * device_sqrt(longest_squared);
    const real per_w = (real)(tile->ray_per_w);
    at.to_vertices = at.distance = real_fma(per_w, at.high, at.longest);
    if (!frame->leaving)
        at.distance = real_max(at.distance, real_fma(per_w, (real)(tile->tile_reach_max), at.longest));
    const real near_error = (real)(8 * tile->vertex_error1) * at.low;
    at.is_near = !(near_error >= tile_point_error(tile, at.distance));
    return at;
}

// Sets the rectangles. Returns those of the first `count` triangles, as bits, that the macro-tile may hit.
static inline uint block_see(BlockView *view, const MacroTile *tile, const BlockVertices *at, uint count)
{
    Vector a = at->a, b = at->b, c = at->c;
    real a_inverse = reciprocal_estimate(a.z), b_inverse = reciprocal_estimate(b.z),
         c_inverse = reciprocal_estimate(c.z);
    real a_u = a.x * a_inverse, b_u = b.x * b_inverse, c_u = c.x * c_inverse;
    real a_v = a.y * a_inverse, b_v = b.y * b_inverse, c_v = c.y * c_inverse;
    const real anywhere = (real)(LARGEST), slack = (real)(tile->slack);
    view->seen.u_min.all = lanes_select(at->is_near, -anywhere, real_min_of_3(a_u, b_u, c_u));
    view->seen.u_max.all = lanes_select(at->is_near, anywhere, real_max_of_3(a_u, b_u, c_u));
    view->seen.v_min.all = lanes_select(at->is_near, -anywhere, real_min_of_3(a_v, b_v, c_v));
    view->seen.v_max.all = lanes_select(at->is_near, anywhere, real_max_of_3(a_v, b_v, c_v));
    view->seen.w.all = at->low - slack;
    return tile_sees(tile, &view->seen, at->high + slack) & ((1u << count) - 1);
}

// Returns the error of a vertex across a ray.
static inline real block_vertex_error(const MacroTile *tile, const BlockVertices *at)
{
    real distance = at->distance;
    if (IS_CERTIFIED) return tile_point_error(tile, distance);
    // the full test's error counts from the ray's start
    real from_start = tile->frame.leaving ? distance : real_fma(at->low, (real)(-tile->ray_per_w), distance);
    return real_fma(from_start, (real)(VERTEX_TEST_ERROR * UNIT_ROUNDOFF),
                    distance * (VERTEX_BLOCK_ERROR * UNIT_ROUNDOFF));
}

// Sets the edges and their error, and for shadow rays what certain answers need.
static inline void block_set_edges(BlockView *view, const MacroTile *tile, const BlockVertices *at,
                                   bool is_shadow)
{
    Vector edge = block_cross(at->a, at->ab);
    real volume = vector_dot(edge, at->c);
    integer sign = bits_from_real(volume) & bits_from_real((real)(-0.0f));
    view->edges[0] = vector_flip(edge, sign);
    view->edges[1] = vector_flip(block_cross(at->b, at->bc), sign);
    view->edges[2] = vector_flip(block_cross(at->c, at->ca), sign);
    real vertex_error = block_vertex_error(tile, at), width = at->longest;
    if (IS_CERTIFIED) width = real_fma((real)(4), vertex_error, width);
    real error = real_fma(vertex_error * (real)(tile->ray_per_w), width, (real)(SMALLEST_RATIO));
    // edge-on, rounding decides the sign, and values inside are small
    real volume_error = 12 * UNIT_ROUNDOFF * at->longest * at->to_vertices * at->to_vertices;
    mask in_range = (volume_error > SMALLEST_RATIO) & (fabs(volume) < LARGEST);
    mask has_sign = in_range & (fabs(volume) > volume_error);
    real signless_error = lanes_select(in_range & !at->is_near, 24 * error, (real)(LARGEST));
    view->error.all = lanes_select(has_sign, error, signless_error);
    if (IS_CERTIFIED) return;
    if (!is_shadow) return;
    const real slack = (real)(tile->slack);
    view->w_far.all = lanes_select(at->low > slack + slack, at->high + slack, (real)(LARGEST));
    view->vertex = at->vertex;
    view->normal = block_cross(at->ab, at->bc);
    view->normal_squared = vector_dot(view->normal, view->normal);
    view->longest = at->longest;
}

static inline real edge_value(Vector edge, real u, real v)
{
    return real_fma(u, edge.x, real_fma(v, edge.y, edge.z));
}

// Returns the lanes whose shadow rays certainly start on the light's side of a triangle's plane and so miss
// it. `to_plane` leads from the start to a vertex.
static inline mask starts_before(Vector normal, real normal_squared, real longest, real u, real v,
                                 Vector to_plane)
{
    real along = edge_value(normal, u, v), height = vector_dot(normal, to_plane);
    real squared =
        real_max(normal_squared, (real)(SMALLEST_RATIO)) * real_fma(u, u, real_fma(v, v, (real)(1)));
    // the full test asks for 1/16, of a normal that may differ by a sixth where the height is barely enough
    mask is_faced = along * along > 0.18f * squared;
    // in this order the product underflows only where the square on the left does
    real error = 24 * UNIT_ROUNDOFF * longest * longest;
    return is_faced & (along * height > 0) &
           (height * height > vector_dot(to_plane, to_plane) * error * error);
}

// Ends shadow rays that are certainly occluded.
static inline void tile_occlude(MacroTile *tile, uint packet, uint lanes)
{
    Traversal *traversal = &tile->traversals[packet];
    mask occluded = mask_of_bits(lanes);
    traversal->active = traversal->active & !occluded;
    tile->reach[packet] = lanes_select(occluded, (real)(-LARGEST), tile->reach[packet]);
    if (!lanes_any(traversal->active)) tile->active &= ~(1u << packet);
}

// Returns the origins of a packet's rays on the frame's axes.
static inline Vector packet_starts(const MacroTile *tile, uint packet)
{
    const OriginFrame *frame = &tile->frame;
    const Vector *origin = &tile->rays[packet].origin;
    return (Vector){*vector_component(origin, frame->u_axis), *vector_component(origin, frame->v_axis),
                    *vector_component(origin, frame->w_axis) * (real)(frame->side)};
}

// Returns the triangles, of those given as bits, whose full test a packet needs. Loops over the rays, with
// one triangle per lane.
static inline ALWAYS_INLINE uint block_test_rays(MacroTile *tile, const BlockView *view, uint packet,
                                                 uint rays, uint triangles, bool is_shadow)
{
    uint remaining = 0, occluded = 0;
    Vector starts;
    if (is_shadow) starts = packet_starts(tile, packet);
    for (; rays != 0; rays &= rays - 1) {
        const uint lane = lowest_bit(rays);
        real u = real_of_lane(&tile->u[packet], lane), v = real_of_lane(&tile->v[packet], lane),
             reach = real_of_lane(&tile->reach[packet], lane);
        real least = real_min_of_3(edge_value(view->edges[0], u, v), edge_value(view->edges[1], u, v),
                                   edge_value(view->edges[2], u, v));
        uint perhaps = triangles & lanes_bits(!(least < -view->error.all) & (view->seen.w.all <= reach));
        if (perhaps == 0) continue;
        if (is_shadow && BLOCKS_OCCLUDE &&
            (perhaps & lanes_bits((least > view->error.all) & (view->w_far.all < reach)))) {
            occluded |= 1u << lane;
            continue;
        }
        if (is_shadow && BLOCKS_TEST_SIDES) {
            Vector to_plane = vector_subtract(view->vertex, vector_of_lane(&starts, lane));
            perhaps &=
                ~lanes_bits(starts_before(view->normal, view->normal_squared, view->longest, u, v, to_plane));
        }
        remaining |= perhaps;
    }
    if (occluded != 0) tile_occlude(tile, packet, occluded);
    return tile->active >> packet & 1 ? remaining : 0;
}

// Returns the triangles whose full test a packet needs. Loops over the triangles, with one ray per lane.
static inline ALWAYS_INLINE uint block_test_triangles(MacroTile *tile, const BlockView *view, uint packet,
                                                      uint triangles, bool is_shadow)
{
    uint remaining = 0;
    const real u = tile->u[packet], v = tile->v[packet];
    for (; triangles != 0; triangles &= triangles - 1) {
        const uint lane = lowest_bit(triangles);
        const real error = (real)(view->error.each[lane]), reach = tile->reach[packet];
        real least = real_min_of_3(edge_value(vector_of_lane(&view->edges[0], lane), u, v),
                                   edge_value(vector_of_lane(&view->edges[1], lane), u, v),
                                   edge_value(vector_of_lane(&view->edges[2], lane), u, v));
        uint perhaps = lanes_bits(!(least < -error) & ((real)(view->seen.w.each[lane]) <= reach));
        if (perhaps == 0) continue;
        if (is_shadow && BLOCKS_OCCLUDE) {
            const uint occluded = lanes_bits((least > error) & ((real)(view->w_far.each[lane]) < reach));
            if (occluded != 0) tile_occlude(tile, packet, occluded);
            if (!(tile->active >> packet & 1)) return 0;
            perhaps &= ~occluded;
        }
        if (is_shadow && BLOCKS_TEST_SIDES && perhaps != 0) {
            Vector to_plane =
                vector_subtract(vector_of_lane(&view->vertex, lane), packet_starts(tile, packet));
            perhaps &= ~lanes_bits(starts_before(vector_of_lane(&view->normal, lane),
                                                 real_of_lane(&view->normal_squared, lane),
                                                 real_of_lane(&view->longest, lane), u, v, to_plane));
        }
        if (perhaps != 0) remaining |= 1u << lane;
    }
    return remaining;
}

static inline void triangles_prefetch(const Scene *scene, uint first, uint triangles)
{
    for (; triangles != 0; triangles &= triangles - 1)
        memory_prefetch((global const char *)&scene->triangles[first + lowest_bit(triangles)],
                        sizeof(Triangle));
}

// Intersects the triangles of a block with the entry's packets. The full tests come last, when what they read
// has been prefetched.
static inline ALWAYS_INLINE void tile_visit_triangles(MacroTile *tile, const Scene *scene,
                                                      const TileEntry *leaf, bool is_shadow)
{
    if (tile->has_shrunk) tile_bound_reach(tile);
    BlockView view;
    const BlockVertices vertices = block_load(tile, &scene->triangle_blocks[leaf->index]);
    const uint triangles = block_see(&view, tile, &vertices, leaf_count(leaf->type));
    if (triangles == 0) return;
    block_set_edges(&view, tile, &vertices, is_shadow);
    const uint first = block_first(scene, leaf->index);
    uint prefetched = is_shadow ? 0 : triangles; // shadow rays miss many of them
    triangles_prefetch(scene, first, prefetched);
    ushort remaining[LANES];
    uint tested = 0;
    for (uint packets = leaf->packets; packets != 0; packets &= packets - 1) {
        const uint packet = lowest_bit(packets), rays = rays_within(tile, packet, &leaf->seen);
        if (rays == 0) continue;
        const uint near = triangles & lanes_bits(packet_sees(tile, packet, &view.seen));
        if (near == 0) continue;
        const uint left = popcount(rays) <= popcount(near)
                              ? block_test_rays(tile, &view, packet, rays, near, is_shadow)
                              : block_test_triangles(tile, &view, packet, near, is_shadow);
        if (left == 0) continue;
        remaining[packet] = (ushort)left;
        tested |= 1u << packet;
        triangles_prefetch(scene, first, left & ~prefetched);
        prefetched |= left;
    }
    for (; tested != 0; tested &= tested - 1) {
        const uint packet = lowest_bit(tested);
        tile_prepare(tile, packet);
        if (intersect_block_triangles(&tile->traversals[packet], scene, &tile->rays[packet], first,
                                      remaining[packet]))
            tile_update(tile, packet);
    }
}

#endif

#endif
