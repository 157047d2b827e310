#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/bvh_widen.h"
#include "host/compile/instances.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// From this many bounded primitives on, a BVH is faster than a test of each.
enum { BVH_WORTHWHILE = 24 };

// A primitive this many times as large as all others together, by the longest edges of their boxes, stays
// outside the BVH, such as a planet below a town. Most rays hit it anyway, and the slack of boxes, which
// grows with their common bounds, would be as large as the town. Two of the same size both stay in.
enum { HUGE_RATIO = 16 };

// The bounded primitives that the BVH is built from.
typedef struct {
    Bounds *boxes;
    uint8_t *types;
    uint32_t *places; // in their shapes' arrays
    size_t count;
    uint32_t type_counts[TYPE_COUNT];
} Bounded;

typedef struct {
    const FlatArray *array;
    size_t type;
    Bounds *boxes; // of the array's primitives; empty if unbounded
} Boxing;

static void range_box(void *context, size_t begin, size_t end)
{
    const Boxing *boxing = context;
    for (size_t i = begin; i < end; i++)
        if (!primitive_bounds(boxing->type, flat_array_at(boxing->array, i), &boxing->boxes[i]))
            boxing->boxes[i] = bounds_empty();
}

static void bounded_collect(Bounded *bounded, const CompiledScene *compiled)
{
    size_t capacity = 0;
    for (size_t type = 0; type < TYPE_COUNT; type++)
        capacity += compiled->arrays[FLAT_FIRST_SHAPE + type].count;
    *bounded = (Bounded){
        .boxes = memory_allocate(capacity + 1, sizeof(Bounds)),
        .types = memory_allocate(capacity + 1, 1),
        .places = memory_allocate(capacity + 1, sizeof(uint32_t)),
    };
    for (size_t type = 0; type < TYPE_COUNT; type++) {
        const FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
        Boxing boxing = {array, type, bounded->boxes + bounded->count};
        parallel_run(array->count, FLAT_RANGE_MIN, range_box, &boxing);
        for (size_t i = 0; i < array->count; i++) {
            if (bounds_is_empty(&boxing.boxes[i])) continue;
            bounded->boxes[bounded->count] = boxing.boxes[i];
            bounded->types[bounded->count] = (uint8_t)type;
            bounded->places[bounded->count++] = (uint32_t)i;
            bounded->type_counts[type]++;
        }
    }
}

static double box_size(const Bounds *box)
{
    const Vector3 extent = vector_subtract(box->max, box->min);
    return fmax(extent.x, fmax(extent.y, extent.z));
}

static void bounded_remove(Bounded *bounded, size_t index)
{
    bounded->type_counts[bounded->types[index]]--;
    const size_t left = --bounded->count - index;
    memmove(&bounded->boxes[index], &bounded->boxes[index + 1], left * sizeof *bounded->boxes);
    memmove(&bounded->types[index], &bounded->types[index + 1], left * sizeof *bounded->types);
    memmove(&bounded->places[index], &bounded->places[index + 1], left * sizeof *bounded->places);
}

static void huge_remove(Bounded *bounded)
{
    while (bounded->count > 1) {
        size_t largest = 0;
        for (size_t i = 1; i < bounded->count; i++)
            if (box_size(&bounded->boxes[i]) > box_size(&bounded->boxes[largest])) largest = i;
        const double size = box_size(&bounded->boxes[largest]);
        Bounds others = bounds_empty();
        for (size_t i = 0; i < bounded->count; i++) {
            if (i == largest) continue;
            others = bounds_join(others, bounded->boxes[i]);
            if (!(size > HUGE_RATIO * box_size(&others))) return; // also if all are one point
        }
        bounded_remove(bounded, largest);
    }
}

static void bounded_free(Bounded *bounded)
{
    free(bounded->boxes);
    free(bounded->types);
    free(bounded->places);
}

// Returns each primitive's index in its shape's new array, in the tree's order.
static uint32_t *order_in_types(const Bvh *bvh)
{
    uint32_t *order = memory_allocate(bvh->primitive_count + 1, sizeof *order);
    uint32_t counts[TYPE_COUNT] = {0};
    for (size_t i = 0; i < bvh->primitive_count; i++)
        order[i] = counts[bvh->types[i]]++;
    return order;
}

