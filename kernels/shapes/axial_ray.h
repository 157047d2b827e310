// Describes a ray relative to a shape's axis w, in pairs. F is a point of the axis, and f leads from F to the
// ray's origin. m = f x w and q = d x w are perpendicular to the axis, and E = f x d is the moment.
#ifndef AXIAL_RAY_H
#define AXIAL_RAY_H

#include "shapes/eye_power.h"

typedef struct {
    PairVector m, q, moment;
    Pair height, rise;                 // f . w, or o . w with the eye's power and the ray's origin o; d . w
    Pair moment_on_axis, squared_axis; // E . w; w . w
} AxialRay;

// Fills *axial. Oclgrind rejects the code that clang generates for an inlined function that returns a struct.
static inline ALWAYS_INLINE void axial_ray_set(AxialRay *axial, uint4 id, Vector foot, Vector axis,
                                               const Ray *ray)
{
    const PairVector f = pair_vector_difference(ray->origin, foot), d = pair_vector_of(ray->direction),
                     w = pair_vector_of(axis), moment = pair_vector_cross(f, ray->direction);
    const PairVector from = has_eye_power(id) ? pair_vector_of(ray->origin) : f;
    *axial = (AxialRay){pair_vector_cross(f, axis),
                        pair_vector_cross(d, axis),
                        moment,
                        pair_vector_dot_vector(from, axis),
                        pair_vector_dot_vector(d, axis),
                        pair_vector_dot_vector(moment, axis),
                        pair_vector_dot(w, w)};
}

// Returns (o x w) . ((o - 2 F) x w), the difference of m . m from its value at the eye. A rounding of
// F counts only in proportion to the origin's distance from the eye.
static inline Pair axial_power_change(Vector foot, Vector axis, const Ray *ray)
{
    const PairVector beyond = pair_vector_difference(ray->origin, vector_scale(foot, (real)(2)));
    return pair_vector_dot(pair_vector_cross(pair_vector_of(ray->origin), axis),
                           pair_vector_cross(beyond, axis));
}

#endif
