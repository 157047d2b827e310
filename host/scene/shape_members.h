// The members of an object's shape that a map changes.
#pragma once

#include "host/scene/scene.h"

// Each list ends with NULL.
typedef struct {
    Vector3 *points[4];     // positions
    Vector3 *directions[4]; // axes and normals, of which only those of triangles may be zero
    double *lengths[3];
} ShapeMembers;

// Returns the members of an object, none for a mesh.
ShapeMembers shape_members(Object *object);

// Orders a box's corners after a map of its points. Leaves other shapes unchanged.
void box_order(Object *object);