// Moves the struct at from[i] to i for every i, cycle by cycle in place, which saves a second array.
// Destroys `from`.
static void array_permute(FlatArray *array, uint32_t *from)
{
    enum { CACHE_LINE = 64 };
    const size_t size = array->layout.size;
    void *first = memory_allocate(1, size);
    for (uint32_t i = 0; i < array->count; i++) {
        if (from[i] == i) continue;
        memcpy(first, flat_array_at(array, i), size);
        uint32_t place = i;
        while (from[place] != i) {
            const uint32_t next = from[place];
            const char *later = flat_array_at(array, from[from[next]]);
            for (size_t k = 0; k < size; k += CACHE_LINE)
                __builtin_prefetch(later + k, 1);
            memcpy(flat_array_at(array, place), flat_array_at(array, next), size);
            from[place] = place;
            place = next;
        }
        memcpy(flat_array_at(array, place), first, size);
        from[place] = place;
    }
    free(first);
}

typedef struct {
    const CompiledScene *compiled;
    const FlatArray *array;
    ObjectEntry *entries;
} Entering;

static void range_enter(void *context, size_t begin, size_t end)
{
    const Entering *entering = context;
    for (size_t i = begin; i < end; i++) {
        const uint32_t id = *flat_id(entering->array, flat_array_at(entering->array, i));
        entering->entries[entry_of_id(entering->compiled, id)].type_index_material.y = (uint32_t)i;
    }
}

// Moves a shape's primitives into the leaves' order, those outside the tree behind them, and updates the
// objects' entries.
static void array_reorder(CompiledScene *compiled, size_t type, const Bvh *bvh, const Bounded *bounded)
{
    FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
    if (array->count == 0) return;
    uint32_t *from = memory_allocate(array->count, sizeof *from);
    bool *in_tree = memory_allocate_zeroed(array->count, sizeof *in_tree);
    size_t count = 0;
    for (size_t i = 0; i < bvh->primitive_count; i++) {
        if (bvh->types[i] != type) continue;
        from[count] = bounded->places[bvh->order[i]];
        in_tree[from[count++]] = true;
    }
    for (size_t i = 0; count < array->count; i++)
        if (!in_tree[i]) from[count++] = (uint32_t)i;
    free(in_tree);
    array_permute(array, from);
    free(from);
    Entering entering = {compiled, array, compiled->arrays[FLAT_OBJECTS].items};
    parallel_run(array->count, FLAT_RANGE_MIN, range_enter, &entering);
}

// Returns an inverted box outside the scene for unused child slots. A distant ray may still enter it through
// rounding; the slot then has no primitives.
static Bounds empty_place(const Bounds *bounds)
{
    Vector3 extent = vector_subtract(bounds->max, bounds->min);
    return (Bounds){vector_add(bounds->max, extent), vector_subtract(bounds->min, extent)};
}

// The parts of a node of FLAT_NODES.
typedef struct {
    double *planes;
    uint32_t *child_index, *child_type;
    unsigned width;
} FlatNode;

static FlatNode flat_node_at(const FlatArray *nodes, size_t index)
{
    const unsigned width = (unsigned)(4 * nodes->layout.scalar4_count / BVH_PLANES);
    double *planes = flat_array_at(nodes, index);
    uint32_t *child_index = (void *)(planes + (size_t)BVH_PLANES * width);
    return (FlatNode){planes, child_index, child_index + width, width};
}

static void child_box_write(const FlatNode *node, unsigned child, const Bounds *box)
{
    const double low[3] = {box->min.x, box->min.y, box->min.z};
    const double high[3] = {box->max.x, box->max.y, box->max.z};
    for (unsigned axis = 0; axis < 3; axis++) {
        node->planes[(BVH_LOW + axis) * node->width + child] = low[axis];
        node->planes[(BVH_HIGH + axis) * node->width + child] = high[axis];
    }
}

static void node_write(const BvhWideNode *wide, const Bvh *bvh, const uint32_t *order, const Bounds *empty,
                       const FlatNode *node)
{
    uint32_t next_node = wide->first_node;
    for (unsigned i = 0; i < node->width; i++) {
        const BvhChild *child = i < wide->child_count ? wide->children[i] : NULL;
        child_box_write(node, i, child ? &child->box : empty);
        if (child && child->count > 0) {
            node->child_index[i] = order[child->first];
            node->child_type[i] = child->count << 8 | bvh->types[child->first];
        } else if (child) {
            node->child_index[i] = next_node++;
            node->child_type[i] = BVH_NODE;
        }
    }
}

