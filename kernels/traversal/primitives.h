// Intersects packets with primitives, in the leaves of the BVH and outside it.
#ifndef PRIMITIVES_H
#define PRIMITIVES_H

#include "all_shapes.h" // The Makefile generates all_shapes.h, which includes every file of shapes/.
#include "traversal/cull_sphere.h"
#include "traversal/cutout.h"

// Prefetches what shading reads of the closest hit.
static inline void object_prefetch(const Scene *scene, uint type, uint4 id)
{
    if (!HAS_INSTANCES) memory_prefetch((global const char *)&scene->objects[id.x], sizeof(ObjectEntry));
    if (HAS_TRIANGLES && type == TYPE_TRIANGLES && id.y > 0)
        memory_prefetch((global const char *)&scene->triangle_normals[id.y - 1], sizeof(TriangleNormals));
}

// Clears the uncertain lanes of rays that leave a neighbor of a triangle and so cannot hit the triangle.
static inline void triangle_skip_neighbors(const Scene *scene, uint id, const Ray *ray, CertainHit *hit)
{
    if (!lanes_any(hit->uncertain & (ray->origin_object >= (integer)(0)))) return;
    Triangle triangle = scene->triangles[scene->objects[id].type_index_material.y];
    TriangleNeighbors neighbors = scene->triangle_neighbors[id];
    hit->uncertain = hit->uncertain & !triangle_left_behind(&triangle, &neighbors, ray, hit->uncertain);
}

// Tests one primitive and records its hit. Returns whether any lane hits or may hit it.
#if IS_CERTIFIED
#define INTERSECT_SHAPE(feature, Type, name, names)                                                          \
    static inline bool intersect_##name(Traversal *traversal, const Scene *scene, const Ray *ray,            \
                                        Type shape)                                                          \
    {                                                                                                        \
        CertainHit hit = name##_certain_hit(&shape, ray);                                                    \
        if (TYPE_##feature == TYPE_TRIANGLES && lanes_any(hit.uncertain))                                    \
            triangle_skip_neighbors(scene, shape.id.x, ray, &hit);                                           \
        if (!lanes_any(hit.found | hit.uncertain)) return false;                                             \
        traversal_record_certain(traversal, scene, &hit, shape.id.x);                                        \
        return true;                                                                                         \
    }
#else
#define INTERSECT_SHAPE(feature, Type, name, names)                                                          \
    static inline bool intersect_##name(Traversal *traversal, const Scene *scene, const Ray *ray,            \
                                        Type shape)                                                          \
    {                                                                                                        \
        real t = ray->tmax;                                                                                  \
        mask found = name##_hit(&shape, ray, &t);                                                            \
        if (!lanes_any(found)) return false;                                                                 \
        if (HAS_CUTOUTS) {                                                                                   \
            const mask cut = traversal_cut(traversal, scene, ray, shape.id.x, &found, t);                    \
            if (TYPE_##feature == TYPE_SPHERES && lanes_any(cut)) { /* the far side may be hit */            \
                Ray behind = *ray;                                                                           \
                behind.active = cut;                                                                         \
                behind.tmin = lanes_select(cut, t, ray->tmin);                                               \
                real far_t = ray->tmax;                                                                      \
                mask far_found = name##_hit(&shape, &behind, &far_t);                                        \
                traversal_cut(traversal, scene, ray, shape.id.x, &far_found, far_t);                         \
                t = lanes_select(far_found, far_t, t);                                                       \
                found = found | far_found;                                                                   \
            }                                                                                                \
            if (!lanes_any(found)) return false;                                                             \
        }                                                                                                    \
        traversal_record(traversal, scene, found, t, shape.id.x);                                            \
        if (traversal->query != OCCLUSION) object_prefetch(scene, TYPE_##feature, shape.id);                 \
        return true;                                                                                         \
    }
#endif
SHAPE_LIST(INTERSECT_SHAPE)

// Intersects an instance with the rays of some lanes, given as bits (traversal/instance_bvh.h). Returns
// whether any may hit it.
static bool instance_traverse(Traversal *traversal, const Scene *scene, const Ray *ray, uint index,
                              uint lanes);

// Intersects primitives first .. last - 1 of one type. Each type has a function, because Mesa, which inlines
// before it knows the type asked for, would compile the tests of all types at each call of a common one.
#define INTERSECT_SHAPES(feature, Type, name, names)                                                         \
    static inline bool intersect_##names(Traversal *traversal, const Scene *scene, const Ray *ray,           \
                                         uint first, uint last)                                              \
    {                                                                                                        \
        bool found_any = false;                                                                              \
        for (uint i = first; i < last; i++) {                                                                \
            if (!intersect_##name(traversal, scene, ray, scene->names[i])) continue;                         \
            found_any = true;                                                                                \
            if (traversal->query == OCCLUSION && !lanes_any(traversal->active)) break;                       \
        }                                                                                                    \
        return found_any;                                                                                    \
    }
SHAPE_LIST(INTERSECT_SHAPES)

static inline bool intersect_instances(Traversal *traversal, const Scene *scene, const Ray *ray, uint first,
                                       uint last)
{
    bool found_any = false;
    for (uint i = first; i < last && lanes_any(traversal->active); i++)
        found_any |= instance_traverse(traversal, scene, ray, i, lanes_bits(traversal->active));
    return found_any;
}

// Intersects those of `count` primitives of one type whose bits are set in `near` and whose cull spheres, if
// these are not 0, a ray may hit. Primitives after the 32nd have no bits and count as near.
#define INTERSECT_NEAR_SHAPES(feature, Type, name, names)                                                    \
    static inline void intersect_near_##names(Traversal *traversal, const Scene *scene, const Ray *ray,      \
                                              uint first, uint count, uint near,                             \
                                              global const CullSphere *cull_spheres)                         \
    {                                                                                                        \
        for (uint next = 0; next < count; next += 32, near = ~0u) {                                          \
            if (count - next < 32) near &= (1u << (count - next)) - 1;                                       \
            for (; near != 0; near &= near - 1) {                                                            \
                const uint i = next + lowest_bit(near);                                                      \
                if (!cull_spheres || lanes_any(ray_hits_cull_sphere(ray, &cull_spheres[i])))                 \
                    intersect_##names(traversal, scene, ray, first + i, first + i + 1);                      \
                if (traversal->query == OCCLUSION && !lanes_any(traversal->active)) return;                  \
            }                                                                                                \
        }                                                                                                    \
    }
