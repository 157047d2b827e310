#include "host/compile/bvh_split.h"

#include "host/base/parallel.h"
#include <float.h>
#include <pthread.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

enum {
    BIN_COUNT = 16,
    SMALL_RANGE = 32, // below it fewer bins split equally well and cost less to fill and to sweep
    SMALL_BIN_COUNT = 8,
    FEW_MAX = 8, // up to as many primitives are sorted by their bins, which then need not be filled
    THREAD_BINNED_MIN = 8192 // below it a thread costs more than it saves
};

// SAH costs of the binary tree: visiting a node, testing a primitive. (bvh_widen has those of wide nodes.)
static const float traversal_cost = 1, intersection_cost = 1;

static inline Float4 float4_of(Vector3 v)
{
    return (Float4){(float)v.x, (float)v.y, (float)v.z, 0};
}

static inline Float4 float4_select(Int4 mask, Float4 a, Float4 b)
{
    return (Float4)((mask & (Int4)a) | (~mask & (Int4)b));
}

// gcc does not make minps of a comparison and a selection.
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
static inline Float4 float4_min(Float4 a, Float4 b)
{
    return float4_select(a < b, a, b);
}

static inline Float4 float4_max(Float4 a, Float4 b)
{
    return float4_select(a > b, a, b);
}
#endif

static const BuildBox empty_box = {{FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX},
                                   {-FLT_MAX, -FLT_MAX, -FLT_MAX, -FLT_MAX}};

static inline BuildBox box_join(BuildBox a, BuildBox b)
{
    return (BuildBox){float4_min(a.low, b.low), float4_max(a.high, b.high)};
}

static inline float box_half_area(BuildBox box)
{
    const Float4 size = box.high - box.low;
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
}

PrimitiveReference reference_make(Bounds box, double scale, uint32_t index, uint8_t type)
{
    const int32_t two = 0x40000000; // bits of a float
    Int4 low = (Int4)float4_of(vector_scale(box.min, scale)),
         high = (Int4)float4_of(vector_scale(box.max, scale));
    low[3] = two | (int32_t)index;
    high[3] = two | type;
    return (PrimitiveReference){{(Float4)low, (Float4)high}};
}

static inline Float4 reference_center(const PrimitiveReference *reference)
{
    return reference->box.low + reference->box.high; // twice the center: only ratios count
}

RangeBounds range_bounds_empty(void)
{
    return (RangeBounds){empty_box, empty_box};
}

static inline RangeBounds bounds_include(RangeBounds bounds, const PrimitiveReference *reference)
{
    const Float4 center = reference_center(reference);
    return (RangeBounds){box_join(bounds.boxes, reference->box),
                         box_join(bounds.centers, (BuildBox){center, center})};
}

RangeBounds range_bounds_join(RangeBounds a, RangeBounds b)
{
    return (RangeBounds){box_join(a.boxes, b.boxes), box_join(a.centers, b.centers)};
}

RangeBounds range_bounds_of(const PrimitiveReference *references, size_t count)
{
    RangeBounds bounds = {empty_box, empty_box};
    for (size_t i = 0; i < count; i++)
        bounds = bounds_include(bounds, &references[i]);
    return bounds;
}

// The bins along each axis.
typedef struct {
    Float4 low, scale; // of the centers
    int bin_count;
    BvhLeaves leaves;
} BinMap;

// Returns the cost of testing `count` primitives, relative to one primitive or to one block.
static inline float test_cost(BvhLeaves leaves, uint32_t count)
{
    return (float)(leaves.counts_blocks ? (count + leaves.block_size - 1) / leaves.block_size : count);
}

static inline Int4 bins_of(const BinMap *map, const PrimitiveReference *reference)
{
    return __builtin_convertvector((reference_center(reference) - map->low) * map->scale, Int4);
}

