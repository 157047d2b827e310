// Describes objects in words, for people who look for them in a scene's file.
#pragma once

#include "host/scene/scene.h"

// Returns the object that contains the primitive with this id, or NULL if there is none. Sets *primitive to
// the primitive's index in the object.
const Object *scene_find_object(const Scene *scene, size_t id, size_t *primitive);
// Returns the index of the material of one of an object's primitives.
uint32_t object_material(const Scene *scene, const Object *object, size_t primitive);
// Returns a text such as `sphere 12, scene.yaml:9, material red` or `triangle 3 of mesh 12, bunny.ply,
// scene.yaml:9, material red`, where 12 is the first id of the object and `path` is the scene's file. Returns
// "nothing" if no object has the id.
void object_describe(Text *text, const Scene *scene, const char *path, size_t id);