PRIMITIVE_LIST(INTERSECT_NEAR_SHAPES)

// Returns the index of a block's first triangle.
static inline uint block_first(const Scene *scene, uint block)
{
    return ((global const uint *)scene->block_triangles)[block];
}

#if LANES > 1
static inline global const scalar *block_row(global const SphereBlock *block, uint row)
{
    return (global const scalar *)block->rows + row * LANES;
}

// Returns points, one per lane, whose x, y and z are in three rows.
static inline Vector rows_load(global const scalar *rows)
{
    return (Vector){real_load(rows), real_load(rows + LANES), real_load(rows + 2 * LANES)};
}

static inline Vector block_centers(global const SphereBlock *block)
{
    return rows_load(block_row(block, 0));
}

// Returns the sphere of one lane.
static inline Sphere block_sphere(const Scene *scene, global const SphereBlock *block, uint lane)
{
    const uint id = ((global const uint *)block->ids)[lane];
    if (RARELY(id & SPHERE_HAS_FLAGS)) return scene->spheres[((global const uint *)block->indices)[lane]];
    scalar4 center_radius = (scalar4)(block_row(block, 0)[lane], block_row(block, 1)[lane],
                                      block_row(block, 2)[lane], block_row(block, 3)[lane]);
    return (Sphere){center_radius, (uint4)(id, 0, 0, 0)};
}

