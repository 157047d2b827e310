// The scene as the kernels see it, its closest hit and whether anything blocks a ray. Both ask the same function of
// each shape, so that they can never disagree.
#ifndef SCENE_H
#define SCENE_H

#include "disc.h"
#include "plane.h"
#include "revolution.h"
#include "sphere.h"
#include "triangle.h"

#define SCENE_SHAPE_MEMBER(feature, Type, name) global const Type *name##s;
typedef struct {
    global const SceneHeader *header;
    SHAPE_LIST(SCENE_SHAPE_MEMBER)
    global const ObjectEntry *objects;
    global const Material *materials;
    global const Light *lights;
} Scene;

// The scene's arrays as kernel arguments, and the Scene made of them: the same list in the same order in each kernel.
#define SCENE_SHAPE_ARGUMENT(feature, Type, name) global const Type *name##s,
#define SCENE_ARGUMENTS                                                                                      \
    global const SceneHeader *header, SHAPE_LIST(SCENE_SHAPE_ARGUMENT) global const ObjectEntry *objects,    \
        global const Material *materials, global const Light *lights
#define SCENE_SHAPE_VALUE(feature, Type, name) name##s,
#define SCENE_FROM_ARGUMENTS                                                                                 \
    {                                                                                                        \
        header, SHAPE_LIST(SCENE_SHAPE_VALUE) objects, materials, lights                                     \
    }

static inline uint scene_shape_count(const Scene *scene, uint kind)
{
    return ((global const uint *)scene->header->counts)[kind];
}

// Keeps a crossing that is nearer, or as near and of a lower id: the picture does not depend on the objects' order.
static inline void hit_keep(Hit *hit, mask found, real t, uint id)
{
    integer object = (integer)((scalar_integer)id);
    mask tie = (t == hit->t) & (object < hit->object);
    mask closer = found & ((t < hit->t) | tie);
    hit->t = lanes_select(closer, t, hit->t);
    hit->object = lanes_select(closer, object, hit->object);
}

static inline Hit closest_hit(const Scene *scene, const Ray *ray)
{
    Hit hit = {ray->far, (integer)(-1)};
#define CLOSEST_OF_SHAPE(feature, Type, name)                                                                \
    if (HAS_##feature) {                                                                                     \
        uint count = scene_shape_count(scene, KIND_##feature);                                               \
        for (uint i = 0; i < count; i++) {                                                                   \
            Type shape = scene->name##s[i];                                                                  \
            real t = ray->far;                                                                               \
            mask found = name##_hit(&shape, ray, &t);                                                        \
            if (lanes_any(found)) hit_keep(&hit, found, t, shape.id.x);                                      \
        }                                                                                                    \
    }
    SHAPE_LIST(CLOSEST_OF_SHAPE)
    return hit;
}

static inline mask hit_found(const Hit *hit)
{
    return hit->object >= (integer)(0);
}

// Which of the active lanes meet anything between near and far.
static inline mask occluded(const Scene *scene, const Ray *ray)
{
    mask free_ = ray->active;
#define BLOCKED_BY_SHAPE(feature, Type, name)                                                                \
    if (HAS_##feature) {                                                                                     \
        uint count = scene_shape_count(scene, KIND_##feature);                                               \
        for (uint i = 0; i < count && lanes_any(free_); i++) {                                               \
            Type shape = scene->name##s[i];                                                                  \
            real t = ray->far;                                                                               \
            mask found = name##_hit(&shape, ray, &t);                                                        \
            free_ = free_ & !(found & (t < ray->far));                                                       \
        }                                                                                                    \
    }
    SHAPE_LIST(BLOCKED_BY_SHAPE)
    return ray->active & !free_;
}

#endif