static void nodes_write(CompiledScene *compiled, const Bvh *bvh, unsigned width)
{
    BvhWide wide;
    bvh_widen(&wide, bvh, width);
    flat_wide_array_renew(compiled, FLAT_NODES, wide.node_count, width, false);
    const FlatArray *nodes = &compiled->arrays[FLAT_NODES];
    // a visit replaces a node by at most `width` children, because a distant ray may enter the empty slots
    compiled->pending_children_max = (width - 1) * wide.depth + 1;
    uint32_t *order = order_in_types(bvh);
    const Bounds bounds = bvh_node_bounds(&bvh->nodes[0]), empty = empty_place(&bounds);
    for (size_t i = 0; i < wide.node_count; i++) {
        const FlatNode node = flat_node_at(nodes, i);
        node_write(&wide.nodes[i], bvh, order, &empty, &node);
    }
    free(order);
    bvh_wide_free(&wide);
}

// One block of FLAT_SPHERE_BLOCKS.
typedef struct {
    double *rows;
    uint32_t *ids, *places;
    size_t width;
} FlatSphereBlock;

static FlatSphereBlock sphere_block_at(const CompiledScene *compiled, size_t block)
{
    const FlatArray *blocks = &compiled->arrays[FLAT_SPHERE_BLOCKS];
    const size_t width = 4 * blocks->layout.scalar4_count / SPHERE_ROWS;
    double *rows = flat_array_at(blocks, block);
    uint32_t *ids = (void *)(rows + SPHERE_ROWS * width);
    return (FlatSphereBlock){rows, ids, ids + width, width};
}

// Returns whether a child is a leaf that kernels with several lanes read as a block.
static bool is_block(uint32_t child_type)
{
    const unsigned type = leaf_type(child_type);
    return leaf_count(child_type) > 0 && type_has_blocks(type);
}

// Returns the index of a block's first primitive, to be read or set.
static uint32_t *block_place(const CompiledScene *compiled, unsigned type, size_t block)
{
    if (type == TYPE_SPHERES) return sphere_block_at(compiled, block).places;
    return (uint32_t *)compiled->arrays[FLAT_BLOCK_PLACES].items + block;
}

// Makes a block for each leaf of triangles or spheres, but does not fill it.
static void blocks_place(CompiledScene *compiled, unsigned width, bool is_double)
{
    const FlatArray *nodes = &compiled->arrays[FLAT_NODES];
    size_t counts[TYPE_COUNT] = {0};
    for (size_t i = 0; i < nodes->count; i++)
        for (unsigned k = 0; k < width; k++) {
            const uint32_t child_type = flat_node_at(nodes, i).child_type[k];
            if (is_block(child_type)) counts[leaf_type(child_type)]++;
        }
    flat_wide_array_renew(compiled, FLAT_TRIANGLE_BLOCKS, counts[TYPE_TRIANGLES], width, !is_double);
    flat_wide_array_renew(compiled, FLAT_SPHERE_BLOCKS, counts[TYPE_SPHERES], width, false);
    flat_array_renew(compiled, FLAT_BLOCK_PLACES, (counts[TYPE_TRIANGLES] + 3) / 4);
    uint32_t next[TYPE_COUNT] = {0};
    for (size_t i = 0; i < nodes->count; i++) {
        const FlatNode node = flat_node_at(nodes, i);
        for (unsigned k = 0; k < width; k++) {
            if (!is_block(node.child_type[k])) continue;
            const unsigned type = leaf_type(node.child_type[k]);
            *block_place(compiled, type, next[type]) = node.child_index[k];
            node.child_index[k] = next[type]++;
        }
    }
}

static size_t blocks_count(const CompiledScene *compiled)
{
    return compiled->arrays[FLAT_TRIANGLE_BLOCKS].count + compiled->arrays[FLAT_SPHERE_BLOCKS].count;
}

static void triangle_block_fill(const CompiledScene *compiled, size_t block, unsigned count)
{
    const FlatArray *blocks = &compiled->arrays[FLAT_TRIANGLE_BLOCKS],
                    *triangles = &compiled->arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES];
    // floats are narrowed here because the blocks of a million triangles take 130 MB as doubles
    const bool is_double = blocks->layout.scalar4_count > 0;
    const size_t width = 4 * (blocks->layout.scalar4_count + blocks->layout.uint4_count) / BLOCK_ROWS;
    const size_t first = *block_place(compiled, TYPE_TRIANGLES, block);
    void *rows = flat_array_at(blocks, block);
    for (size_t lane = 0; lane < width; lane++) {
        const Triangle *triangle = flat_array_at(triangles, first + (lane < count ? lane : 0));
        const double vertices[BLOCK_ROWS] = {triangle->a.x, triangle->a.y, triangle->a.z,
                                             triangle->b.x, triangle->b.y, triangle->b.z,
                                             triangle->c.x, triangle->c.y, triangle->c.z};
        for (size_t row = 0; row < BLOCK_ROWS; row++)
            if (is_double)
                ((double *)rows)[row * width + lane] = vertices[row];
            else
                ((float *)rows)[row * width + lane] = (float)vertices[row];
    }
}

