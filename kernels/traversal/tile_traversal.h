// Traverses the BVH by macro-tiles.
//
// The children of a node are culled against the macro-tile's rectangle, one child per lane. Then the packets
// are culled against each remaining child, one packet per lane, and finally the rays of each packet that is
// not wholly inside the child's rectangle, one ray per lane. Groups of rays are culled by bounds at several
// levels in Reshetov, Soupikov, Hurley, Multi-level ray tracing algorithm, SIGGRAPH 2005, without lanes of
// three types.
#ifndef TILE_TRAVERSAL_H
#define TILE_TRAVERSAL_H

#include "traversal/macro_tile.h"
#include "traversal/sphere_block.h"
#include "traversal/triangle_block.h"

#if LANES > 1

static inline real box_slope_min(real a, real b)
{
    real least = real_min(a, b);
    return real_fma(fabs(least), (real)(-BOX_SLOPE_SLACK * UNIT_ROUNDOFF), least) -
           RAY_SLOPE_SLACK * UNIT_ROUNDOFF;
}

// Returns the children, as bits, whose boxes the macro-tile may hit.
static inline uint boxes_view(SeenRectangles *seen, const MacroTile *tile, global const scalar *boxes)
{
    const OriginFrame *frame = &tile->frame;
    global const scalar *low = boxes + BVH_LOW * BVH_WIDTH, *high = boxes + BVH_HIGH * BVH_WIDTH;
    const real slack = (real)(tile->slack);
    real w_low = real_load(low + frame->w_axis * BVH_WIDTH),
         w_high = real_load(high + frame->w_axis * BVH_WIDTH);
    const bool is_reversed = frame->side < 0;
    real w_min = (is_reversed ? -w_high : w_low) - (real)(frame->w) - slack,
         w_max = (is_reversed ? -w_low : w_high) - (real)(frame->w) + slack;
    real u_low = real_load(low + frame->u_axis * BVH_WIDTH) - (real)(frame->u) - slack,
         u_high = real_load(high + frame->u_axis * BVH_WIDTH) - (real)(frame->u) + slack;
    real v_low = real_load(low + frame->v_axis * BVH_WIDTH) - (real)(frame->v) - slack,
         v_high = real_load(high + frame->v_axis * BVH_WIDTH) - (real)(frame->v) + slack;
    // the near side of a box that reaches back to the origin has any slope
    const real steep = (real)(1 / SMALLEST_RATIO);
    real near_inverse = lanes_select(w_min <= slack, steep, reciprocal_estimate(real_max(w_min, slack))),
         far_inverse = reciprocal_estimate(real_max(w_max, slack));
    seen->u_min.all = box_slope_min(u_low * near_inverse, u_low * far_inverse);
    seen->u_max.all = -box_slope_min(-u_high * near_inverse, -u_high * far_inverse);
    seen->v_min.all = box_slope_min(v_low * near_inverse, v_low * far_inverse);
    seen->v_max.all = -box_slope_min(-v_high * near_inverse, -v_high * far_inverse);
    seen->w.all = w_min;
    return tile_sees(tile, seen, w_max);
}

// Returns those of the packets, as bits, whose rectangle overlaps that of a box. Tests one packet per lane.
static inline uint packets_overlap(const MacroTile *tile, uint packets, const SeenRectangle *seen)
{
    return packets &
           lanes_bits(((real)(seen->u_min) <= tile->u_max.all) & (tile->u_min.all <= (real)(seen->u_max)) &
                      ((real)(seen->v_min) <= tile->v_max.all) & (tile->v_min.all <= (real)(seen->v_max)) &
                      ((real)(seen->w) <= tile->reach_max.all));
}

// Returns for each child, one per lane, the packets whose rectangles overlap the child's, as bits.
static inline integer packets_overlap_each(const MacroTile *tile, uint packets, const SeenRectangles *seen)
{
    integer overlapping = (integer)(0);
    for (; packets != 0; packets &= packets - 1) {
        const uint packet = lowest_bit(packets);
        overlapping = lanes_select(packet_sees(tile, packet, seen),
                                   overlapping | (integer)((scalar_integer)1 << packet), overlapping);
    }
    return overlapping;
}