// Returns those of the first `count` spheres of a block, as bits, that one ray may hit. Rejects by the first
// step of the full test, at `certified` with radii enlarged by the exact ray's error and all roundings.
static inline uint block_spheres_near(global const SphereBlock *block, uint count, const Ray *ray, uint lane)
{
    const Vector origin = vector_of_lane(&ray->origin, lane),
                 direction = vector_of_lane(&ray->direction, lane),
                 from = vector_subtract(origin, block_centers(block));
    const real inverse_squared = real_of_lane(&ray->inverse_squared, lane);
    real radius = real_load(block_row(block, 3));
    const real squared_distance = vector_dot(from, from), b = vector_dot(from, direction);
    mask near = mask_all();
#if IS_CERTIFIED
    const real distance = vector_norm1(from) + 3 * radius + vector_norm1(origin),
               per_distance = real_of_lane(&ray->direction_error, lane) + 32 * UNIT_ROUNDOFF;
    radius = radius + real_fma(per_distance, distance, real_of_lane(&ray->origin_error, lane));
#else
    near = !ray_leaves_sphere(from, direction, real_of_lane(&ray->tmin, lane), radius);
#endif
    near = near & !(b * (b * inverse_squared) <
                    real_fma(-radius, radius, squared_distance * (1 - 32 * UNIT_ROUNDOFF)));
    return lanes_bits(near) & ((1u << count) - 1);
}

// Intersects the spheres of a block that are given as bits.
static inline bool intersect_block_spheres(Traversal *traversal, const Scene *scene, const Ray *ray,
                                           global const SphereBlock *block, uint spheres)
{
    bool found_any = false;
    for (; spheres != 0; spheres &= spheres - 1) {
        found_any |= intersect_sphere(traversal, scene, ray, block_sphere(scene, block, lowest_bit(spheres)));
        if (traversal->query == OCCLUSION && !lanes_any(traversal->active)) break;
    }
    return found_any;
}

// Intersects the first `count` spheres of a block with the rays of some lanes, given as bits.
static inline bool intersect_sphere_block(Traversal *traversal, const Scene *scene, const Ray *ray,
                                          uint index, uint count, uint lanes)
{
    global const SphereBlock *block = &scene->sphere_blocks[index];
    uint near = 0;
    for (; lanes != 0; lanes &= lanes - 1)
        near |= block_spheres_near(block, count, ray, lowest_bit(lanes));
    return intersect_block_spheres(traversal, scene, ray, block, near);
}

// Returns those of the first `count` triangles of a block, as bits, that one ray may hit. Runs the first
// step of the full test, one triangle per lane, at `certified` with error bounds at least as large as its.
static inline uint block_triangles_near(global const TriangleBlock *block, uint count, const Ray *ray,
                                        uint lane)
{
    global const scalar *rows = (global const scalar *)block->rows;
    const Corners corners = {rows_load(rows), rows_load(rows + 3 * LANES), rows_load(rows + 6 * LANES)};
    Ray one; // only what the test reads
    one.origin = vector_of_lane(&ray->origin, lane);
    one.across_u = vector_of_lane(&ray->across_u, lane);
    one.across_v = vector_of_lane(&ray->across_v, lane);
    const TriangleEdges edges = triangle_edges(corners, &one);
#if IS_CERTIFIED
    one.origin_error = real_of_lane(&ray->origin_error, lane);
    one.direction_error = real_of_lane(&ray->direction_error, lane);
    one.across_length = real_of_lane(&ray->across_length, lane);
    const real slack = (real)(1 + 64 * UNIT_ROUNDOFF), size = slack * vector_norm1(corners_max_abs(corners)),
               error = slack * triangle_frame_error(&edges, &one, size);
    const mask near = triangle_signs(&edges, error).perhaps;
#else
    const mask near = triangle_is_crossed(&edges);
#endif
    return lanes_bits(near) & ((1u << count) - 1);
}

// Intersects the triangles of a block that are given as bits.
static inline bool intersect_block_triangles(Traversal *traversal, const Scene *scene, const Ray *ray,
                                             uint first, uint triangles)
{
    bool found_any = false;
    for (; triangles != 0; triangles &= triangles - 1) {
        const uint triangle = first + lowest_bit(triangles);
        found_any |= intersect_triangle(traversal, scene, ray, scene->triangles[triangle]);
        if (traversal->query == OCCLUSION && !lanes_any(traversal->active)) break;
    }
    return found_any;
}