static void sphere_block_fill(const CompiledScene *compiled, size_t index, unsigned count)
{
    const FlatSphereBlock block = sphere_block_at(compiled, index);
    for (unsigned lane = 0; lane < block.width; lane++) {
        block.places[lane] = block.places[0] + (lane < count ? lane : 0);
        const Sphere *sphere =
            flat_array_at(&compiled->arrays[FLAT_FIRST_SHAPE + TYPE_SPHERES], block.places[lane]);
        block.rows[lane] = sphere->center_radius.x;
        block.rows[block.width + lane] = sphere->center_radius.y;
        block.rows[2 * block.width + lane] = sphere->center_radius.z;
        // never rejected with HAS_POWER
        block.rows[3 * block.width + lane] =
            fmax(sphere->center_radius.w, sphere->id.y & HAS_POWER ? FLT_MAX : 0);
        block.ids[lane] = sphere->id.x | (sphere->id.y != 0 ? SPHERE_HAS_FLAGS : 0);
    }
}

static void nodes_fill_blocks(void *context, size_t begin, size_t end)
{
    const CompiledScene *compiled = context;
    for (size_t i = begin; i < end; i++) {
        const FlatNode node = flat_node_at(&compiled->arrays[FLAT_NODES], i);
        for (unsigned k = 0; k < node.width; k++) {
            if (!is_block(node.child_type[k])) continue;
            const unsigned type = leaf_type(node.child_type[k]), count = leaf_count(node.child_type[k]);
            if (type == TYPE_SPHERES)
                sphere_block_fill(compiled, node.child_index[k], count);
            else
                triangle_block_fill(compiled, node.child_index[k], count);
        }
    }
}

// Copies the triangles' vertices and the spheres into the blocks.
static void blocks_fill(CompiledScene *compiled)
{
    if (blocks_count(compiled) == 0) return;
    compiled->changed[FLAT_TRIANGLE_BLOCKS] = compiled->changed[FLAT_SPHERE_BLOCKS] = true;
    parallel_run(compiled->arrays[FLAT_NODES].count, FLAT_RANGE_MIN / 16, nodes_fill_blocks, compiled);
}

// Returns the leaf sizes that measured best. A block costs the same whatever its size. Splits that count
// blocks save 6 % of a frame of a million triangles, but cost 6 % where half of the primitives are cylinders
// among spheres, 1 % where a tenth are, and nothing where a thirtieth are.
static BvhLeaves leaves_for(const Bounded *bounded, unsigned lanes)
{
    enum { LEAF_SIZE_MAX = 8 };
    if (lanes <= 1) return (BvhLeaves){LEAF_SIZE_MAX, 0, false};
    const size_t others =
        bounded->count - bounded->type_counts[TYPE_TRIANGLES] - bounded->type_counts[TYPE_SPHERES];
    return (BvhLeaves){LEAF_SIZE_MAX, lanes, 16 * others < bounded->count};
}

// Builds the BVH of the bounded primitives and puts them in its order.
static void tree_flatten(CompiledScene *compiled, const CompileSettings *settings, Bounded *bounded)
{
    Bvh bvh;
    stage_begin(settings->stage, "building the BVH", NULL, bounded->count);
    bvh_build(&bvh, bounded->boxes, bounded->types, bounded->count, leaves_for(bounded, settings->lanes),
              settings->stage);
    free(bounded->boxes);
    bounded->boxes = NULL;
    stage_begin(settings->stage, "widening the BVH", NULL, 0);
    nodes_write(compiled, &bvh, settings->lanes < BVH_WIDTH_MIN ? BVH_WIDTH_MIN : settings->lanes);
    if (settings->lanes > 1) blocks_place(compiled, settings->lanes, settings->precision == PRECISION_DOUBLE);
    compiled->bvh_bounds = bvh_node_bounds(&bvh.nodes[0]);
    free(bvh.nodes);
    bvh.nodes = NULL;
    for (size_t type = 0; type < TYPE_COUNT; type++)
        array_reorder(compiled, type, &bvh, bounded);
    blocks_fill(compiled);
    memcpy(compiled->bvh_counts, bounded->type_counts, sizeof compiled->bvh_counts);
    bvh_free(&bvh);
}

