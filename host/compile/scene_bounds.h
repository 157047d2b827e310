// Bounds a scene's objects.
#pragma once

#include "host/scene/bounds.h"
#include "host/scene/scene.h"

typedef struct {
    Bounds bounds;          // of all bounded objects
    size_t unbounded_count; // of the others
    double least_width;     // of all boxes whose width is not 0, infinite if there are none
    double largest_stretch; // the largest ratio of lengths of an oval's mapped rays, at least 1
} SceneExtent;

// Measures the boxes of all objects.
SceneExtent scene_extent(const Scene *scene);

// Returns the second largest side of a box, or the largest if the others are 0: the size of what has a length
// and a flat or round section.
double box_width(const Bounds *bounds);

// Returns the distance of a box's farthest side from a point, along an axis.
double box_reach(const Bounds *bounds, Vector3 from);
