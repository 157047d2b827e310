// Pseudorandom rays and meshes. All but scene_far_sphere use only + - * / and sqrt, which IEEE 754 rounds
// correctly, so their bits are the same on every machine.
#pragma once

#include "host/render/trace.h"
#include "host/scene/scene.h"
#include <stdbool.h>
#include <stddef.h>

typedef TraceRay (*RayFamily)(uint64_t index);

// Return counter-based random numbers in dimension `dimension`, 0 to 31, of sample `index` of sequence
// `seed`. They are a number from 0 to 1, one from -1 to 1, a point of the cube from -1 to 1 and a unit
// vector. The last two use three dimensions.
double sample_number(unsigned seed, uint64_t index, unsigned dimension);
double sample_symmetric(unsigned seed, uint64_t index, unsigned dimension);
Vector3 sample_in_cube(unsigned seed, uint64_t index, unsigned first_dimension);
Vector3 sample_unit_vector(unsigned seed, uint64_t index, unsigned first_dimension);

TraceRay family_disc_rim(uint64_t index);         // P3
TraceRay family_in_room(uint64_t index);          // P5
TraceRay family_cylinder_rim(uint64_t index);     // C4
TraceRay family_along_torus_axis(uint64_t index); // T2
TraceRay family_across_torus(uint64_t index);     // T3
TraceRay family_near_sliver(uint64_t index);      // M4
TraceRay family_from_within(uint64_t index);      // M1

void scene_add_triangle(Scene *scene, const Vector3 vertices[3]);
void scene_triangle_room(Scene *scene); // the cube from -1 to 1
void scene_icosphere(Scene *scene);     // 20480 triangles, radii off by up to 20 %
// Adds a sphere of radius 2 around a distant center, made of 50 by 50 quadrilaterals.
void scene_far_sphere(Scene *scene);
extern const Vector3 far_sphere_center;
extern const Vector3 sliver_corners[3]; // M4's triangle