// Intersects the first `count` triangles of a block with the rays of some lanes, given as bits.
static OUT_OF_LINE bool intersect_triangle_block(Traversal *traversal, const Scene *scene, const Ray *ray,
                                                 uint index, uint count, uint lanes)
{
    const uint first = block_first(scene, index);
    uint near = (1u << count) - 1;
    if (popcount(lanes) <= count) { // the shorter loop
        near = 0;
        for (; lanes != 0; lanes &= lanes - 1)
            near |= block_triangles_near(&scene->triangle_blocks[index], count, ray, lowest_bit(lanes));
    }
    return intersect_block_triangles(traversal, scene, ray, first, near);
}
#endif

// Intersects an object, given as its type_index_material.
static inline void intersect_object(Traversal *traversal, const Scene *scene, const Ray *ray, uint4 entry)
{
#define INTERSECT_OBJECT(feature, Type, name, names)                                                         \
    if (HAS_##feature && entry.x == TYPE_##feature)                                                          \
        intersect_##name(traversal, scene, ray, scene->names[entry.y]);
    SHAPE_LIST(INTERSECT_OBJECT)
}

// Intersects a leaf, given as count << 8 | type (BvhNode.child_type) and its first primitive. Blocks and
// instances are skipped.
static inline bool intersect_leaf(Traversal *traversal, const Scene *scene, const Ray *ray, uint leaf,
                                  uint first)
{
    const uint type = leaf_type(leaf), last = first + leaf_count(leaf);
#define INTERSECT_LEAF(feature, Type, name, names)                                                           \
    if (HAS_##feature && !(LANES > 1 && type_has_blocks(TYPE_##feature)) && type == TYPE_##feature)          \
        return intersect_##names(traversal, scene, ray, first, last);
    SHAPE_LIST(INTERSECT_LEAF)
    return false;
}

#if LANES > 1
// Intersects a block or another leaf with the rays of some lanes, given as bits. Instances are skipped.
static inline bool intersect_leaf_or_block(Traversal *traversal, const Scene *scene, const Ray *ray,
                                           uint leaf, uint index, uint lanes)
{
    const uint type = leaf_type(leaf), count = leaf_count(leaf);
    if (HAS_SPHERES && type == TYPE_SPHERES)
        return intersect_sphere_block(traversal, scene, ray, index, count, lanes);
    if (HAS_TRIANGLES && type == TYPE_TRIANGLES)
        return intersect_triangle_block(traversal, scene, ray, index, count, lanes);
    return intersect_leaf(traversal, scene, ray, leaf, index);
}
#endif

// Intersects the planes, which are never in the BVH.
static inline void intersect_all_planes(Traversal *traversal, const Scene *scene, const Ray *ray)
{
    global const uint *counts = (global const uint *)scene->header->counts;
    if (HAS_PLANES) intersect_planes(traversal, scene, ray, 0, counts[TYPE_PLANES]);
}

// Intersects all other primitives outside the BVH: the unbounded and the huge, or all in a scene without a
// BVH. `near` has the bits that packets_near returns.
static OUT_OF_LINE void intersect_outside_bvh(Traversal *traversal, const Scene *scene, Ray *ray, uint near)
{
    global const uint *counts = (global const uint *)scene->header->counts;
    global const uint *bvh_counts = (global const uint *)scene->header->bvh_counts;
    uint box_count = HAS_BOXES ? counts[TYPE_BOXES] - bvh_counts[TYPE_BOXES] : 0;
    uint triangle_count = HAS_TRIANGLES ? counts[TYPE_TRIANGLES] - bvh_counts[TYPE_TRIANGLES] : 0;
    if (box_count + triangle_count > 0) ray_prepare(ray);
    global const CullSphere *cull_spheres = ray_cull_spheres(scene, ray);
    if (cull_spheres) cull_spheres++; // the first is the BVH's
#define INTERSECT_OUTSIDE_BVH(feature, Type, name, names)                                                    \
    if (HAS_##feature && TYPE_##feature != TYPE_PLANES && lanes_any(traversal->active)) {                    \
        uint first = bvh_counts[TYPE_##feature], count = counts[TYPE_##feature] - first;                     \
        intersect_near_##names(traversal, scene, ray, first, count, near, cull_spheres);                     \
        near = count < 32 ? ~(~near >> count) : ~0u;                                                         \
        if (cull_spheres) cull_spheres += count;                                                             \
    }
    PRIMITIVE_LIST(INTERSECT_OUTSIDE_BVH)
}

#endif
