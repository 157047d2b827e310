// The color of a surface in quadruple precision, from a checker's squares, Phong's reflection of the lights
// and the objects that occlude them.
#pragma once

#include "host/verify/random_shape.h"
#include "host/verify/reference_color.h"

// The largest distance of a computed point from its surface, relative to the numbers it was computed from.
// It is far above the rounding of quadruple precision and far below that of double.
#define START_PART ((Quad)0x1p-90L)

typedef struct {
    Quad3 point;
    Quad3 normal, geometric; // unit, facing the eye
    Quad3 to_eye;            // unit
    Quad scale;              // the point's distance from the ray's origin
    Quad start;              // the surface is at most this far from the point
    Quad3 lift;              // from the point to the start of rays to lights
    bool is_lifted;
    bool entering;
    uint32_t index; // of the object
    const Object *object;
    const Material *material;
    Color base;
} ShadedPoint;

const Material *reference_material(const Scene *scene, size_t object);
// Returns a random point of a sphere of this size around 0.
Quad3 random_offset(Random *random, double size);

// Returns the surface that a ray hit, moved along itself and turned by up to `blur`. Reduces the hit's margin
// at the edges of a checker's squares.
ShadedPoint shaded_point(const ReferenceScene *world, const ReferenceRay *ray, ReferenceHit *hit, double blur,
                         Random *random);
// Returns a surface's color. Sets `shadows`, unless NULL, to whether each light fails to reach the surface.
ReferenceColor shaded_color(const ReferenceScene *world, const ShadedPoint *surface, double margin,
                            bool *shadows);
// Returns the background in a direction of any length.
Color reference_background(const Scene *scene, Quad3 direction);