static BinMap bins_make(BuildBox centers, size_t count, BvhLeaves leaves)
{
    const int bin_count = count < SMALL_RANGE ? SMALL_BIN_COUNT : BIN_COUNT;
    const Float4 extent = centers.high - centers.low;
    // a smaller extent would overflow the scale; a little less than bin_count keeps the highest center in the
    // last bin
    const float minimum = 0x1p-120f, bins = (float)bin_count * (1 - 1e-6f);
    const Float4 extent_min = {minimum, minimum, minimum, FLT_MAX};
    const Int4 is_splittable = extent > extent_min;
    const Float4 scale = (Float4){bins, bins, bins, bins} / float4_max(extent, extent_min);
    return (BinMap){centers.low, float4_select(is_splittable, scale, (Float4){0, 0, 0, 0}), bin_count,
                    leaves};
}

typedef struct {
    bool found;
    int axis;
    int bin;    // the left side is bins 0..bin
    float cost; // in primitive tests
} Split;

typedef struct {
    BuildBox boxes[3][BIN_COUNT];
    uint32_t counts[3][BIN_COUNT];
} Bins;

static void bins_clear(Bins *bins, int bin_count)
{
    for (int axis = 0; axis < 3; axis++)
        for (int bin = 0; bin < bin_count; bin++) {
            bins->boxes[axis][bin] = empty_box;
            bins->counts[axis][bin] = 0;
        }
}

static void bins_fill(Bins *bins, const BinMap *map, const PrimitiveReference *references, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const Int4 at = bins_of(map, &references[i]);
        for (int axis = 0; axis < 3; axis++) {
            BuildBox *box = &bins->boxes[axis][at[axis]];
            *box = box_join(*box, references[i].box);
            bins->counts[axis][at[axis]]++;
        }
    }
}

typedef struct {
    const PrimitiveReference *references;
    const BinMap *map;
    Bins *bins;
    pthread_mutex_t lock;
} Binning;

// Fills the bins from a range of primitives. The order in which boxes are joined does not change them.
static void range_bin(void *context, size_t begin, size_t end)
{
    Binning *binning = context;
    Bins bins;
    bins_clear(&bins, binning->map->bin_count);
    bins_fill(&bins, binning->map, binning->references + begin, end - begin);
    pthread_mutex_lock(&binning->lock);
    for (int axis = 0; axis < 3; axis++)
        for (int bin = 0; bin < binning->map->bin_count; bin++) {
            BuildBox *box = &binning->bins->boxes[axis][bin];
            *box = box_join(*box, bins.boxes[axis][bin]);
            binning->bins->counts[axis][bin] += bins.counts[axis][bin];
        }
    pthread_mutex_unlock(&binning->lock);
}

static void axis_sweep(const Bins *bins, int axis, const BinMap *map, Split *best)
{
    const int bin_count = map->bin_count;
    float right_areas[BIN_COUNT];
    uint32_t right_counts[BIN_COUNT] = {0};
    BuildBox box = empty_box;
    uint32_t count = 0;
    for (int bin = bin_count - 1; bin > 0; bin--) {
        box = box_join(box, bins->boxes[axis][bin]);
        count += bins->counts[axis][bin];
        right_areas[bin] = count ? box_half_area(box) : 0;
        right_counts[bin] = count;
    }
    box = empty_box;
    count = 0;
    for (int bin = 0; bin + 1 < bin_count; bin++) {
        box = box_join(box, bins->boxes[axis][bin]);
        count += bins->counts[axis][bin];
        if (count == 0 || right_counts[bin + 1] == 0) continue;
        const float cost = box_half_area(box) * test_cost(map->leaves, count) +
                           right_areas[bin + 1] * test_cost(map->leaves, right_counts[bin + 1]);
        if (cost < best->cost) *best = (Split){true, axis, bin, cost};
    }
}

// Returns the cheapest split between bins of centers over all axes.
static Split split_find(const PrimitiveReference *references, size_t count, const BinMap *map,
                        bool is_parallel)
{
    Bins bins;
    bins_clear(&bins, map->bin_count);
    if (is_parallel) {
        Binning binning = {references, map, &bins, PTHREAD_MUTEX_INITIALIZER};
        parallel_run(count, THREAD_BINNED_MIN, range_bin, &binning);
    } else {
        bins_fill(&bins, map, references, count);
    }
    Split best = {.cost = FLT_MAX};
    for (int axis = 0; axis < 3; axis++)
        if (map->scale[axis] > 0) axis_sweep(&bins, axis, map, &best);
    return best;
}

