#include "host/compile/bvh.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/compile/flat_types.h"
#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

enum {
    BIN_COUNT = 16,
    SMALL_RANGE = 32, // below it fewer bins, which cost less to fill and to sweep, split as well
    SMALL_BIN_COUNT = 8,
    // Below this depth ranges are halved by count, which bounds the depth: 25 halvings leave at most 8 of
    // 2^28 primitives, and at most 7 cuts by kind follow.
    HALVING_DEPTH = BVH_DEPTH_MAX - (25 + 7),
    THREAD_RANGE_MIN = 8192 // below it a thread costs more than it saves
};

// SAH costs of the binary tree: visiting a node, testing a primitive. (bvh_widen has those of wide nodes.)
static const float traversal_cost = 1, intersection_cost = 1;

typedef float Float4 __attribute__((vector_size(16)));
typedef int32_t Int4 __attribute__((vector_size(16)));

static inline Float4 float4_of(Vector3 v)
{
    return (Float4){(float)v.x, (float)v.y, (float)v.z, 0};
}

// gcc makes no minps of a comparison and a choice.
#ifdef __SSE__
static inline Float4 float4_min(Float4 a, Float4 b)
{
    return _mm_min_ps(a, b);
}

static inline Float4 float4_max(Float4 a, Float4 b)
{
    return _mm_max_ps(a, b);
}
#else
static inline Float4 float4_pick(Int4 take_a, Float4 a, Float4 b)
{
    return (Float4)((take_a & (Int4)a) | (~take_a & (Int4)b));
}

static inline Float4 float4_min(Float4 a, Float4 b)
{
    return float4_pick(a < b, a, b);
}

static inline Float4 float4_max(Float4 a, Float4 b)
{
    return float4_pick(a > b, a, b);
}
#endif

typedef struct {
    Float4 low, high;
} BuildBox;

static const BuildBox empty_box = {{FLT_MAX, FLT_MAX, FLT_MAX, 0}, {-FLT_MAX, -FLT_MAX, -FLT_MAX, 0}};

static inline BuildBox box_join(BuildBox a, BuildBox b)
{
    return (BuildBox){float4_min(a.low, b.low), float4_max(a.high, b.high)};
}

static inline float box_half_area(BuildBox box)
{
    Float4 size = box.high - box.low;
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
}

// A primitive while the tree is built: single precision is enough to choose splits. Scaled so that the
// largest coordinate is about 1, which keeps areas of any scene within range.
typedef struct {
    BuildBox box; // low[3] and high[3] unused
    uint32_t index;
    uint8_t kind;
} PrimitiveReference;

typedef struct {
    PrimitiveReference *references;
    BvhBinaryNode *nodes;
    atomic_size_t node_count;
    atomic_uint depth;
    atomic_int idle_threads;
    Stage *stage;
} Builder;

typedef struct {
    size_t begin, end;
} Range;

static void range_build(Builder *builder, Range range, unsigned depth, BvhChild *child);

static Float4 reference_center(const PrimitiveReference *reference)
{
    return reference->box.low + reference->box.high; // twice the center: only ratios count
}

typedef struct {
    bool found;
    int axis;
    int bin; // the left side is bins 0..bin
    float cost;
} Split;

typedef struct {
    Float4 low, scale; // of the centers
    int bin_count;
} BinMap;

// Along each axis.
static inline Int4 bins_of(const BinMap *map, const PrimitiveReference *reference)
{
    return __builtin_convertvector((reference_center(reference) - map->low) * map->scale, Int4);
}

// The cheapest split of a range between bins of centers, over all axes; cost in primitive tests.
static Split split_find(const Builder *builder, Range range, const BinMap *map)
{
    BuildBox boxes[3][BIN_COUNT];
    uint32_t counts[3][BIN_COUNT] = {{0}};
    for (int axis = 0; axis < 3; axis++)
        for (int bin = 0; bin < map->bin_count; bin++)
            boxes[axis][bin] = empty_box;
    for (size_t i = range.begin; i < range.end; i++) {
        const PrimitiveReference *reference = &builder->references[i];
        Int4 bins = bins_of(map, reference);
        for (int axis = 0; axis < 3; axis++) {
            BuildBox *box = &boxes[axis][bins[axis]];
            *box = box_join(*box, reference->box);
            counts[axis][bins[axis]]++;
        }
    }
    Split best = {.cost = FLT_MAX};
    for (int axis = 0; axis < 3; axis++) {
        if (map->scale[axis] <= 0) continue;
        float right_areas[BIN_COUNT] = {0};
        uint32_t right_counts[BIN_COUNT] = {0};
        BuildBox box = empty_box;
        uint32_t count = 0;
        for (int bin = map->bin_count - 1; bin > 0; bin--) {
            box = box_join(box, boxes[axis][bin]);
            count += counts[axis][bin];
            right_areas[bin] = count ? box_half_area(box) : 0;
            right_counts[bin] = count;
        }
        box = empty_box;
        count = 0;
        for (int bin = 0; bin + 1 < map->bin_count; bin++) {
            box = box_join(box, boxes[axis][bin]);
            count += counts[axis][bin];
            if (count == 0 || right_counts[bin + 1] == 0) continue;
            float cost =
                box_half_area(box) * (float)count + right_areas[bin + 1] * (float)right_counts[bin + 1];
            if (cost < best.cost) best = (Split){true, axis, bin, cost};
        }
    }
    return best;
}

