// Builds the BVH of the bounded primitives, and moves the primitives into its order.
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/bvh_nodes.h"
#include "host/compile/instances.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <math.h>
#include <stdatomic.h>
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
} BoundedPrimitives;

typedef struct {
    const FlatArray *array;
    size_t type;
    BoundedPrimitives *bounded; // the array's primitives follow those that it counts
    atomic_bool has_unbounded;
} Boxing;

static void range_box(void *context, size_t begin, size_t end)
{
    Boxing *boxing = context;
    const BoundedPrimitives *bounded = boxing->bounded;
    bool has_unbounded = false;
    for (size_t i = begin, k = bounded->count + begin; i < end; i++, k++) {
        bounded->boxes[k] = primitive_bounds(boxing->type, flat_array_at(boxing->array, i));
        bounded->types[k] = (uint8_t)boxing->type;
        bounded->places[k] = (uint32_t)i;
        has_unbounded |= bounds_is_everywhere(&bounded->boxes[k]);
    }
    if (has_unbounded) atomic_store(&boxing->has_unbounded, true);
}

// Adds the bounded ones of `count` primitives behind those that are counted.
static void bounded_add(BoundedPrimitives *bounded, size_t type, size_t count, bool has_unbounded)
{
    const size_t first = bounded->count;
    if (!has_unbounded) bounded->count += count;
    for (size_t i = first; has_unbounded && i < first + count; i++) {
        if (bounds_is_everywhere(&bounded->boxes[i])) continue;
        bounded->boxes[bounded->count] = bounded->boxes[i];
        bounded->types[bounded->count] = bounded->types[i];
        bounded->places[bounded->count++] = bounded->places[i];
    }
    bounded->type_counts[type] = (uint32_t)(bounded->count - first);
}

static BoundedPrimitives bounded_collect(const CompiledScene *compiled)
{
    size_t capacity = 0;
    for (size_t type = 0; type < TYPE_COUNT; type++)
        capacity += compiled->arrays[FLAT_FIRST_SHAPE + type].count;
    BoundedPrimitives bounded = {
        .boxes = memory_allocate_large(capacity, sizeof(Bounds)),
        .types = memory_allocate(capacity, 1),
        .places = memory_allocate(capacity, sizeof(uint32_t)),
    };
    for (size_t type = 0; type < TYPE_COUNT; type++) {
        const FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
        Boxing boxing = {array, type, &bounded, false};
        parallel_run(array->count, FLAT_RANGE_MIN, range_box, &boxing);
        bounded_add(&bounded, type, array->count, boxing.has_unbounded);
    }
    return bounded;
}

static inline double box_size(const Bounds *box)
{
    const Vector3 size = vector_subtract(box->max, box->min);
    const double larger = size.x > size.y ? size.x : size.y; // a call of fmax would take longer
    return larger > size.z ? larger : size.z;
}

static void bounded_remove(BoundedPrimitives *bounded, size_t index)
{
    bounded->type_counts[bounded->types[index]]--;
    const size_t left = --bounded->count - index;
    memmove(&bounded->boxes[index], &bounded->boxes[index + 1], left * sizeof *bounded->boxes);
    memmove(&bounded->types[index], &bounded->types[index + 1], left * sizeof *bounded->types);
    memmove(&bounded->places[index], &bounded->places[index + 1], left * sizeof *bounded->places);
}

static void huge_remove(BoundedPrimitives *bounded)
{
    while (bounded->count > 1) {
        size_t largest = 0;
        double size = box_size(&bounded->boxes[0]);
        for (size_t i = 1; i < bounded->count; i++) {
            if (!(box_size(&bounded->boxes[i]) > size)) continue;
            largest = i;
            size = box_size(&bounded->boxes[i]);
        }
        Bounds others = bounds_empty();
        for (size_t i = 0; i < bounded->count; i++) {
            if (i == largest) continue;
            others = bounds_join(others, bounded->boxes[i]);
            if (!(size > HUGE_RATIO * box_size(&others))) return; // also if all are one point
        }
        bounded_remove(bounded, largest);
    }
}

static void bounded_free(BoundedPrimitives *bounded)
{
    free(bounded->boxes);
    free(bounded->types);
    free(bounded->places);
}
#define OwnedBoundedPrimitives __attribute__((cleanup(bounded_free))) BoundedPrimitives

enum { CACHE_LINE = 64, CUT_DISTANCE = 256, PATHS_AT_ONCE = 8 };

// A permutation of an array in place, which saves a second array. Its cycles are cut in every place that is a
// multiple of CUT_DISTANCE, so that threads can move the structs of different paths between cuts.
typedef struct {
    FlatArray *array;
    uint32_t *from; // each place's struct is in this place, or in its own once it has been moved
    char *saved;    // copies of the structs in the places of cuts, then of one in another place
} Permutation;

static void *saved_at(const Permutation *permutation, size_t cut)
{
    return permutation->saved + cut * permutation->array->layout.size;
}

static void range_save_cuts(void *context, size_t begin, size_t end)
{
    const Permutation *permutation = context;
    const FlatArray *array = permutation->array;
    for (size_t i = begin; i < end; i++)
        memcpy(saved_at(permutation, i), flat_array_at(array, i * CUT_DISTANCE), array->layout.size);
}