// Returns the cheapest split of at most FEW_MAX primitives over all axes, without filling bins.
static Split split_find_of_few(const PrimitiveReference *references, int count, const BinMap *map)
{
    Int4 bins[FEW_MAX];
    for (int i = 0; i < count; i++)
        bins[i] = bins_of(map, &references[i]);
    Split best = {.cost = FLT_MAX};
    for (int axis = 0; axis < 3; axis++) {
        if (map->scale[axis] <= 0) continue;
        uint8_t order[FEW_MAX];
        for (int i = 0; i < count; i++) {
            int place = i;
            for (; place > 0 && bins[order[place - 1]][axis] > bins[i][axis]; place--)
                order[place] = order[place - 1];
            order[place] = (uint8_t)i;
        }
        float right_areas[FEW_MAX];
        BuildBox box = empty_box;
        for (int i = count - 1; i > 0; i--) {
            box = box_join(box, references[order[i]].box);
            right_areas[i] = box_half_area(box);
        }
        box = empty_box;
        for (int i = 1; i < count; i++) {
            box = box_join(box, references[order[i - 1]].box);
            const int bin = bins[order[i - 1]][axis];
            if (bin == bins[order[i]][axis]) continue;
            const float cost = box_half_area(box) * test_cost(map->leaves, (uint32_t)i) +
                               right_areas[i] * test_cost(map->leaves, (uint32_t)(count - i));
            if (cost < best.cost) best = (Split){true, axis, bin, cost};
        }
    }
    return best;
}

static size_t range_partition(PrimitiveReference *references, size_t count, const BinMap *map,
                              const Split *split, RangeBounds sides[2])
{
    size_t left = 0, right = count;
    RangeBounds left_bounds = {empty_box, empty_box}, right_bounds = left_bounds;
    while (left < right) {
        const PrimitiveReference reference = references[left];
        if (bins_of(map, &reference)[split->axis] <= split->bin) {
            left_bounds = bounds_include(left_bounds, &reference);
            left++;
        } else {
            right_bounds = bounds_include(right_bounds, &reference);
            references[left] = references[--right];
            references[right] = reference;
        }
    }
    sides[0] = left_bounds;
    sides[1] = right_bounds;
    return left;
}

bool range_fits_leaf(const PrimitiveReference *references, size_t count, BvhLeaves leaves)
{
    for (size_t i = 0; i < count; i++)
        if (count > leaf_size_max(leaves, reference_type(&references[i]))) return false;
    return true;
}

static bool all_in_blocks(const PrimitiveReference *references, size_t count, BvhLeaves leaves)
{
    for (size_t i = 0; i < count; i++)
        if (!type_is_in_blocks(leaves, reference_type(&references[i]))) return false;
    return true;
}

size_t range_split(PrimitiveReference *references, size_t count, const RangeBounds *bounds, BvhLeaves leaves,
                   bool is_parallel, RangeBounds sides[2])
{
    const bool fits = range_fits_leaf(references, count, leaves);
    if (fits && all_in_blocks(references, count, leaves)) return count;
    leaves.counts_blocks &= !fits; // ranges that fit but are not in blocks are tested one by one
    const BinMap map = bins_make(bounds->centers, count, leaves);
    const Split split = count <= FEW_MAX ? split_find_of_few(references, (int)count, &map)
                                         : split_find(references, count, &map, is_parallel);
    const float area = box_half_area(bounds->boxes);
    const bool pays = split.found && split.cost * intersection_cost + traversal_cost * area <
                                         (float)count * intersection_cost * area;
    if (!split.found || (fits && !pays)) return count;
    const size_t left = range_partition(references, count, &map, &split, sides);
    return left > 0 ? left : count;
}
