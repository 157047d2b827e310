#include "host/render/hierarchy.h"

#include "host/base/memory.h"
#include "host/render/bvh_widen.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Half the extent, along each axis, of a circle of radius 1 across an axis.
static Vector3 circle_reach(Vector3 unit)
{
    return (Vector3){hypot(unit.y, unit.z), hypot(unit.x, unit.z), hypot(unit.x, unit.y)};
}

static void box_include(BvhBox *box, Vector3 center, Vector3 reach)
{
    const double centers[3] = {center.x, center.y, center.z}, reaches[3] = {reach.x, reach.y, reach.z};
    for (int axis = 0; axis < 3; axis++) {
        double low = centers[axis] - reaches[axis], high = centers[axis] + reaches[axis];
        if (low < box->low[axis]) box->low[axis] = low;
        if (high > box->high[axis]) box->high[axis] = high;
    }
}

static bool revolution_box(const Revolution *shape, BvhBox *box)
{
    if (!(shape->id.y & REVOLUTION_FINITE)) return false;
    Vector3 base = vector3_of(&shape->base_radius), axis = vector3_of(&shape->axis_slope);
    double length = shape->range.y, radius = shape->base_radius.w / length;
    double height = shape->range.x / shape->range.z; // in units of the stored axis
    double end_radius = radius + shape->axis_slope.w * height * length;
    Vector3 reach = circle_reach(vector_scale(axis, 1 / length));
    box_include(box, base, vector_scale(reach, fabs(radius)));
    box_include(box, vector_add(base, vector_scale(axis, height)), vector_scale(reach, fabs(end_radius)));
    return true;
}

