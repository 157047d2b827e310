// The scene as the kernels see it, its closest hit and whether anything blocks a ray. Both ask the same
// function of each shape, so that they can never disagree.
#ifndef SCENE_H
#define SCENE_H

#include "disc.h"
#include "plane.h"
#include "revolution.h"
#include "sphere.h"
#include "torus.h"
#include "triangle.h"

#define SCENE_SHAPE_MEMBER(feature, Type, name, names) global const Type *names;
typedef struct {
    global const SceneHeader *header;
    SHAPE_LIST(SCENE_SHAPE_MEMBER)
    global const TriangleNormals *triangle_normals;
    global const TriangleUvs *triangle_uvs;
    global const BvhNode *nodes;
    global const ObjectEntry *objects;
    global const Material *materials;
    global const Light *lights;
    global const TextureLevel *texture_levels;
    global const Texel *texels;
    global uint *ray_counts; // of each RAYS_…; NULL unless rays are counted
} Scene;

// The scene's arrays as kernel arguments, and the Scene made of them: the same list in the same order in each
// kernel.
#define SCENE_SHAPE_ARGUMENT(feature, Type, name, names) global const Type *names,
#define SCENE_ARGUMENTS                                                                                      \
    global const SceneHeader *header,                                                                        \
        SHAPE_LIST(SCENE_SHAPE_ARGUMENT) global const TriangleNormals *triangle_normals,                     \
        global const TriangleUvs *triangle_uvs, global const BvhNode *nodes,                                 \
        global const ObjectEntry *objects, global const Material *materials, global const Light *lights,     \
        global const TextureLevel *texture_levels, global const Texel *texels
#define SCENE_SHAPE_VALUE(feature, Type, name, names) names,
#define SCENE_FROM_ARGUMENTS                                                                                 \
    {                                                                                                        \
        header, SHAPE_LIST(SCENE_SHAPE_VALUE) triangle_normals, triangle_uvs, nodes, objects, materials,     \
            lights, texture_levels, texels, 0                                                                \
    }

// Adds the lanes to a count, in a counting build only.
static inline void rays_count(const Scene *scene, uint what, mask rays)
{
    if (!IS_COUNTING) return;
    IntegerLanes counted = {rays};
    uint count = 0;
    for (uint lane = 0; lane < LANES; lane++)
        count += counted.each[lane] != 0;
    if (count > 0) atomic_add(&scene->ray_counts[what], count);
}

// A ray's way through the scene: to its closest hit, or only to whether anything blocks it.
typedef struct {
    Hit hit;
    mask open;       // the lanes that are still looking
    bool any;        // a hit takes light from a lane, all of it unless the object is transparent
    integer opacity; // that the lanes met, in steps of -log2
} Search;

#if IS_DOUBLE
#define OPACITY_STEPS   0x1p48
#define LN_2            0x1.62e42fefa39efp-1
#define OPACITY_LARGEST 0x7f000000000000L
#else
#define OPACITY_STEPS   0x1p24f
#define LN_2            0x1.62e43p-1f
#define OPACITY_LARGEST OPAQUE
#endif

static inline integer opacity_of(const Scene *scene, uint id)
{
    uint4 steps = scene->materials[scene->objects[id].kind_index_material.z].opacity;
#if IS_DOUBLE
    return (integer)(steps.x == OPAQUE ? OPACITY_LARGEST : upsample(as_int(steps.z), steps.y));
#else
    return (integer)((scalar_integer)steps.x);
#endif
}

// Takes an object's light away from the lanes that meet it; a lane without light is closed.
static inline void search_darken(Search *search, const Scene *scene, mask found, uint id)
{
    if (!HAS_TRANSMISSION) {
        search->open = search->open & !found;
        return;
    }
    integer opacity = opacity_of(scene, id);
    const integer largest = (integer)(OPACITY_LARGEST);
    // a sum beyond the largest stays there
    integer sum = lanes_select(search->opacity < largest - opacity, search->opacity + opacity, largest);
    search->opacity = lanes_select(found, sum, search->opacity);
    search->open = search->open & (search->opacity < largest);
}

// Keeps a crossing that is nearer, or as near and of a lower id: the picture does not depend on the objects'
// order.
static inline void search_take(Search *search, const Scene *scene, mask found, real t, uint id)
{
    if (search->any) {
        search_darken(search, scene, found & (t < search->hit.t), id);
        return;
    }
    Hit *hit = &search->hit;
    integer object = (integer)((scalar_integer)id);
    mask tie = (t == hit->t) & (object < hit->object);
    mask closer = found & ((t < hit->t) | tie);
    hit->t = lanes_select(closer, t, hit->t);
    hit->object = lanes_select(closer, object, hit->object);
}

// Tests shapes first .. last - 1 of one kind.
static inline void search_shapes(Search *search, const Scene *scene, const Ray *ray, uint kind, uint first,
                                 uint last)
{
#define SEARCH_SHAPES(feature, Type, name, names)                                                            \
    if (HAS_##feature && kind == KIND_##feature) {                                                           \
        for (uint i = first; i < last; i++) {                                                                \
            Type shape = scene->names[i];                                                                    \
            real t = ray->far;                                                                               \
            mask found = name##_hit(&shape, ray, &t);                                                        \
            if (!lanes_any(found)) continue;                                                                 \
            search_take(search, scene, found, t, shape.id.x);                                                \
            if (search->any && !lanes_any(search->open)) break;                                              \
        }                                                                                                    \
    }
    SHAPE_LIST(SEARCH_SHAPES)
}

