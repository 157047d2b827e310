// The scene as the kernels see it, its closest hit and whether anything blocks a ray. Both ask the same
// function of each shape, so that they can never disagree.
#ifndef SCENE_H
#define SCENE_H

#include "shapes/disc.h"
#include "shapes/paraboloid.h"
#include "shapes/plane.h"
#include "shapes/revolution.h"
#include "shapes/sphere.h"
#include "shapes/torus.h"
#include "shapes/triangle.h"
#include "traversal/bvh.h"

#define SCENE_SHAPE_MEMBER(feature, Type, name, names) global const Type *names;
typedef struct {
    global const SceneHeader *header;
    SHAPE_LIST(SCENE_SHAPE_MEMBER)
    global const TriangleNormals *triangle_normals;
    global const TriangleUvs *triangle_uvs;
    global const BvhNode *nodes;
    global const CullSphere *cull_spheres;
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
        global const CullSphere *cull_spheres, global const ObjectEntry *objects,                            \
        global const Material *materials, global const Light *lights,                                        \
        global const TextureLevel *texture_levels, global const Texel *texels
#define SCENE_SHAPE_VALUE(feature, Type, name, names) names,
#define SCENE_FROM_ARGUMENTS                                                                                 \
    {                                                                                                        \
        header, SHAPE_LIST(SCENE_SHAPE_VALUE) triangle_normals, triangle_uvs, nodes, cull_spheres, objects,  \
            materials, lights, texture_levels, texels, 0                                                     \
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
    mask open;   // the lanes that are looking: not those that found enough, nor those whose turn is later
    bool any;    // a hit takes light from a lane, all of it unless the object is transparent
    bool opaque; // only what passes no light counts
    integer optical_depth; // that the lanes met, in steps of -log2
} Search;

#if IS_DOUBLE
#define OPTICAL_DEPTH_STEPS   0x1p48
#define LN_2                  0x1.62e42fefa39efp-1
#define OPTICAL_DEPTH_LARGEST 0x7f000000000000L
#else
#define OPTICAL_DEPTH_STEPS   0x1p24f
#define LN_2                  0x1.62e43p-1f
#define OPTICAL_DEPTH_LARGEST OPAQUE
#endif

static inline integer optical_depth_of(const Scene *scene, uint id)
{
    uint4 steps = scene->materials[scene->objects[id].kind_index_material.z].optical_depth;
#if IS_DOUBLE
    return (integer)(steps.x == OPAQUE ? OPTICAL_DEPTH_LARGEST : upsample(as_int(steps.z), steps.y));
#else
    return (integer)((scalar_integer)steps.x);
#endif
}

static inline bool object_is_opaque(const Scene *scene, uint id)
{
    return scene->materials[scene->objects[id].kind_index_material.z].reflection_transmission_ior.y == 0;
}

// Takes an object's light away from the lanes that meet it; a lane without light is closed.
static inline void search_darken(Search *search, const Scene *scene, mask found, uint id)
{
    if (!HAS_TRANSMISSION) {
        search->open = search->open & !found;
        return;
    }
    integer optical_depth = optical_depth_of(scene, id);
    const integer largest = (integer)(OPTICAL_DEPTH_LARGEST);
    // a sum beyond the largest stays there
    integer sum = lanes_select(search->optical_depth < largest - optical_depth,
                               search->optical_depth + optical_depth, largest);
    search->optical_depth = lanes_select(found, sum, search->optical_depth);
    search->open = search->open & (search->optical_depth < largest);
}

// Keeps a crossing that is nearer, or as near and of a lower id: the picture does not depend on the objects'
// order.
static inline void search_take(Search *search, const Scene *scene, mask found, real t, uint id)
{
    if (HAS_TRANSMISSION && search->opaque && !object_is_opaque(scene, id)) return;
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

// The ray's row of cull_spheres, 0 where it has none.
static inline global const CullSphere *ray_cull_spheres(const Scene *scene, const Ray *ray)
{
    uint count = scene->header->cull_spheres.x;
    if (ray->common_origin == COMMON_ORIGIN_NONE || count == 0) return 0;
    return scene->cull_spheres + (size_t)(ray->common_origin - COMMON_ORIGIN_EYE) * count;
}

// How many of the first cull_spheres, up to `count`, all lanes' lines miss.
static inline uint cull_spheres_missed(global const CullSphere *cull_spheres, uint count, const Ray *ray)
{
    uint missed = 0;
    while (missed < count && lanes_all(ray_misses_cull_sphere(ray, &cull_spheres[missed])))
        missed++;
    return missed;
}

// Starts to fetch what is read of the closest hit.
static inline void object_fetch(const Scene *scene, uint kind, uint4 id)
{
    memory_prefetch((global const char *)&scene->objects[id.x], sizeof(ObjectEntry));
    if (HAS_TRIANGLES && kind == KIND_TRIANGLES && id.y > 0)
        memory_prefetch((global const char *)&scene->triangle_normals[id.y - 1], sizeof(TriangleNormals));
}

// Tests shapes first .. last - 1 of one kind; `cull_spheres`, where there are any, are theirs. Each kind has
// a function of its own: of one for all, Mesa would compile every kind's test at each call, as it inlines
// before it knows which kind is asked for.
#define SEARCH_OF_SHAPE(feature, Type, name, names)                                                          \
    static inline void search_##names(Search *search, const Scene *scene, const Ray *ray, uint first,        \
                                      uint last, global const CullSphere *cull_spheres)                      \
    {                                                                                                        \
        for (uint i = first; i < last; i++) {                                                                \
            if (cull_spheres) i += cull_spheres_missed(cull_spheres + (i - first), last - i, ray);           \
            if (i == last) break;                                                                            \
            Type shape = scene->names[i];                                                                    \
            real t = ray->far;                                                                               \
            mask found = name##_hit(&shape, ray, &t);                                                        \
            if (!lanes_any(found)) continue;                                                                 \
            search_take(search, scene, found, t, shape.id.x);                                                \
            if (!search->any)                                                                                \
                object_fetch(scene, KIND_##feature, shape.id);                                               \
            else if (!lanes_any(search->open))                                                               \
                break;                                                                                       \
        }                                                                                                    \
    }
SHAPE_LIST(SEARCH_OF_SHAPE)

// The same of whichever kind it is.
static inline void search_shapes(Search *search, const Scene *scene, const Ray *ray, uint kind, uint first,
                                 uint last)
{
#define SEARCH_SHAPES(feature, Type, name, names)                                                            \
    if (HAS_##feature && kind == KIND_##feature) search_##names(search, scene, ray, first, last, 0);
    SHAPE_LIST(SEARCH_SHAPES)
}

// No further than this is a lane interested; not at all where it has found what it looked for. Always below
// LARGEST.
static inline real search_limit(const Search *search)
{
    return lanes_select(search->open, real_min(search->hit.t, (real)(LARGEST / 2)), (real)(-LARGEST));
}

// A child on its way to be visited, and where the beam, or the first of its rays, meets its box. Kept small:
// a GPU may set room for all of them aside for each thread.
typedef struct {
    uint first;
    ushort what;
    ushort lanes; // whose rays meet it, as bits
    scalar near;
} StackEntry;

// Each node leaves at most all but one of its children waiting.
#define STACK_LARGEST ((BVH_WIDTH - 1) * BVH_DEPTH_LARGEST + 1)

// Starts to fetch what will be read when its turn comes.
static inline void stack_fetch(const Scene *scene, uint first, uint what)
{
    if (what == BVH_NODE)
        memory_prefetch((global const char *)&scene->nodes[first], sizeof(BvhNode));
    else if (HAS_TRIANGLES && (what & 0xff) == KIND_TRIANGLES)
        memory_prefetch((global const char *)&scene->triangles[first], 4 * sizeof(Triangle));
    else if (HAS_SPHERES && (what & 0xff) == KIND_SPHERES)
        memory_prefetch((global const char *)&scene->spheres[first], sizeof(Sphere));
}

// Makes room for a child among its siblings, which begin at `bottom`: the nearest last, or where
// `farthest_last` that. Returns its place.
static inline uint stack_room(StackEntry *stack, uint bottom, uint count, scalar near, bool farthest_last)
{
    uint place = count;
    for (; place > bottom; place--) {
        StackEntry below = stack[place - 1];
        if (farthest_last ? below.near <= near : below.near >= near) break;
        stack[place] = below;
    }
    return place;
}

// Up to so many lanes are held against a node's boxes one by one at once, which takes no longer than the beam
// and what it lets pass; and up to twice as many are not worth a beam of their own.
#define FEW_LANES (LANES >> 2)

// Puts a node's children that rays meet on the stack, the nearest last; where anything may block them, the
// farthest: what lies around a ray's start, mostly the surface it left, blocks it least. `lanes` are those
// that meet the node and still look.
static inline uint node_open(const Scene *scene, uint index, uint lanes, const Beam *beam,
                             const BoxRays *rays, LaidRays *laid, real limit, scalar beam_limit, bool any,
                             StackEntry *stack, uint count)
{
    global const BvhNode *node = &scene->nodes[index];
    const uint bottom = count;
    global const uint *firsts = (global const uint *)node->first, *whats = (global const uint *)node->what;
    for (uint part = 0; part < BVH_WIDTH; part += LANES) {
        global const scalar *boxes = (global const scalar *)node->planes + part;
        RealLanes nears;
        IntegerLanes met_by;
        uint met = 0;
        // a single ray is its own beam
        bool one_by_one = LANES > 1 && (beam->parted || popcount(lanes) <= FEW_LANES);
        if (!one_by_one) {
            met = lanes_bits(beam_meets(beam, boxes, beam_limit, &nears.all));
            one_by_one = LANES > 1 && popcount(met) > popcount(lanes);
        }
        if (one_by_one) {
            met_by.all = laid_rays_meet(laid, rays, lanes, boxes, limit, &nears.all);
            met = lanes_bits(met_by.all != (integer)(0));
        }
        for (; met != 0; met &= met - 1) {
            uint child = lowest_bit(met), by = 1;
            if (one_by_one)
                by = (uint)met_by.each[child];
            else if (LANES > 1)
                by = lanes_bits(beam_rays_meet(beam, rays, boxes + child, limit));
            if (by == 0) continue;
            scalar near = nears.each[child];
            uint place = stack_room(stack, bottom, count++, near, any);
            stack[place] = (StackEntry){firsts[part + child], (ushort)whats[part + child], (ushort)by, near};
            stack_fetch(scene, firsts[part + child], whats[part + child]);
        }
    }
    return count;
}

// Down the tree; a packet visits what any of its open lanes meets. `open`: these, as bits.
static inline void search_bvh(Search *search, const Scene *scene, const Ray *ray, uint open, const Beam *beam,
                              const BoxRays *rays, LaidRays *laid)
{
    real limit = search_limit(search);
    scalar beam_limit = beam->limit;
    StackEntry stack[STACK_LARGEST], next = {0, BVH_NODE, (ushort)open, beam->near};
    for (uint count = 0;; next = stack[--count]) {
        uint lanes = next.lanes & open;
        if (next.near <= beam_limit && lanes != 0) {
            if (next.what == BVH_NODE) {
                count = node_open(scene, next.first, lanes, beam, rays, laid, limit, beam_limit, search->any,
                                  stack, count);
            } else {
                search_shapes(search, scene, ray, next.what & 0xff, next.first,
                              next.first + (next.what >> 8));
                open = lanes_bits(search->open);
                if (open == 0) return;
                limit = search_limit(search);
                beam_limit = lanes_largest(search->open, limit);
            }
        }
        if (count == 0) return;
    }
}

// Rays of one packet mostly run to the same sides; where they do not, those that do go together, and all
// those with few to go with after them.
static inline void search_hierarchy(Search *search, const Scene *scene, Ray *ray)
{
    global const SceneHeader *header = scene->header;
    global const CullSphere *cull_spheres = ray_cull_spheres(scene, ray);
    if (cull_spheres && cull_spheres_missed(cull_spheres, 1, ray)) return;
    ray_make_frame(ray);
    BoxRays rays = box_rays(ray, header->bounds);
    mask looking = box_rays_meet(&rays, header->bounds_low, header->bounds_high, search_limit(search));
    uint left = lanes_bits(looking & search->open), parted = 0;
    LaidRays laid;
    laid.is_laid = false;
    while ((left | parted) != 0) {
        uint lanes = parted;
        Beam beam;
        if (left != 0) {
            lanes = box_rays_alike(&rays, left);
            left &= ~lanes;
            if (LANES > 1 && popcount(lanes) <= 2 * FEW_LANES) {
                parted |= lanes;
                continue;
            }
            beam = beam_make(&rays, ray, lanes, search_limit(search));
        } else {
            parted = 0;
            beam = beam_parted(lanes, search_limit(search));
        }
        mask members = mask_of_bits(lanes), others = search->open & !members;
        search->open = search->open & members;
        search_bvh(search, scene, ray, lanes, &beam, &rays, &laid);
        search->open = search->open | others;
    }
}

// Tests what does not hang in the hierarchy.
static inline void search_plainly(Search *search, const Scene *scene, Ray *ray)
{
    global const uint *counts = (global const uint *)scene->header->counts;
    global const uint *bounded_counts = (global const uint *)scene->header->bounded_counts;
    uint boxes = HAS_BOXES ? counts[KIND_BOXES] - bounded_counts[KIND_BOXES] : 0;
    uint triangles = HAS_TRIANGLES ? counts[KIND_TRIANGLES] - bounded_counts[KIND_TRIANGLES] : 0;
    if (boxes + triangles > 0) ray_make_frame(ray);
    global const CullSphere *cull_spheres = ray_cull_spheres(scene, ray);
    if (cull_spheres) cull_spheres++; // the hierarchy's
#define SEARCH_PLAINLY(feature, Type, name, names)                                                           \
    if (HAS_##feature && lanes_any(search->open)) {                                                          \
        uint first = bounded_counts[KIND_##feature], last = counts[KIND_##feature];                          \
        bool has_cull_spheres = cull_spheres && KIND_##feature != KIND_PLANES;                               \
        search_##names(search, scene, ray, first, last, has_cull_spheres ? cull_spheres : 0);                \
        if (has_cull_spheres) cull_spheres += last - first;                                                  \
    }
    SHAPE_LIST(SEARCH_PLAINLY)
}

static OUT_OF_LINE Search scene_search(const Scene *scene, Ray *ray, bool any, bool opaque)
{
    Search search = {{ray->far, (integer)(-1)}, ray->active, any, opaque, (integer)(0)};
    search_plainly(&search, scene, ray);
    if (HAS_BVH) search_hierarchy(&search, scene, ray);
    return search;
}

static inline Hit closest_hit(const Scene *scene, Ray *ray)
{
    return scene_search(scene, ray, false, false).hit;
}

static inline Hit closest_opaque_hit(const Scene *scene, Ray *ray)
{
    return scene_search(scene, ray, false, true).hit;
}

// How much light passes along each active ray between near and far: 1 where nothing stands, 0 behind anything
// opaque. What is transparent passes its transmission, unbent, once for each object.
static inline real transmittance(const Scene *scene, Ray *ray)
{
    Search search = scene_search(scene, ray, true, false);
    const real none = (real)(0), all = (real)(1);
    if (!HAS_TRANSMISSION) return lanes_select(search.open, all, none);
    const real ln2_of_step = (real)(-LN_2 / OPTICAL_DEPTH_STEPS);
    real passed = real_exp_negative(real_from_integer(search.optical_depth) * ln2_of_step);
    return lanes_select(search.open, passed, none);
}

#endif
