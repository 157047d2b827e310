// A scene made ready for many rays of the reference: the triangles of its meshes as objects, so that an
// object's index is its id, and a bounding sphere of each object, outside of which it is not intersected.
#pragma once

#include "host/compile/shapes.h"
#include "host/verify/reference.h"

typedef struct {
    Scene scene;             // its lights, materials and textures are those of the scene it was made of
    BoundingSphere *spheres; // NULL: none, of a scene without meshes that few rays meet
} ReferenceScene;

ReferenceScene reference_scene_open(const Scene *scene); // which must outlive it
void reference_scene_close(ReferenceScene *scene);

// Returns the hit of one object, a miss where its bounding sphere is missed. `left`: the object on whose
// surface the ray starts, UINT32_MAX for the eye. A start on a surface does not hit it, nor another one that
// coincides: the start's height over a hit's tangent plane must exceed ray->tmin times the direction's
// length. The margin of the object that is left, 0 although nothing is open, does not count.
ReferenceHit reference_scene_hit_object(const ReferenceScene *scene, size_t index, const ReferenceRay *ray,
                                        uint32_t left);
// Returns the nearest hit of all objects.
ReferenceHit reference_scene_hit(const ReferenceScene *scene, const ReferenceRay *ray, uint32_t left);
