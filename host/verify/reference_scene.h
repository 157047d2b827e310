// A scene prepared for many rays of the reference. Its meshes are expanded to triangles, so that an object's
// index is its id, and each object has a bounding sphere, outside of which it is not intersected.
#pragma once

#include "host/compile/shapes.h"
#include "host/verify/reference.h"

typedef struct {
    Scene scene;             // shares the lights, materials and textures of the scene it was made of
    BoundingSphere *spheres; // NULL for a scene without meshes and with few rays
} ReferenceScene;

ReferenceScene reference_scene_open(const Scene *scene); // the scene must outlive it
void reference_scene_close(ReferenceScene *scene);
#define OwnedReferenceScene __attribute__((cleanup(reference_scene_close))) ReferenceScene

// Returns the hit of one object, or a miss if its bounding sphere is missed. `left` is the object on whose
// surface the ray starts, UINT32_MAX for the eye. A start on a surface does not hit that surface or one that
// coincides with it, because the start's height over a hit's tangent plane must exceed ray->tmin times the
// direction's length. The margin of `left`, which is 0 although nothing is uncertain, is ignored.
ReferenceHit reference_scene_hit_object(const ReferenceScene *scene, size_t index, const ReferenceRay *ray,
                                        uint32_t left);
// Returns the nearest hit of all objects.
ReferenceHit reference_scene_hit(const ReferenceScene *scene, const ReferenceRay *ray, uint32_t left);

// Returns the ray through the center of a pixel, exactly that of the camera's vectors in double. Row 0 is at
// the top (docs/scene-format.md).
ReferenceRay reference_camera_ray(const Camera *camera, unsigned width, unsigned height, unsigned column,
                                  unsigned row);
