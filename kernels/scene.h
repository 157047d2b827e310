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
    mask open;       // the lanes that are looking: not those that found enough, nor those whose turn is later
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
        search_darken(search, scene, found & search->open & (t < search->hit.t), id);
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

// A packet's rays as boxes are tested with them. All of them run to the same side along each axis, so that
// which of a box's planes is the near one is known for the packet.
typedef struct {
    Vector inverse;         // 1 / direction, bounded
    Vector to_near, to_far; // a plane's distance is plane * inverse + this
    uint near[3], far[3]; // which of a box's numbers is the near plane along each axis, and which the far one
    uint signs;           // bit i: the direction's component i is negative
} BoxRays;

// A hit may lie outside its primitive's box, for any shape: each test is off by a few u times the distance
// between the ray's start and the shape, across the ray and along it. Rounding the boxes and the products
// here adds a few u of the coordinates. Boxes count as larger by all of that.
//
// Products are bounded: 1 / direction is held below 2^120 (2^1000) over the coordinates, where the ray does
// not move along that axis by as much as the slack, however far it goes.
static inline BoxRays box_rays(const Ray *ray, scalar4 bounds, uint signs)
{
    Vector center = vector_of(bounds);
    real reach = vector_magnitude(vector_subtract(ray->origin, center)) + (real)(bounds.w);
    real coordinates = fma((real)(2), vector_magnitude(center), reach);
    real slack = fma((real)(64 * UNIT_ROUNDOFF), reach, (real)(8 * UNIT_ROUNDOFF) * coordinates);
    const real huge = (real)(1 / SMALLEST_RATIO);
    real largest = real_min(huge * real_inverse_power(coordinates), huge);
    BoxRays rays;
    rays.inverse = (Vector){real_min(real_max(ray->inverse.x, -largest), largest),
                            real_min(real_max(ray->inverse.y, -largest), largest),
                            real_min(real_max(ray->inverse.z, -largest), largest)};
    Vector inverse = rays.inverse;
    Vector to_origin = {-ray->origin.x * inverse.x, -ray->origin.y * inverse.y, -ray->origin.z * inverse.z};
    Vector around = {slack * fabs(inverse.x), slack * fabs(inverse.y), slack * fabs(inverse.z)};
    rays.to_near = vector_subtract(to_origin, around);
    rays.to_far = vector_add(to_origin, around);
    for (uint axis = 0; axis < 3; axis++) {
        rays.near[axis] = axis + (signs >> axis & 1 ? BVH_HIGH : BVH_LOW);
        rays.far[axis] = axis + (signs >> axis & 1 ? BVH_LOW : BVH_HIGH);
    }
    rays.signs = signs;
    return rays;
}

enum { BOX_RAYS_SIGNS = 8 }; // numbers of signs

// Where the rays enter a child's box.
static inline real box_rays_enter(const BoxRays *rays, global const scalar *box, real near)
{
    real x = fma((real)(box[rays->near[0]]), rays->inverse.x, rays->to_near.x);
    real y = fma((real)(box[rays->near[1]]), rays->inverse.y, rays->to_near.y);
    real z = fma((real)(box[rays->near[2]]), rays->inverse.z, rays->to_near.z);
    return real_max(real_max(x, y), real_max(z, near));
}

static inline real box_rays_leave(const BoxRays *rays, global const scalar *box, real limit)
{
    real x = fma((real)(box[rays->far[0]]), rays->inverse.x, rays->to_far.x);
    real y = fma((real)(box[rays->far[1]]), rays->inverse.y, rays->to_far.y);
    real z = fma((real)(box[rays->far[2]]), rays->inverse.z, rays->to_far.z);
    return real_min(real_min(x, y), real_min(z, limit));
}

// No further than this is a lane interested; not at all where it has found what it looked for. Always below
// LARGEST, the place of a box that a lane does not meet.
static inline real search_limit(const Search *search)
{
    return lanes_select(search->open, real_min(search->hit.t, (real)(LARGEST / 2)), (real)(-LARGEST));
}