static size_t range_partition(Builder *builder, Range range, const BinMap *map, const Split *split)
{
    PrimitiveReference *references = builder->references;
    size_t left = range.begin, right = range.end;
    while (left < right) {
        if (bins_of(map, &references[left])[split->axis] <= split->bin) {
            left++;
        } else {
            PrimitiveReference swapped = references[left];
            references[left] = references[--right];
            references[right] = swapped;
        }
    }
    return left;
}

static void range_sort_by_kind(Builder *builder, Range range)
{
    PrimitiveReference *references = builder->references;
    for (size_t i = range.begin + 1; i < range.end; i++) {
        PrimitiveReference moving = references[i];
        size_t place = i;
        for (; place > range.begin && references[place - 1].kind > moving.kind; place--)
            references[place] = references[place - 1];
        references[place] = moving;
    }
}

// The first primitive of another kind than the first; `end` where there is but one kind.
static size_t range_kind_boundary(const Builder *builder, Range range)
{
    const PrimitiveReference *references = builder->references;
    size_t boundary = range.begin + 1;
    while (boundary < range.end && references[boundary].kind == references[range.begin].kind)
        boundary++;
    return boundary;
}

typedef struct {
    BuildBox boxes, centers; // around the primitives' boxes, and around their centers
} RangeBounds;

static RangeBounds range_bounds(const Builder *builder, Range range)
{
    RangeBounds bounds = {empty_box, empty_box};
    for (size_t i = range.begin; i < range.end; i++) {
        const PrimitiveReference *reference = &builder->references[i];
        bounds.boxes = box_join(bounds.boxes, reference->box);
        Float4 center = reference_center(reference);
        bounds.centers = box_join(bounds.centers, (BuildBox){center, center});
    }
    return bounds;
}

static BinMap bins_make(BuildBox centers, size_t count)
{
    Float4 extent = centers.high - centers.low;
    BinMap map = {.low = centers.low, .bin_count = count < SMALL_RANGE ? SMALL_BIN_COUNT : BIN_COUNT};
    for (int axis = 0; axis < 3; axis++) {
        // a smaller extent would overflow the scale; a little less than bin_count keeps the highest center in
        // the last bin
        bool is_splittable = extent[axis] > 0x1p-120f;
        map.scale[axis] = is_splittable ? (float)map.bin_count * (1 - 1e-6f) / extent[axis] : 0;
    }
    return map;
}

// Partitions the range by the surface area heuristic where that pays or the range is too large for a leaf.
// Returns the first index of the right side; `end` where it did not.
static size_t range_partition_by_area(Builder *builder, Range range)
{
    size_t count = range.end - range.begin;
    RangeBounds bounds = range_bounds(builder, range);
    BinMap map = bins_make(bounds.centers, count);
    Split split = split_find(builder, range, &map);
    float area = box_half_area(bounds.boxes);
    bool pays = split.found && split.cost * intersection_cost + traversal_cost * area <
                                   (float)count * intersection_cost * area;
    if (!pays && !(split.found && count > BVH_LEAF_MAX)) return range.end;
    size_t middle = range_partition(builder, range, &map, &split);
    return middle > range.begin ? middle : range.end;
}

// Partitions the range. Returns the first index of the right side; `end` where the range is to be a leaf.
static size_t range_split(Builder *builder, Range range, unsigned depth)
{
    size_t count = range.end - range.begin;
    if (depth < HALVING_DEPTH && count > 1) {
        size_t middle = range_partition_by_area(builder, range);
        if (middle < range.end) return middle;
    }
    if (count > BVH_LEAF_MAX) return range.begin + count / 2;
    range_sort_by_kind(builder, range);
    return range_kind_boundary(builder, range);
}

typedef struct {
    Builder *builder;
    Range range;
    unsigned depth;
    BvhChild *child;
} RangeTask;

static void *range_task_run(void *context)
{
    RangeTask *task = context;
    range_build(task->builder, task->range, task->depth, task->child);
    atomic_fetch_add(&task->builder->idle_threads, 1);
    return NULL;
}