bool primitive_box(size_t kind, const void *primitive, BvhBox *box)
{
    *box = (BvhBox){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    const Vector3 nothing = {0, 0, 0};
    switch (kind) {
    case KIND_SPHERES: {
        const Sphere *sphere = primitive;
        double radius = sphere->center_radius.w;
        box_include(box, vector3_of(&sphere->center_radius), (Vector3){radius, radius, radius});
        return true;
    }
    case KIND_DISCS: {
        const Disc *disc = primitive;
        double radius = disc->center_radius.w;
        box_include(box, vector3_of(&disc->center_radius), (Vector3){radius, radius, radius});
        return true;
    }
    case KIND_BOXES:
        box_include(box, vector3_of(&((const Box *)primitive)->low), nothing);
        box_include(box, vector3_of(&((const Box *)primitive)->high), nothing);
        return true;
    case KIND_CYLINDERS:
    case KIND_CONES:
        return revolution_box(primitive, box);
    case KIND_TRIANGLES:
        box_include(box, vector3_of(&((const Triangle *)primitive)->a), nothing);
        box_include(box, vector3_of(&((const Triangle *)primitive)->b), nothing);
        box_include(box, vector3_of(&((const Triangle *)primitive)->c), nothing);
        return true;
    case KIND_TORI: {
        const Torus *torus = primitive;
        double major = torus->center_major.w, minor = torus->axis_minor.w;
        Vector3 reach = vector_scale(circle_reach(vector3_of(&torus->axis_minor)), major);
        box_include(box, vector3_of(&torus->center_major), vector_add(reach, (Vector3){minor, minor, minor}));
        return true;
    }
    default:
        return false;
    }
}

// The bounded primitives on their way into the tree.
typedef struct {
    BvhBox *boxes;
    uint8_t *kinds;
    uint32_t *places; // in their shapes' arrays
    size_t count;
    size_t kind_counts[KIND_COUNT];
} Bounded;

static void bounded_collect(Bounded *bounded, const FlatScene *flat)
{
    size_t capacity = 0;
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        capacity += flat->arrays[FLAT_FIRST_SHAPE + kind].count;
    *bounded = (Bounded){
        .boxes = memory_allocate(capacity + 1, sizeof(BvhBox)),
        .kinds = memory_allocate(capacity + 1, 1),
        .places = memory_allocate(capacity + 1, sizeof(uint32_t)),
    };
    for (size_t kind = 0; kind < KIND_COUNT; kind++) {
        const FlatArray *array = &flat->arrays[FLAT_FIRST_SHAPE + kind];
        for (size_t i = 0; i < array->count; i++) {
            if (!primitive_box(kind, flat_array_at(array, i), &bounded->boxes[bounded->count])) continue;
            bounded->kinds[bounded->count] = (uint8_t)kind;
            bounded->places[bounded->count++] = (uint32_t)i;
            bounded->kind_counts[kind]++;
        }
    }
}

static void bounded_free(Bounded *bounded)
{
    free(bounded->boxes);
    free(bounded->kinds);
    free(bounded->places);
}

// Where each primitive of the tree's order stands in its shape's new array.
static uint32_t *order_in_kinds(const Bvh *bvh, const Bounded *bounded)
{
    uint32_t *order = memory_allocate(bvh->primitive_count + 1, sizeof *order);
    uint32_t counts[KIND_COUNT] = {0};
    for (size_t i = 0; i < bvh->primitive_count; i++)
        order[i] = counts[bounded->kinds[bvh->order[i]]]++;
    return order;
}

// Brings what stands at from[i] to i, cycle by cycle in place, which spares a second array; `from` is used
// up.
static void array_permute(FlatArray *array, uint32_t *from)
{
    size_t size = array->layout.size;
    void *first = memory_allocate(1, size);
    for (uint32_t i = 0; i < array->count; i++) {
        if (from[i] == i) continue;
        memcpy(first, flat_array_at(array, i), size);
        uint32_t place = i;
        while (from[place] != i) {
            uint32_t next = from[place];
            memcpy(flat_array_at(array, place), flat_array_at(array, next), size);
            from[place] = place;
            place = next;
        }
        memcpy(flat_array_at(array, place), first, size);
        from[place] = place;
    }
    free(first);
}

// Moves a shape's primitives into the leaves' order, the unbounded behind them, and tells the objects.
static void array_reorder(FlatScene *flat, size_t kind, const Bvh *bvh, const Bounded *bounded)
{
    FlatArray *array = &flat->arrays[FLAT_FIRST_SHAPE + kind];
    if (array->count == 0) return;
    uint32_t *from = memory_allocate(array->count, sizeof *from);
    size_t count = 0;
    for (size_t i = 0; i < bvh->primitive_count; i++)
        if (bounded->kinds[bvh->order[i]] == kind) from[count++] = bounded->places[bvh->order[i]];
    BvhBox box;
    for (size_t i = 0; count < array->count; i++)
        if (!primitive_box(kind, flat_array_at(array, i), &box)) from[count++] = (uint32_t)i;
    array_permute(array, from);
    free(from);
    ObjectEntry *entries = flat->arrays[FLAT_OBJECTS].items;
    for (size_t i = 0; i < array->count; i++)
        entries[flat_id(array, i)].kind_index_material.y = (uint32_t)i;
}

static BvhBox bvh_bounds(const Bvh *bvh)
{
    BvhBox bounds;
    const BvhBox *left = &bvh->nodes[0].children[0].box, *right = &bvh->nodes[0].children[1].box;
    for (int axis = 0; axis < 3; axis++) { // an empty child's box is inside out, and adds nothing
        bounds.low[axis] = fmin(left->low[axis], right->low[axis]);
        bounds.high[axis] = fmax(left->high[axis], right->high[axis]);
    }
    return bounds;
}

// Inside out, and beyond all boxes. A ray that is so far away that it meets this all the same finds no
// primitives there: the rest of an empty place is 0.
static BvhBox empty_place(const BvhBox *bounds)
{
    BvhBox box;
    for (int axis = 0; axis < 3; axis++) {
        double extent = bounds->high[axis] - bounds->low[axis];
        box.low[axis] = bounds->high[axis] + extent;
        box.high[axis] = bounds->low[axis] - extent;
    }
    return box;
}

static void node_write(const BvhWideNode *wide, const Bvh *bvh, const Bounded *bounded, const uint32_t *order,
                       const BvhBox *empty, unsigned width, void *node)
{
    double *planes = node;
    uint32_t *first = (void *)(planes + (size_t)BVH_PLANES * width), *what = first + width;
    uint32_t next_node = wide->first_node;
    for (unsigned i = 0; i < width; i++) {
        const BvhChild *child = i < wide->child_count ? wide->children[i] : NULL;
        const BvhBox *box = child ? &child->box : empty;
        for (unsigned axis = 0; axis < 3; axis++) {
            planes[(BVH_LOW + axis) * width + i] = box->low[axis];
            planes[(BVH_HIGH + axis) * width + i] = box->high[axis];
        }
        if (child && child->count > 0) {
            first[i] = order[child->first];
            what[i] = child->count << 8 | bounded->kinds[bvh->order[child->first]];
        } else if (child) {
            first[i] = next_node++;
            what[i] = BVH_NODE;
        }
    }
}

static void nodes_write(FlatScene *flat, const Bvh *bvh, const Bounded *bounded, unsigned width)
{
    BvhWide wide;
    bvh_widen(&wide, bvh, width);
    FlatArray *nodes = &flat->arrays[FLAT_NODES];
    free(nodes->items);
    *nodes = flat_nodes_make(wide.node_count, width);
    uint32_t *order = order_in_kinds(bvh, bounded);
    const BvhBox bounds = bvh_bounds(bvh), empty = empty_place(&bounds);
    for (size_t i = 0; i < wide.node_count; i++)
        node_write(&wide.nodes[i], bvh, bounded, order, &empty, width, flat_array_at(nodes, i));
    free(order);
    bvh_wide_free(&wide);
}

static void header_note(SceneHeader *header, const Bvh *bvh, const Bounded *bounded)
{
    uint32_t counts[4 * sizeof header->bounded_counts / sizeof *header->bounded_counts] = {0};
    _Static_assert(KIND_COUNT <= sizeof counts / sizeof *counts, "a kind without a place in SceneHeader");
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        counts[kind] = (uint32_t)bounded->kind_counts[kind];
    memcpy(header->bounded_counts, counts, sizeof counts);
    const BvhBox bounds = bvh_bounds(bvh);
    const double *low = bounds.low, *high = bounds.high;
    double center[3], reach = 0;
    for (int axis = 0; axis < 3; axis++) {
        center[axis] = 0.5 * low[axis] + 0.5 * high[axis];
        reach += 0.5 * high[axis] - 0.5 * low[axis];
    }
    header->bounds = (scalar4){center[0], center[1], center[2], reach};
    header->bounds_low = (scalar4){low[0], low[1], low[2], 0};
    header->bounds_high = (scalar4){high[0], high[1], high[2], 0};
}

void hierarchy_hang(FlatScene *flat, unsigned lanes)
{
    Bounded bounded;
    bounded_collect(&bounded, flat);
    if (bounded.count > 0) {
        Bvh bvh;
        bvh_build(&bvh, bounded.boxes, bounded.kinds, bounded.count);
        free(bounded.boxes);
        bounded.boxes = NULL;
        nodes_write(flat, &bvh, &bounded, lanes < BVH_WIDTH_LEAST ? BVH_WIDTH_LEAST : lanes);
        for (size_t kind = 0; kind < KIND_COUNT; kind++)
            array_reorder(flat, kind, &bvh, &bounded);
        header_note(flat->arrays[FLAT_HEADER].items, &bvh, &bounded);
        bvh_free(&bvh);
    }
    bounded_free(&bounded);
}

size_t hierarchy_bounded_count(const FlatScene *flat)
{
    size_t count = 0;
    BvhBox box;
    for (size_t kind = 0; kind < KIND_COUNT; kind++) {
        const FlatArray *array = &flat->arrays[FLAT_FIRST_SHAPE + kind];
        for (size_t i = 0; i < array->count; i++)
            count += primitive_box(kind, flat_array_at(array, i), &box);
    }
    return count;
}
