// Reflection and refraction in quadruple precision, by the laws of Snell and Fresnel.
#pragma once

#include "host/scene/quad.h"
#include <stdbool.h>

// Returns the direction of the reflected ray. Directions are unit vectors, and normals are on the ray's side.
Quad3 reference_reflect(Quad3 direction, Quad3 normal);
// Sets *refracted to the direction of the refracted ray. The sine behind the surface is `eta` times that in
// front of it. Returns false if it exceeds 1. Reduces the margin to the squared cosine behind the surface,
// which is negative then.
bool reference_refract(Quad3 direction, Quad3 normal, Quad eta, Quad3 *refracted, double *margin);

// Returns the part of unpolarized light that a body of this index reflects.
Quad reference_reflectance(Quad cosine, Quad ior, bool entering);
// Returns the part of unpolarized light that a conductor of index n + i k reflects.
double reference_conductor_reflectance(Quad cosine, double n, double k);