static void tree_arrays_renew(CompiledScene *compiled)
{
    flat_array_renew(compiled, FLAT_NODES, 1); // empty, since a kernel may visit it
    flat_wide_array_renew(compiled, FLAT_TRIANGLE_BLOCKS, 0, BVH_WIDTH_MIN, false);
    flat_wide_array_renew(compiled, FLAT_SPHERE_BLOCKS, 0, BVH_WIDTH_MIN, false);
    flat_array_renew(compiled, FLAT_BLOCK_PLACES, 0);
}

void bvh_flatten(CompiledScene *compiled, const CompileSettings *settings)
{
    tree_arrays_renew(compiled);
    if (settings->bvh == BVH_OFF) return;
    Bounded bounded;
    bounded_collect(&bounded, compiled);
    huge_remove(&bounded);
    if (bounded.count >= (settings->bvh == BVH_ON ? 1 : BVH_WORTHWHILE)) {
        compiled->features |= FEATURE_BVH;
        tree_flatten(compiled, settings, &bounded);
    }
    bounded_free(&bounded);
}

void mesh_bvh_flatten(CompiledScene *compiled, const CompileSettings *settings)
{
    tree_arrays_renew(compiled);
    Bounded bounded;
    bounded_collect(&bounded, compiled);
    tree_flatten(compiled, settings, &bounded);
    bounded_free(&bounded);
}

void bvh_shift(CompiledScene *compiled, uint32_t node_base, uint32_t leaf_base)
{
    for (size_t i = 0; i < compiled->arrays[FLAT_NODES].count; i++) {
        const FlatNode node = flat_node_at(&compiled->arrays[FLAT_NODES], i);
        for (unsigned k = 0; k < node.width; k++)
            if (node.child_type[k] != BVH_EMPTY)
                node.child_index[k] += node.child_type[k] == BVH_NODE ? node_base : leaf_base;
    }
}

// Fits the boxes of leaves to their primitives.
static void leaves_fit(void *context, size_t begin, size_t end)
{
    const CompiledScene *compiled = context;
    const bool has_blocks = blocks_count(compiled) > 0;
    for (size_t i = begin; i < end; i++) {
        const FlatNode node = flat_node_at(&compiled->arrays[FLAT_NODES], i);
        for (unsigned k = 0; k < node.width; k++) {
            const unsigned type = leaf_type(node.child_type[k]), count = leaf_count(node.child_type[k]);
            if (count == 0) continue;
            const FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
            Bounds all = bounds_empty(), box;
            size_t first = node.child_index[k];
            if (has_blocks && is_block(node.child_type[k])) first = *block_place(compiled, type, first);
            for (size_t p = first; p < first + count; p++)
                if (primitive_bounds(type, flat_array_at(array, p), &box)) all = bounds_join(all, box);
            child_box_write(&node, k, &all);
        }
    }
}

static Bounds node_bounds(const FlatNode *node)
{
    Bounds all = bounds_empty();
    for (unsigned k = 0; k < node->width; k++) {
        if (node->child_type[k] == 0) continue;
        const double *low = node->planes + k, *high = low + (size_t)BVH_HIGH * node->width;
        const size_t y = node->width, z = 2 * y;
        all = bounds_join(all, (Bounds){{low[0], low[y], low[z]}, {high[0], high[y], high[z]}});
    }
    return all;
}

void bvh_refit(CompiledScene *compiled)
{
    uint32_t count = 0;
    for (size_t type = 0; type < TYPE_COUNT; type++)
        count += compiled->bvh_counts[type];
    if (count == 0) return; // no BVH, though the kernel may be built for one
    const FlatArray *nodes = &compiled->arrays[FLAT_NODES];
    compiled->changed[FLAT_NODES] = true;
    parallel_run(nodes->count, FLAT_RANGE_MIN / 16, leaves_fit, compiled);
    blocks_fill(compiled);
    // children come after their parent
    for (size_t i = nodes->count; i-- > 0;) {
        const FlatNode node = flat_node_at(nodes, i);
        for (unsigned k = 0; k < node.width; k++) {
            if (node.child_type[k] != BVH_NODE) continue;
            const FlatNode child = flat_node_at(nodes, node.child_index[k]);
            const Bounds box = node_bounds(&child);
            child_box_write(&node, k, &box);
        }
    }
    const FlatNode root = flat_node_at(nodes, 0);
    compiled->bvh_bounds = node_bounds(&root);
    const Bounds empty = empty_place(&compiled->bvh_bounds);
    for (size_t i = 0; i < nodes->count; i++) {
        const FlatNode node = flat_node_at(nodes, i);
        for (unsigned k = 0; k < node.width; k++)
            if (node.child_type[k] == 0) child_box_write(&node, k, &empty);
    }
}
