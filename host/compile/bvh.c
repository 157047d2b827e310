#include "host/compile/bvh.h"

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/bvh_split.h"
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>

enum {
    // Below this depth ranges are halved by count, which bounds the depth: 25 halvings leave at most 8 of
    // 2^28 primitives, and at most 7 cuts by type follow. Ranges of 16 fit a leaf only if all are triangles
    // or spheres: 24 halvings and a cut. With blocks of 4, 26 halvings leave 4, and at most 3 cuts follow.
    HALVING_DEPTH = BVH_DEPTH_MAX - (25 + 7),
    THREAD_RANGE_MIN = 8192 // below it a thread costs more than it saves
};

typedef struct {
    const Bounds *boxes;
    const uint8_t *types;
    double scale; // of the references' coordinates
    size_t count;
    BvhLeaves leaves;
    PrimitiveReference *references;
    BvhBinaryNode *nodes;
    atomic_size_t node_count;
    atomic_uint depth;
    atomic_int idle_threads;
    pthread_mutex_t lock; // of `bounds`
    RangeBounds bounds;   // of all
    Stage *stage;
} Builder;

typedef struct {
    size_t begin, end;
    RangeBounds bounds;
} PrimitiveRange;

static BvhChild range_build(Builder *builder, const PrimitiveRange *range, unsigned depth);

static void range_sort_by_type(const Builder *builder, const PrimitiveRange *range)
{
    PrimitiveReference *references = builder->references;
    for (size_t i = range->begin + 1; i < range->end; i++) {
        const PrimitiveReference moving = references[i];
        const uint8_t type = reference_type(&moving);
        size_t place = i;
        for (; place > range->begin && reference_type(&references[place - 1]) > type; place--)
            references[place] = references[place - 1];
        references[place] = moving;
    }
}

// Returns the first primitive of another type than the first, or `end` if all are of one type.
static size_t range_type_boundary(const Builder *builder, const PrimitiveRange *range)
{
    const PrimitiveReference *references = builder->references;
    const uint8_t type = reference_type(&references[range->begin]);
    size_t boundary = range->begin + 1;
    while (boundary < range->end && reference_type(&references[boundary]) == type)
        boundary++;
    return boundary;
}

// Sets both sides of a range. Returns false if the range is to be a leaf.
static bool range_divide(const Builder *builder, const PrimitiveRange *range, unsigned depth,
                         PrimitiveRange sides[2])
{
    PrimitiveReference *references = builder->references + range->begin;
    const size_t count = range->end - range->begin;
    size_t left = count;
    RangeBounds bounds[2];
    if (depth < HALVING_DEPTH && count > 1)
        left = range_split(references, count, &range->bounds, builder->leaves,
                           depth == 0 && count >= THREAD_RANGE_MIN, bounds);
    if (left == count) {
        const bool fits = range_fits_leaf(references, count, builder->leaves);
        if (fits) range_sort_by_type(builder, range);
        left = fits ? range_type_boundary(builder, range) - range->begin : count / 2;
        if (left == count && count > 1 && reference_type(references) == TYPE_INSTANCES) left = count / 2;
        if (left == count) return false;
        bounds[0] = range_bounds_of(references, left);
        bounds[1] = range_bounds_of(references + left, count - left);
    }
    sides[0] = (PrimitiveRange){range->begin, range->begin + left, bounds[0]};
    sides[1] = (PrimitiveRange){range->begin + left, range->end, bounds[1]};
    return true;
}

typedef struct {
    Builder *builder;
    const PrimitiveRange *range;
    unsigned depth;
    BvhChild *child;
} RangeTask;

static void *range_task_run(void *context)
{
    RangeTask *task = context;
    *task->child = range_build(task->builder, task->range, task->depth);
    atomic_fetch_add(&task->builder->idle_threads, 1);
    return NULL;
}

// Builds both sides of a node, in two threads if one is idle and the range is large enough.
static void sides_build(Builder *builder, const PrimitiveRange sides[2], unsigned depth, BvhBinaryNode *node)
{
    const bool large = sides[1].end - sides[0].begin >= THREAD_RANGE_MIN;
    if (large && atomic_fetch_sub(&builder->idle_threads, 1) > 0) {
        RangeTask task = {builder, &sides[0], depth, &node->children[0]};
        pthread_t thread;
        if (pthread_create(&thread, NULL, range_task_run, &task) == 0) {
            node->children[1] = range_build(builder, &sides[1], depth);
            pthread_join(thread, NULL);
            return;
        }
    }
    if (large) atomic_fetch_add(&builder->idle_threads, 1);
    node->children[0] = range_build(builder, &sides[0], depth);
    node->children[1] = range_build(builder, &sides[1], depth);
}

