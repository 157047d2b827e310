// Defines the queries of a traversal and its hit so far.
#ifndef QUERY_H
#define QUERY_H

#include "scene.h"
#include "shapes/certain.h"
#include "traversal/ray.h"

typedef enum {
    CLOSEST_HIT,
    CLOSEST_OPAQUE_HIT, // ignores objects that transmit light
    OCCLUSION           // any hit; transparent objects reduce the light that passes
} Query;

typedef struct {
    Query query;
    ObjectRange within; // with HAS_INSTANCES, the ids of the instance being traversed, if any
    mask active;        // lanes that still traverse
    Hit hit;
    // For OCCLUSION, the depths of the objects hit so far; green and blue with HAS_FILTERS.
    integer optical_depth, optical_depth_green, optical_depth_blue;
    // At `certified`, the exact hit is not beyond hit.high, and only hit.object may be hit before `rival`.
    // For OCCLUSION, hit.uncertain marks the lanes with an uncertain hit.
    real rival;
} Traversal;

// Optical depths are -log2(transmission) in integer steps. OPTICAL_DEPTH_MAX is that of opaque objects;
// transparent ones add up to no more than OPTICAL_DEPTH_PASSING, which still lets light pass.
#if IS_DOUBLE
#define OPTICAL_DEPTH_STEPS   0x1p48
#define OPTICAL_DEPTH_MAX     0x7f000000000000L
#define OPTICAL_DEPTH_PASSING ((long)PASSING_DEPTH_MAX << 48)
#else
#define OPTICAL_DEPTH_STEPS   0x1p24f
#define OPTICAL_DEPTH_MAX     OPAQUE
#define OPTICAL_DEPTH_PASSING (PASSING_DEPTH_MAX << 24)
#endif

// Returns an object's type_index_material. Within an instance, ids are those of its mesh, from 0.
static inline uint4 object_entry(const Traversal *traversal, const Scene *scene, uint id)
{
    if (!HAS_INSTANCES) return scene->objects[id].type_index_material;
    if (traversal->within.is_instance)
        return range_entry(scene, &traversal->within, traversal->within.first + id);
    const ObjectRange range = object_range(scene, id);
    return range_entry(scene, &range, id);
}

// Returns the index of an object's material.
static inline uint object_material(const Traversal *traversal, const Scene *scene, uint id)
{
    return object_entry(traversal, scene, id).z;
}

static inline integer optical_depth_steps(uint4 steps)
{
#if IS_DOUBLE
    return (integer)(steps.x == OPAQUE ? OPTICAL_DEPTH_MAX : upsample(as_int(steps.z), steps.y));
#else
    return integer_of(steps.x);
#endif
}

static inline integer optical_depth_sum(integer sum, integer added)
{
    const integer opaque = (integer)(OPTICAL_DEPTH_MAX);
    integer largest =
        lanes_select((added < opaque) & (sum < opaque), (integer)(OPTICAL_DEPTH_PASSING), opaque);
    return lanes_select(sum < largest - added, sum + added, largest);
}

static inline bool object_is_opaque(const Traversal *traversal, const Scene *scene, uint id)
{
    return scene->materials[object_material(traversal, scene, id)].reflection_transmission_ior.y == 0;
}

// Reduces the light of the lanes that hit an object, and deactivates those that have none left.
static inline void traversal_occlude(Traversal *traversal, const Scene *scene, mask found, uint id)
{
    if (!HAS_TRANSMISSION) {
        traversal->active = traversal->active & !found;
        return;
    }
    global const FlatMaterial *material = &scene->materials[object_material(traversal, scene, id)];
    integer optical_depth =
        optical_depth_sum(traversal->optical_depth, optical_depth_steps(material->optical_depth));
    traversal->optical_depth = lanes_select(found, optical_depth, traversal->optical_depth);
    integer least = traversal->optical_depth;
    if (HAS_FILTERS) {
        integer green = optical_depth_sum(traversal->optical_depth_green,
                                          optical_depth_steps(material->optical_depth_green));
        integer blue = optical_depth_sum(traversal->optical_depth_blue,
                                         optical_depth_steps(material->optical_depth_blue));
        traversal->optical_depth_green = green = lanes_select(found, green, traversal->optical_depth_green);
        traversal->optical_depth_blue = blue = lanes_select(found, blue, traversal->optical_depth_blue);
        least = lanes_select(green < least, green, least);
        least = lanes_select(blue < least, blue, least);
    }
    traversal->active = traversal->active & (least < (integer)(OPTICAL_DEPTH_MAX));
}

