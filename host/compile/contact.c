#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/compile/instances.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <math.h>
#include <stdlib.h>

// Surfaces count as touching within this distance, relative to the scene's largest coordinate. It must exceed
// 620 u, about 2^-14.7 with the u of float, because the kernels look for an opaque surface behind a
// transparent one up to five error bounds away (surface_find_opaque). A bound is at most 16 u per number of a
// shape, of which a cylinder has 7, plus 4 u per coordinate of the point. Five bounds of an instance are at
// most 140 u and 180 u times its condition, those of an oval 420 u and 120 u times its condition, and those
// of a superellipsoid, whose point may be the ray's, 1020 u and 70 u times its condition. For double the
// distance is larger than needed.
#define NEARNESS 0x1p-14

// More pairs than this, 5 to 30 ms of them, are not compared. A box around all bounded opaque primitives
// replaces them.
#define PAIRS_MAX ((size_t)1 << 19)

// The place of a primitive: its box, infinite if it is unbounded, and for a flat one its plane, normal . p =
// offset.
typedef struct {
    Bounds box;
    Vector3 normal; // 0: not flat
    double offset;
    double largest_coordinate; // magnitude of its numbers, relative to the origin, mostly the eye
} ContactRegion;

typedef ARRAY_OF(ContactRegion) ContactRegionList;

static ContactRegion region_of(size_t type, const void *primitive)
{
    const ShapeOps *shape = shape_ops[type];
    ContactRegion region = {.box = primitive_bounds(type, primitive)};
    region.largest_coordinate = primitive_reach(type, primitive);
    if (shape->plane) {
        Vector3 point;
        shape->plane(primitive, &point, &region.normal);
        region.normal = vector_normalize(region.normal);
        region.offset = vector_dot(region.normal, point);
    }
    return region;
}

typedef struct {
    double low, high;
} ContactInterval;

static ContactInterval interval_scale(double low, double high, double factor)
{
    if (factor == 0) return (ContactInterval){0, 0};
    return factor > 0 ? (ContactInterval){low * factor, high * factor}
                      : (ContactInterval){high * factor, low * factor};
}