// Returns those of the packets, as bits, that have a ray within the rectangle. The rays of a packet that is
// wholly inside are not tested.
static inline uint packets_within(const MacroTile *tile, uint packets, const SeenRectangle *seen)
{
    const uint inside =
        lanes_bits(((real)(seen->u_min) <= tile->u_min.all) & (tile->u_max.all <= (real)(seen->u_max)) &
                   ((real)(seen->v_min) <= tile->v_min.all) & (tile->v_max.all <= (real)(seen->v_max)));
    for (uint left = packets & ~inside; left != 0; left &= left - 1)
        if (rays_within(tile, lowest_bit(left), seen) == 0) packets &= ~(left & -left);
    return packets;
}

// Prefetches what a visit will read first.
static inline void entry_prefetch(const Scene *scene, uint type, uint index)
{
    if (type == BVH_NODE)
        memory_prefetch((global const char *)&scene->nodes[index], sizeof(BvhNode));
    else if (HAS_TRIANGLES && leaf_type(type) == TYPE_TRIANGLES)
        memory_prefetch((global const char *)&scene->triangle_blocks[index], sizeof(TriangleBlock));
    else if (HAS_SPHERES && leaf_type(type) == TYPE_SPHERES)
        memory_prefetch((global const char *)&scene->sphere_blocks[index],
                        sizeof(scene->sphere_blocks->rows) + sizeof(scene->sphere_blocks->ids));
    else if (HAS_INSTANCES && leaf_type(type) == TYPE_INSTANCES)
        memory_prefetch((global const char *)&scene->instances[index], sizeof(Instance));
}

// Intersects the primitives of a leaf with the rays of the entry's packets.
static inline void tile_visit_leaf(MacroTile *tile, const Scene *scene, const TileEntry *leaf)
{
    for (uint packets = leaf->packets; packets != 0; packets &= packets - 1) {
        const uint packet = lowest_bit(packets);
        if (HAS_INSTANCES && leaf_type(leaf->type) == TYPE_INSTANCES) {
            const uint rays = rays_within(tile, packet, &leaf->seen);
            if (rays != 0 &&
                instance_traverse(&tile->traversals[packet], scene, &tile->rays[packet], leaf->index, rays))
                tile_update(tile, packet);
            continue;
        }
        tile_prepare(tile, packet);
        if (intersect_leaf(&tile->traversals[packet], scene, &tile->rays[packet], leaf->type, leaf->index))
            tile_update(tile, packet);
    }
}

// Returns whether a child is visited only after all that are nearer to the common origin, which is so for
// nodes, blocks and instances. Shadow rays do not end at the nearest hit and gain nothing from that order
// between blocks of spheres.
static inline bool child_waits(uint type, bool is_shadow)
{
    if (HAS_INSTANCES && leaf_type(type) == TYPE_INSTANCES) return true;
    return type == BVH_NODE || leaf_type(type) == TYPE_TRIANGLES ||
           (!is_shadow && leaf_type(type) == TYPE_SPHERES);
}