// Builds both sides of a node, in two threads where one is idle and the range is worth it.
static void sides_build(Builder *builder, Range left, Range right, unsigned depth, BvhBinaryNode *node)
{
    bool large = right.end - left.begin >= THREAD_RANGE_MIN;
    if (large && atomic_fetch_sub(&builder->idle_threads, 1) > 0) {
        RangeTask task = {builder, left, depth, &node->children[0]};
        pthread_t thread;
        if (pthread_create(&thread, NULL, range_task_run, &task) == 0) {
            range_build(builder, right, depth, &node->children[1]);
            pthread_join(thread, NULL);
            return;
        }
    }
    if (large) atomic_fetch_add(&builder->idle_threads, 1);
    range_build(builder, left, depth, &node->children[0]);
    range_build(builder, right, depth, &node->children[1]);
}

static void range_build(Builder *builder, Range range, unsigned depth, BvhChild *child)
{
    size_t middle = range_split(builder, range, depth);
    if (middle == range.end) {
        *child = (BvhChild){.first = (uint32_t)range.begin, .count = (uint32_t)(range.end - range.begin)};
        stage_add(builder->stage, child->count);
        return;
    }
    size_t index = atomic_fetch_add(&builder->node_count, 1);
    *child = (BvhChild){.first = (uint32_t)index};
    unsigned deepest = atomic_load(&builder->depth);
    while (depth + 1 > deepest && !atomic_compare_exchange_weak(&builder->depth, &deepest, depth + 1)) {
    }
    sides_build(builder, (Range){range.begin, middle}, (Range){middle, range.end}, depth + 1,
                &builder->nodes[index]);
}

// Boxes from the primitives up, in double: children come after their parent, so one walk backwards meets them
// first.
static void boxes_fit(Bvh *bvh, const Bounds *boxes)
{
    for (size_t i = bvh->node_count; i-- > 0;) {
        for (int side = 0; side < 2; side++) {
            BvhChild *child = &bvh->nodes[i].children[side];
            child->box = bounds_empty();
            if (child->count > 0) {
                for (uint32_t k = 0; k < child->count; k++)
                    child->box = bounds_join(child->box, boxes[bvh->order[child->first + k]]);
            } else if (child->first > i) {
                child->box = bvh_node_bounds(&bvh->nodes[child->first]);
            }
        }
    }
}

static double largest_coordinate(const Bounds *boxes, size_t count)
{
    Bounds all = {{0, 0, 0}, {0, 0, 0}};
    for (size_t i = 0; i < count; i++)
        all = bounds_join(all, boxes[i]);
    Vector3 largest = vector_max(all.max, vector_scale(all.min, -1));
    return fmax(largest.x, fmax(largest.y, largest.z));
}

void bvh_build(Bvh *bvh, const Bounds *boxes, const uint8_t *kinds, size_t count, Stage *stage)
{
    *bvh = (Bvh){.primitive_count = count};
    Builder builder = {
        .references = aligned_alloc(64, (count * sizeof(PrimitiveReference) + 127) / 64 * 64),
        .nodes = memory_allocate(count + 1, sizeof *builder.nodes),
        .node_count = 1,
        .idle_threads = (int)sysconf(_SC_NPROCESSORS_ONLN) - 1,
        .stage = stage,
    };
    if (!builder.references) fault("out of memory for a BVH of %zu primitives", count);
    double largest = largest_coordinate(boxes, count);
    double scale = largest > 0 ? 1 / largest : 1;
    for (size_t i = 0; i < count; i++) {
        PrimitiveReference *reference = &builder.references[i];
        reference->box.low = float4_of(vector_scale(boxes[i].min, scale));
        reference->box.high = float4_of(vector_scale(boxes[i].max, scale));
        reference->index = (uint32_t)i;
        reference->kind = kinds[i];
    }
    BvhChild root = {.first = 0};
    if (count > 0) {
        // the root is node 0; a single leaf is its only child
        size_t middle = range_split(&builder, (Range){0, count}, 0);
        builder.depth = 1;
        if (middle == count) {
            builder.nodes[0] = (BvhBinaryNode){{{.first = 0, .count = (uint32_t)count}, root}};
            stage_add(stage, count);
        } else {
            sides_build(&builder, (Range){0, middle}, (Range){middle, count}, 1, &builder.nodes[0]);
        }
    } else {
        builder.nodes[0] = (BvhBinaryNode){{root, root}};
    }
    bvh->nodes = builder.nodes;
    bvh->node_count = builder.node_count;
    bvh->depth = builder.depth;
    bvh->order = memory_allocate(count + 1, sizeof *bvh->order);
    bvh->kinds = memory_allocate(count + 1, 1);
    for (size_t i = 0; i < count; i++) {
        bvh->order[i] = builder.references[i].index;
        bvh->kinds[i] = builder.references[i].kind;
    }
    free(builder.references);
    boxes_fit(bvh, boxes);
}

void bvh_free(Bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->order);
    free(bvh->kinds);
    *bvh = (Bvh){0};
}