// Down the tree, the nearer child first; a packet visits what any of its lanes meets.
static inline void search_bvh(Search *search, const Scene *scene, const Ray *ray, const BoxRays *rays)
{
    uint2 waiting[BVH_DEPTH_LARGEST];
    real waiting_nears[BVH_DEPTH_LARGEST];
    uint waiting_count = 0;
    uint2 child = (uint2)(0, BVH_NODE);
    real limit = search_limit(search);
    for (;;) {
        if ((child.y & 0xff) == BVH_NODE) {
            global const BvhNode *node = &scene->nodes[child.x];
            global const scalar *box_0 = (global const scalar *)node->planes, *box_1 = box_0 + BVH_CHILD;
            real near_0 = box_rays_enter(rays, box_0, ray->near);
            real near_1 = box_rays_enter(rays, box_1, ray->near);
            mask meets_0 = near_0 <= box_rays_leave(rays, box_0, limit);
            mask meets_1 = near_1 <= box_rays_leave(rays, box_1, limit);
            bool any_0 = lanes_any(meets_0), any_1 = lanes_any(meets_1);
            uint4 children = node->children;
            if (any_0 & any_1) {
                bool second_nearer = rays->signs >> (children.y >> BVH_AXIS_SHIFT) & 1;
                child = second_nearer ? children.zw : children.xy;
                waiting[waiting_count] = second_nearer ? children.xy : children.zw;
                waiting_nears[waiting_count++] = second_nearer
                                                     ? lanes_select(meets_0, near_0, (real)(LARGEST))
                                                     : lanes_select(meets_1, near_1, (real)(LARGEST));
                continue;
            }
            if (any_0 | any_1) {
                child = any_0 ? children.xy : children.zw;
                continue;
            }
        } else {
            search_shapes(search, scene, ray, child.y & 0xff, child.x, child.x + (child.y >> 8 & 0xff));
            limit = search_limit(search);
        }
        do {
            if (waiting_count == 0) return;
            waiting_count--;
        } while (!lanes_any(waiting_nears[waiting_count] <= limit));
        child = waiting[waiting_count];
    }
}

// Rays of one packet mostly run to the same sides; where they do not, those that do go together.
static inline void search_hierarchy(Search *search, const Scene *scene, const Ray *ray)
{
    const integer none = (integer)(BOX_RAYS_SIGNS);
    Vector d = ray->direction;
    integer signs = lanes_select(d.x < (real)(0), (integer)(1), (integer)(0)) |
                    lanes_select(d.y < (real)(0), (integer)(2), (integer)(0)) |
                    lanes_select(d.z < (real)(0), (integer)(4), (integer)(0));
    integer pending = lanes_select(search->open, signs, none);
    for (;;) {
        scalar_integer first = lanes_smallest(pending);
        if (first == BOX_RAYS_SIGNS) break;
        mask members = pending == (integer)(first), others = search->open & !members;
        pending = lanes_select(members, none, pending);
        search->open = search->open & members;
        BoxRays rays = box_rays(ray, scene->header->bounds, (uint)first);
        search_bvh(search, scene, ray, &rays);
        search->open = search->open | others;
    }
}

static OUT_OF_LINE Search scene_search(const Scene *scene, const Ray *ray, bool any)
{
    Search search = {{ray->far, (integer)(-1)}, ray->active, any, (integer)(0)};
    global const uint *counts = (global const uint *)scene->header->counts;
    global const uint *bounded_counts = (global const uint *)scene->header->bounded_counts;
#define SEARCH_PLAINLY(feature, Type, name, names)                                                           \
    if (HAS_##feature && lanes_any(search.open))                                                             \
        search_shapes(&search, scene, ray, KIND_##feature, bounded_counts[KIND_##feature],                   \
                      counts[KIND_##feature]);
    SHAPE_LIST(SEARCH_PLAINLY)
    if (HAS_BVH) search_hierarchy(&search, scene, ray);
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