// Visits the children of a node that its packets may hit, or pushes those that wait, the nearest to the
// common origin last. Returns the number of entries.
static inline ALWAYS_INLINE uint tile_visit_node(MacroTile *tile, const Scene *scene, const TileEntry *parent,
                                                 TileEntry *entries, uint count, bool is_shadow)
{
    global const BvhNode *node = &scene->nodes[parent->index];
    const uint packets = parent->packets, bottom = count;
    if (tile->has_shrunk) tile_bound_reach(tile);
    SeenRectangles boxes;
    uint children = boxes_view(&boxes, tile, (global const scalar *)node->planes);
    const bool by_packet = popcount(packets) < popcount(children); // the shorter loop runs
    IntegerLanes overlapping;
    if (by_packet) {
        overlapping.all = packets_overlap_each(tile, packets, &boxes);
        children &= lanes_bits(overlapping.all != (integer)(0));
    }
    for (; children != 0; children &= children - 1) {
        const uint child = lowest_bit(children);
        TileEntry entry;
        entry.seen = (SeenRectangle){boxes.u_min.each[child], boxes.u_max.each[child],
                                     boxes.v_min.each[child], boxes.v_max.each[child], boxes.w.each[child]};
        entry.type = ((global const uint *)node->child_type)[child];
        entry.packets = tile->active & (by_packet ? (uint)overlapping.each[child]
                                                  : packets_overlap(tile, packets, &entry.seen));
        entry.packets = packets_within(tile, entry.packets, &entry.seen);
        if (entry.packets == 0 || entry.type == BVH_EMPTY) continue;
        entry.index = ((global const uint *)node->child_index)[child];
        if (!child_waits(entry.type, is_shadow)) {
            if (HAS_SPHERES && is_shadow && leaf_type(entry.type) == TYPE_SPHERES)
                tile_visit_spheres(tile, scene, &entry, true);
            else
                tile_visit_leaf(tile, scene, &entry);
            continue;
        }
        entry_prefetch(scene, entry.type, entry.index);
        uint slot = count++;
        for (; slot > bottom && entries[slot - 1].seen.w < entry.seen.w; slot--)
            entries[slot] = entries[slot - 1];
        entries[slot] = entry;
    }
    return count;
}

static inline ALWAYS_INLINE void tile_traverse(MacroTile *tile, const Scene *scene, bool is_shadow)
{
    TileEntry entries[STACK_CAPACITY];
    entries[0] = (TileEntry){.seen = {-LARGEST, LARGEST, -LARGEST, LARGEST, -LARGEST},
                             .index = 0,
                             .type = BVH_NODE,
                             .packets = tile->active};
    uint count = 1;
    while (count > 0 && tile->active != 0) {
        TileEntry entry = entries[--count];
        entry.packets &= tile->active & lanes_bits((real)(entry.seen.w) <= tile->reach_max.all);
        if (entry.packets == 0) continue;
        if (entry.type == BVH_NODE)
            count = tile_visit_node(tile, scene, &entry, entries, count, is_shadow);
        else if (HAS_TRIANGLES && leaf_type(entry.type) == TYPE_TRIANGLES)
            tile_visit_triangles(tile, scene, &entry, is_shadow);
        else if (HAS_INSTANCES && leaf_type(entry.type) == TYPE_INSTANCES)
            tile_visit_leaf(tile, scene, &entry);
        else if (HAS_SPHERES && !is_shadow)
            tile_visit_spheres(tile, scene, &entry, false);
    }
}

// Camera and shadow rays are separate, so that blocks keep nothing for shadows in registers for the former.
static OUT_OF_LINE void tile_traverse_camera(MacroTile *tile, const Scene *scene)
{
    tile_traverse(tile, scene, false);
}

static OUT_OF_LINE void tile_traverse_shadows(MacroTile *tile, const Scene *scene)
{
    tile_traverse(tile, scene, true);
}

// Traverses the BVH with those of the packets, given as bits, whose slopes fit the common origin's frame,
// and returns the others. All must have active rays.
static inline uint traverse_bvh_by_tile(Traversal *traversals, const Scene *scene, Ray *rays, uint packets)
{
    MacroTile tile;
    PacketBounds bounds;
    tile.traversals = traversals;
    tile.rays = rays;
    tile.active = 0;
    const uint lowest = lowest_bit(packets);
    tile.frame = origin_frame(scene, &rays[lowest], traversals[lowest].active);
    if (IS_CERTIFIED) bounds.position_error = bounds.origin_error = bounds.vertex_error1 = (real)(0);
    for (uint i = 0; i < LANES; i++) {
        bounds.u_min[i] = bounds.u_max[i] = bounds.v_min[i] = bounds.v_max[i] = bounds.reach_max[i] =
            (real)(LARGEST);
        if (packets >> i & 1) tile_add(&tile, &bounds, scene, i);
    }
    const uint others = packets & ~tile.active;
    if (tile.active == 0) return others;
    tile.unprepared = tile.active;
    tile_bound(&tile, &bounds, scene);
    if (traversals[lowest].query == OCCLUSION)
        tile_traverse_shadows(&tile, scene);
    else
        tile_traverse_camera(&tile, scene);
    return others;
}

#endif

#endif
