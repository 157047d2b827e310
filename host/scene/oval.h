// Ovals: round shapes under affine maps, such as ellipsoids.
#pragma once

#include "host/scene/affine.h"
#include "host/scene/scene.h"

// Converts a sphere, disc, cylinder, cone, torus or paraboloid to an oval with the same points.
void oval_make(Object *object);

// Transforms an oval. Among the maps that give the same points it chooses one that stretches little.
void oval_transform(Object *object, const Affine *affine);

// Returns whether axes have lengths and directions that are moderate enough for a mapped ray to stay
// accurate.
bool axes_are_moderate(const Vector3 axes[3]);

// Returns the unit shape, which lies around the z axis with its middle or apex at 0 and has the radius 1
// where it is widest.
Object oval_unit(const Object *oval);

// Returns the map from the unit shape to the oval.
Affine oval_map(const Object *oval);

// Returns the least and the greatest length of the oval's image of a unit vector.
void oval_stretches(const Object *oval, double *shortest, double *longest);

bool oval_is_bounded(const Object *oval);