// Moves the structs of paths from cut to cut, several by turns, so that those of one are fetched while others
// are moved.
static void range_move_paths(void *context, size_t begin, size_t end)
{
    const Permutation *permutation = context;
    const FlatArray *array = permutation->array;
    const size_t size = array->layout.size;
    uint32_t *from = permutation->from, places[PATHS_AT_ONCE];
    size_t count = 0, start = begin;
    while (count < PATHS_AT_ONCE && start < end)
        places[count++] = (uint32_t)(start++ * CUT_DISTANCE);
    for (size_t k = 0; count > 0; k = k + 1 < count ? k + 1 : 0) {
        const uint32_t place = places[k], next = from[place];
        from[place] = place;
        if (next % CUT_DISTANCE > 0) {
            memcpy(flat_array_at(array, place), flat_array_at(array, next), size);
            places[k] = next;
            const char *ahead = flat_array_at(array, from[next]);
            for (size_t i = 0; i < size; i += CACHE_LINE)
                __builtin_prefetch(ahead + i, 1);
            __builtin_prefetch(&from[from[next]], 1);
        } else {
            memcpy(flat_array_at(array, place), saved_at(permutation, next / CUT_DISTANCE), size);
            places[k] = start < end ? (uint32_t)(start++ * CUT_DISTANCE) : places[--count];
        }
    }
}

// Moves the structs of a cycle without a cut. `saved` has room for one.
static void cycle_move(const Permutation *permutation, uint32_t first, void *saved)
{
    const FlatArray *array = permutation->array;
    uint32_t *from = permutation->from, place = first, next;
    memcpy(saved, flat_array_at(array, first), array->layout.size);
    for (;;) {
        next = from[place];
        from[place] = place;
        if (next == first) break;
        memcpy(flat_array_at(array, place), flat_array_at(array, next), array->layout.size);
        place = next;
    }
    memcpy(flat_array_at(array, place), saved, array->layout.size);
}

// Moves the struct at from[i] to i for every i. Destroys `from`.
static void array_permute(FlatArray *array, uint32_t *from)
{
    const size_t cut_count = (array->count + CUT_DISTANCE - 1) / CUT_DISTANCE;
    Permutation permutation = {.array = array};
    permutation.from = from;
    permutation.saved = memory_allocate(cut_count + 1, array->layout.size);
    parallel_run(cut_count, FLAT_RANGE_MIN / CUT_DISTANCE, range_save_cuts, &permutation);
    parallel_run(cut_count, FLAT_RANGE_MIN / CUT_DISTANCE, range_move_paths, &permutation);
    for (uint32_t i = 0; i < array->count; i++)
        if (from[i] != i) cycle_move(&permutation, i, saved_at(&permutation, cut_count));
    free(permutation.saved);
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
static void array_reorder(CompiledScene *compiled, size_t type, const Bvh *bvh,
                          const BoundedPrimitives *bounded)
{
    FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
    if (array->count == 0) return;
    OWNED uint32_t *from = memory_allocate_large(array->count, sizeof *from);
    OWNED bool *in_tree = memory_allocate_zeroed(array->count, sizeof *in_tree);
    size_t count = 0;
    for (size_t i = 0; i < bvh->primitive_count; i++) {
        if (bvh->types[i] != type) continue;
        from[count] = bounded->places[bvh->order[i]];
        in_tree[from[count++]] = true;
    }
    for (size_t i = 0; count < array->count; i++)
        if (!in_tree[i]) from[count++] = (uint32_t)i;
    array_permute(array, from);
    Entering entering = {compiled, array, compiled->arrays[FLAT_OBJECTS].items};
    parallel_run(array->count, FLAT_RANGE_MIN, range_enter, &entering);
}

// Returns the leaf sizes that measured best. A block costs the same whatever its size. Splits that count
// blocks save 6 % of a frame of a million triangles, but cost 6 % where half of the primitives are cylinders
// among spheres, 1 % where a tenth are, and nothing where a thirtieth are.
static BvhLeaves leaves_for(const BoundedPrimitives *bounded, unsigned lanes)
{
    enum { LEAF_SIZE_MAX = 8 };
    if (lanes <= 1) return (BvhLeaves){LEAF_SIZE_MAX, 0, false};
    const size_t others =
        bounded->count - bounded->type_counts[TYPE_TRIANGLES] - bounded->type_counts[TYPE_SPHERES];
    return (BvhLeaves){LEAF_SIZE_MAX, lanes, 16 * others < bounded->count};
}

// Builds the BVH of the bounded primitives and puts them in its order.
static void tree_flatten(CompiledScene *compiled, const CompileSettings *settings, BoundedPrimitives *bounded)
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
    flat_array_renew(compiled, FLAT_BLOCK_TRIANGLES, 0);
}

void bvh_flatten(CompiledScene *compiled, const CompileSettings *settings)
{
    tree_arrays_renew(compiled);
    if (settings->bvh == BVH_OFF) return;
    OwnedBoundedPrimitives bounded = bounded_collect(compiled);
    huge_remove(&bounded);
    if (bounded.count < (settings->bvh == BVH_ON ? 1 : BVH_WORTHWHILE)) return;
    compiled->features |= FEATURE_BVH;
    tree_flatten(compiled, settings, &bounded);
}

void mesh_bvh_flatten(CompiledScene *compiled, const CompileSettings *settings)
{
    tree_arrays_renew(compiled);
    OwnedBoundedPrimitives bounded = bounded_collect(compiled);
    tree_flatten(compiled, settings, &bounded);
}