// Returns the part of a box within `margin` of a plane. Along each axis with n_x != 0, it solves n_x x =
// offset - n_y y - n_z z for all y and z of the box.
static Bounds bounds_near_plane(Bounds box, const ContactRegion *flat, double margin)
{
    const double normal[3] = {flat->normal.x, flat->normal.y, flat->normal.z};
    double low[3] = {box.min.x, box.min.y, box.min.z}, high[3] = {box.max.x, box.max.y, box.max.z};
    for (unsigned axis = 0; axis < 3; axis++) {
        if (normal[axis] == 0) continue;
        unsigned next = (axis + 1) % 3, last = (axis + 2) % 3;
        ContactInterval a = interval_scale(low[next], high[next], normal[next]);
        ContactInterval b = interval_scale(low[last], high[last], normal[last]);
        ContactInterval along = interval_scale(flat->offset - margin - a.high - b.high,
                                               flat->offset + margin - a.low - b.low, 1 / normal[axis]);
        low[axis] = fmax(low[axis], along.low);
        high[axis] = fmin(high[axis], along.high);
        if (low[axis] > high[axis]) return bounds_empty();
    }
    return (Bounds){{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

// Returns a box around the places where two may touch. Two unbounded ones may touch anywhere, since their
// error grows with the distance.
static Bounds regions_overlap(const ContactRegion *a, const ContactRegion *b, double margin)
{
    if (bounds_is_everywhere(&a->box) && bounds_is_everywhere(&b->box)) return bounds_everywhere();
    Bounds both = bounds_intersect(bounds_grow(a->box, margin), b->box);
    if (bounds_is_empty(&both)) return both;
    both = bounds_grow(both, margin);
    if (!vector_is_zero(a->normal)) both = bounds_near_plane(both, a, margin);
    if (!vector_is_zero(b->normal) && !bounds_is_empty(&both)) both = bounds_near_plane(both, b, margin);
    return both;
}

// Returns whether an instance has transparent triangles or, if `wants_transparent` is false, opaque ones.
static bool instance_has(const CompiledScene *compiled, const Instance *instance, bool object_is_transparent,
                         bool wants_transparent)
{
    const SharedMeshPlan *shared = &compiled->instances->meshes[instance->id.y];
    if (instance->id.z > 0) return object_is_transparent == wants_transparent;
    return wants_transparent ? shared->is_transparent_somewhere : shared->is_opaque_somewhere;
}

// Collects the transparent or the opaque primitives. Returns their largest coordinate.
static double regions_collect(ContactRegionList *list, const CompiledScene *compiled, bool transparent)
{
    const ObjectEntry *entries = compiled->arrays[FLAT_OBJECTS].items;
    const FlatMaterial *materials = compiled->arrays[FLAT_MATERIALS].items;
    double largest = 0;
    for (size_t type = 0; type < TYPE_COUNT; type++) {
        const FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
        for (size_t i = 0; i < array->count; i++) {
            const void *primitive = flat_array_at(array, i);
            const uint32_t entry = entry_of_id(compiled, *flat_id(array, flat_array_at(array, i)));
            const FlatMaterial *material = &materials[entries[entry].type_index_material.z];
            const bool is_transparent = material->reflection_transmission_ior.y > 0;
            if (type == TYPE_INSTANCES ? !instance_has(compiled, primitive, is_transparent, transparent)
                                       : transparent != is_transparent)
                continue;
            const ContactRegion region = region_of(type, primitive);
            array_push(*list, region);
            largest = fmax(largest, region.largest_coordinate);
        }
    }
    return largest;
}

// Replaces all bounded regions by one.
static void regions_join_bounded(ContactRegionList *list)
{
    Bounds all = bounds_empty();
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++) {
        if (bounds_is_everywhere(&list->items[i].box))
            list->items[count++] = list->items[i];
        else
            all = bounds_join(all, list->items[i].box);
    }
    if (!bounds_is_empty(&all)) list->items[count++] = (ContactRegion){.box = all};
    list->count = count;
}

// Removes regions that are far from all of the others.
static void regions_keep_near(ContactRegionList *list, const ContactRegionList *others, double margin)
{
    Bounds around = bounds_empty();
    for (size_t i = 0; i < others->count; i++)
        around = bounds_join(around, others->items[i].box);
    around = bounds_grow(around, margin);
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++) {
        Bounds near = bounds_intersect(list->items[i].box, around);
        if (!bounds_is_empty(&near)) list->items[count++] = list->items[i];
    }
    list->count = count;
}

static Bounds lists_overlap(ContactRegionList *transparent, ContactRegionList *opaque, double margin)
{
    regions_keep_near(opaque, transparent, margin);
    regions_keep_near(transparent, opaque, margin);
    if (transparent->count == 0) return bounds_empty();
    if (opaque->count > PAIRS_MAX / transparent->count) regions_join_bounded(opaque);
    if (opaque->count > PAIRS_MAX / transparent->count) return bounds_everywhere();
    Bounds all = bounds_empty();
    for (size_t i = 0; i < transparent->count; i++)
        for (size_t k = 0; k < opaque->count; k++)
            all = bounds_join(all, regions_overlap(&transparent->items[i], &opaque->items[k], margin));
    return all;
}

static double conditions_largest(const CompiledScene *compiled)
{
    double largest = compiled->instances ? compiled->instances->condition : 0;
    for (size_t type = 0; type < TYPE_COUNT; type++) {
        const FlatArray *array = &compiled->arrays[FLAT_FIRST_SHAPE + type];
        for (size_t i = 0; shape_ops[type]->condition && i < array->count; i++)
            largest = fmax(largest, shape_ops[type]->condition(flat_array_at(array, i)));
    }
    return largest;
}

Bounds contact_find(const CompiledScene *compiled)
{
    OWNED ContactRegionList transparent = {0}, opaque = {0};
    double coordinate = regions_collect(&transparent, compiled, true);
    coordinate = fmax(coordinate, regions_collect(&opaque, compiled, false));
    const double condition = conditions_largest(compiled);
    return lists_overlap(&transparent, &opaque, NEARNESS * (1 + condition / 5) * coordinate);
}