// Records crossings in the lanes `found`. Among equally near ones the lowest id counts, so that the image
// does not depend on the order of objects. Occlusion counts only for active lanes. A closest hit counts for
// any lane that carries a ray, because it is valid whichever group found it, and recording it
// twice is harmless.
static inline void traversal_record(Traversal *traversal, const Scene *scene, mask found, real t, uint id)
{
    Hit *hit = &traversal->hit;
    if (traversal->query == OCCLUSION) {
        traversal_occlude(traversal, scene, found & traversal->active & (t < hit->t), id);
        return;
    }
    if (HAS_TRANSMISSION && traversal->query == CLOSEST_OPAQUE_HIT && !object_is_opaque(traversal, scene, id))
        return;
    if (HAS_INSTANCES) id += traversal->within.first;
    integer object = integer_of(id);
    mask tie = (t == hit->t) & (object < hit->object);
    mask closer = found & ((t < hit->t) | tie);
    real_replace(&hit->t, closer, t);
    hit->object = lanes_select(closer, object, hit->object);
}

// Records a hit with bounds. Keeps the nearest certain hit; every other hit becomes a rival. Therefore
// neither the uncertain lanes nor the hits of the other lanes depend on the order in which shapes are tested.
static inline void traversal_record_certain(Traversal *traversal, const Scene *scene, const CertainHit *found,
                                            uint id)
{
    Hit *hit = &traversal->hit;
    if (traversal->query == OCCLUSION) {
        hit->uncertain = hit->uncertain | (found->uncertain & traversal->active);
        traversal_occlude(traversal, scene, found->found & traversal->active, id);
        return;
    }
    if (HAS_TRANSMISSION && traversal->query == CLOSEST_OPAQUE_HIT && !object_is_opaque(traversal, scene, id))
        return;
    integer object = integer_of(id);
    mask is_new =
        (found->found | found->uncertain) & (hit->object != object); // it may have been tested before
    mask closer = found->found & is_new & (found->t < hit->t);
    // the bound of the hit that is not kept, the farther or the uncertain one
    real other = lanes_select(closer, hit->low, found->low);
    real_replace(&traversal->rival, is_new, real_min(traversal->rival, other));
    // bounds the exact ray's first hit, whichever shape has it
    real_replace(&hit->high, found->found, real_min(hit->high, found->high));
    real_replace(&hit->t, closer, found->t);
    real_replace(&hit->low, closer, found->low);
    hit->object = lanes_select(closer, object, hit->object);
}

// Sets the hit's uncertain lanes, once all shapes have been tested.
static inline void traversal_classify(Traversal *traversal)
{
    if (traversal->query == OCCLUSION)
        traversal->hit.uncertain = traversal->hit.uncertain & traversal->active;
    else
        traversal->hit.uncertain = traversal->active & !(traversal->rival > traversal->hit.high);
}

// Returns the t beyond which nothing is hit first.
static inline real hit_limit(const Hit *hit)
{
    return IS_CERTIFIED ? hit->high : hit->t;
}

// Returns the tmax of each lane, -LARGEST in finished lanes. It is below LARGEST, the entry distance of a
// child that no ray hits.
static inline real traversal_tmax(const Traversal *traversal)
{
    return lanes_select(traversal->active, real_min(hit_limit(&traversal->hit), (real)(LARGEST / 2)),
                        (real)(-LARGEST));
}

#endif