// Where the ray enters a box, or LARGEST where it does not before `limit`. The box counts as larger by the
// slack that origin_up and origin_down hold, so that no hit is lost to rounding: neither the box's nor the
// shape's own.
static inline real bvh_enter(scalar4 low, scalar4 high, const Ray *ray, real limit)
{
    real to_low_x = ((real)(low.x) - ray->origin_up.x) * ray->inverse.x;
    real to_low_y = ((real)(low.y) - ray->origin_up.y) * ray->inverse.y;
    real to_low_z = ((real)(low.z) - ray->origin_up.z) * ray->inverse.z;
    real to_high_x = ((real)(high.x) - ray->origin_down.x) * ray->inverse.x;
    real to_high_y = ((real)(high.y) - ray->origin_down.y) * ray->inverse.y;
    real to_high_z = ((real)(high.z) - ray->origin_down.z) * ray->inverse.z;
    real near = real_max(real_max(real_min(to_low_x, to_high_x), real_min(to_low_y, to_high_y)),
                         real_min(to_low_z, to_high_z));
    real far = real_min(real_min(real_max(to_low_x, to_high_x), real_max(to_low_y, to_high_y)),
                        real_max(to_low_z, to_high_z));
    near = real_max(near, ray->near);
    mask meets = (near <= far) & (near <= limit);
    return lanes_select(meets, near, (real)(LARGEST));
}

// Down the tree, the nearer child first; a packet visits what any of its lanes meets.
static inline void search_bvh(Search *search, const Scene *scene, const Ray *ray)
{
    uint2 children[BVH_DEPTH_LARGEST + 1];
    real nears[BVH_DEPTH_LARGEST + 1];
    uint stacked = 1;
    children[0] = (uint2)(0, BVH_NODE);
    nears[0] = ray->near;
    while (stacked > 0) {
        stacked--;
        if (!lanes_any(search->open & (nears[stacked] <= search->hit.t))) continue;
        uint2 child = children[stacked];
        if (child.y != BVH_NODE) {
            search_shapes(search, scene, ray, child.y & 0xff, child.x, child.x + (child.y >> 8));
            if (search->any && !lanes_any(search->open)) return;
            continue;
        }
        BvhNode node = scene->nodes[child.x];
        real near_0 = bvh_enter(node.low_0, node.high_0, ray, search->hit.t);
        real near_1 = bvh_enter(node.low_1, node.high_1, ray, search->hit.t);
        bool first_nearer = lanes_any(search->open & (near_0 < near_1));
        uint2 far_child = first_nearer ? node.children.zw : node.children.xy;
        uint2 near_child = first_nearer ? node.children.xy : node.children.zw;
        real far_near = first_nearer ? near_1 : near_0;
        real near_near = first_nearer ? near_0 : near_1;
        if (lanes_any(search->open & (far_near < (real)(LARGEST)))) {
            children[stacked] = far_child;
            nears[stacked++] = far_near;
        }
        if (lanes_any(search->open & (near_near < (real)(LARGEST)))) {
            children[stacked] = near_child;
            nears[stacked++] = near_near;
        }
    }
}

// How far a hit may lie outside its primitive's box, for any shape: each test is off by a few u times the
// distance between the ray's start and the shape, across the ray and along it.
static inline void ray_prepare_for_bvh(Ray *ray, global const SceneHeader *header)
{
    real slack = (real)(64 * UNIT_ROUNDOFF) * (vector_magnitude(ray->origin) + (real)(header->extent.x));
    ray->origin_up = (Vector){ray->origin.x + slack, ray->origin.y + slack, ray->origin.z + slack};
    ray->origin_down = (Vector){ray->origin.x - slack, ray->origin.y - slack, ray->origin.z - slack};
}

static OUT_OF_LINE Search scene_search(const Scene *scene, const Ray *ray, bool any)
{
    Search search = {{ray->far, (integer)(-1)}, ray->active, any, (integer)(0)};
    global const uint *counts = (global const uint *)scene->header->counts;
    global const uint *bounded_counts = (global const uint *)scene->header->bounded_counts;
#define SEARCH_PLAINLY(feature, Type, name, names)                                                           \
    if (HAS_##feature)                                                                                       \
        search_shapes(&search, scene, ray, KIND_##feature, bounded_counts[KIND_##feature],                   \
                      counts[KIND_##feature]);
    SHAPE_LIST(SEARCH_PLAINLY)
    if (HAS_BVH) {
        Ray prepared = *ray;
        ray_prepare_for_bvh(&prepared, scene->header);
        search_bvh(&search, scene, &prepared);
    }
    return search;
}

static inline Hit closest_hit(const Scene *scene, const Ray *ray)
{
    return scene_search(scene, ray, false).hit;
}

static inline mask hit_found(const Hit *hit)
{
    return hit->object >= (integer)(0);
}

// How much light passes along each active ray between near and far: 1 where nothing stands, 0 behind anything
// opaque. What is transparent passes its transmission, unbent, once for each object.
static inline real light_passing(const Scene *scene, const Ray *ray)
{
    Search search = scene_search(scene, ray, true);
    const real none = (real)(0), all = (real)(1);
    if (!HAS_TRANSMISSION) return lanes_select(search.open, all, none);
    const real ln2_of_step = (real)(-LN_2 / OPACITY_STEPS);
    real passed = real_exp_negative(real_from_integer(search.opacity) * ln2_of_step);
    return lanes_select(search.open, passed, none);
}

#endif