static void depth_record(Builder *builder, unsigned depth)
{
    unsigned deepest = atomic_load(&builder->depth);
    while (depth > deepest && !atomic_compare_exchange_weak(&builder->depth, &deepest, depth)) {
    }
}

static BvhChild leaf_make(const Builder *builder, const PrimitiveRange *range)
{
    BvhChild leaf = {bounds_empty(), (uint32_t)range->begin, (uint32_t)(range->end - range->begin)};
    for (size_t i = range->begin; i < range->end; i++)
        leaf.box = bounds_join(leaf.box, builder->boxes[reference_index(&builder->references[i])]);
    stage_add(builder->stage, leaf.count);
    return leaf;
}

// Prefetches the boxes, which may be anywhere in memory, of a range that becomes leaves soon.
static void boxes_prefetch(const Builder *builder, const PrimitiveRange *range)
{
    const unsigned size_max = builder->leaves.size_max, block_size = builder->leaves.block_size;
    if (range->end - range->begin > (size_max > block_size ? size_max : block_size)) return;
    for (size_t i = range->begin; i < range->end; i++)
        __builtin_prefetch(&builder->boxes[reference_index(&builder->references[i])]);
}

// Builds the tree of a range. Boxes are joined from the primitives up, in double.
static BvhChild range_build(Builder *builder, const PrimitiveRange *range, unsigned depth)
{
    boxes_prefetch(builder, range);
    PrimitiveRange sides[2];
    if (!range_divide(builder, range, depth, sides)) return leaf_make(builder, range);
    const size_t index = atomic_fetch_add(&builder->node_count, 1);
    depth_record(builder, depth + 1);
    BvhBinaryNode *node = &builder->nodes[index];
    sides_build(builder, sides, depth + 1, node);
    return (BvhChild){bvh_node_bounds(node), (uint32_t)index, 0};
}

static double largest_coordinate(const Bounds *boxes, size_t count)
{
    Bounds all = {{0, 0, 0}, {0, 0, 0}};
    for (size_t i = 0; i < count; i++)
        all = bounds_join(all, boxes[i]);
    return fmax(vector_largest(all.min), vector_largest(all.max));
}

static void references_make(void *context, size_t begin, size_t end)
{
    Builder *builder = context;
    for (size_t i = begin; i < end; i++)
        builder->references[i] =
            reference_make(builder->boxes[i], builder->scale, (uint32_t)i, builder->types[i]);
    const RangeBounds bounds = range_bounds_of(builder->references + begin, end - begin);
    pthread_mutex_lock(&builder->lock);
    builder->bounds = range_bounds_join(builder->bounds, bounds);
    pthread_mutex_unlock(&builder->lock);
}

// Builds the tree with its root as node 0. A single leaf becomes the root's only child.
static void root_build(Builder *builder)
{
    const PrimitiveRange all = {0, builder->count, builder->bounds};
    const BvhChild none = {bounds_empty(), 0, 0};
    const BvhChild root = builder->count > 0 ? range_build(builder, &all, 0) : none;
    if (builder->node_count > 0) return;
    builder->nodes[0] = (BvhBinaryNode){{root, none}};
    builder->node_count = 1;
    builder->depth = builder->count > 0;
}

void bvh_build(Bvh *bvh, const Bounds *boxes, const uint8_t *types, size_t count, BvhLeaves leaves,
               Stage *stage)
{
    const double largest = largest_coordinate(boxes, count);
    Builder builder = {
        .boxes = boxes,
        .types = types,
        .scale = largest > 0 ? 1 / largest : 1,
        .count = count,
        .leaves = leaves,
        .references = memory_allocate_large(count, sizeof *builder.references),
        .nodes = memory_allocate_large(count + 1, sizeof *builder.nodes),
        .idle_threads = (int)sysconf(_SC_NPROCESSORS_ONLN) - 1,
        .lock = PTHREAD_MUTEX_INITIALIZER,
        .bounds = range_bounds_empty(),
        .stage = stage,
    };
    parallel_run(count, THREAD_RANGE_MIN, references_make, &builder);
    root_build(&builder);
    *bvh = (Bvh){
        .nodes = builder.nodes,
        .node_count = builder.node_count,
        .order = memory_allocate(count, sizeof *bvh->order),
        .types = memory_allocate(count, 1),
        .primitive_count = count,
        .depth = builder.depth,
        .leaves = leaves,
    };
    for (size_t i = 0; i < count; i++) {
        bvh->order[i] = reference_index(&builder.references[i]);
        bvh->types[i] = reference_type(&builder.references[i]);
    }
    free(builder.references);
}

void bvh_free(Bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->order);
    free(bvh->types);
    *bvh = (Bvh){0};
}
