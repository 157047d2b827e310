// The flat structs that host and kernels share, one array per shape.
//
// In the kernels `scalar` is float or double, the kernel's own precision. The host writes double and narrows
// each array on upload. That needs one rule: in every struct the scalar4 members come first, the uint4
// members last (tests/test_layout.c checks each on the device).
//
// Positions are relative to the eye. Axes and normals are the scene's own, scaled by a power of two to a
// length in 1/2..1, so that they are exact and never overflow.
#ifndef TYPES_H
#define TYPES_H

#ifndef __OPENCL_VERSION__
#include <stdint.h>

typedef struct {
    _Alignas(32) double x;
    double y, z, w;
} scalar4;

typedef struct {
    _Alignas(16) uint32_t x;
    uint32_t y, z, w;
} uint4;
#endif

typedef struct {
    scalar4 center_radius; // xyz center, w radius
    uint4 id;              // x: the object's id, y: ONLY_INSIDE
} Sphere;

// In a shape's id.y: rays from outside pass through its near side.
enum { ONLY_INSIDE = 8 };

typedef struct {
    scalar4 point;
    scalar4 normal;         // w: 1 / its length
    scalar4 grid_u, grid_v; // checker squares, or texture repeats, along the plane: u = xyz . p + w
    uint4 id;
} Plane;

typedef struct {
    scalar4 center_radius;
    scalar4 normal; // w: 1 / its length
    scalar4 grid_u, grid_v;
    uint4 id;
} Disc;

typedef struct {
    scalar4 low, high;
    uint4 id;
} Box;

// Cylinder and cone: the points with |p x axis| = radius + slope (p . axis), p from the base. Radius and
// slope are in units of |axis|, so that the axis need not be unit.
typedef struct {
    scalar4 base_radius; // xyz base (an infinite cone's apex), w radius at the base times |axis|
    scalar4 axis_slope;  // xyz axis, w slope
    scalar4 range;       // x: p . axis runs from 0 to this where finite; y: |axis|; z: |axis|^2
    uint4 id;            // y: REVOLUTION_FINITE | REVOLUTION_CAPPED | ONLY_INSIDE
} Revolution;

enum { REVOLUTION_FINITE = 1, REVOLUTION_CAPPED = 2 };

typedef Revolution Cylinder; // slope 0
typedef Revolution Cone;

typedef struct {
    scalar4 center_major; // w: radius of the circle
    scalar4 axis_minor;   // unit; w: radius of the tube
    uint4 id;
} Torus;

typedef struct {
    scalar4 a, b, c;         // w: x, y and z of the normal; the largest is 1/2 to 1, or all are 0
    uint4 bounded_counts[2]; // of these the ones in the BVH, which come first
} SceneHeader;

#endif
