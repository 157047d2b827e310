// The flat structs that host and kernels share, one array of them per shape.
//
// The kernels see them in their own precision: `scalar` is float or double. The host always writes them in
// double and narrows an array as it uploads it; that needs one rule: in every struct the scalar4 members come
// first, the uint4 members last (tests/test_layout.c checks each on the device).
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

// In a shape's id.y: rays that come from outside pass through its near side unseen.
enum { ONLY_INSIDE = 8 };

typedef struct {
    scalar4 point;
    scalar4 normal;         // w: 1 / its length
    scalar4 grid_u, grid_v; // checker squares, or pictures, along the plane: u = xyz . p + w
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
    scalar4 base_radius; // xyz base (an infinite cone's common_origin), w radius at the base times |axis|
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
    scalar4 a, b, c; // w: x, y and z of the normal, whose largest is 1/2 to 1, or all 0
    uint4 id; // y: 1 + the index of its TriangleNormals, 0 where it is flat; z: 1 + that of its TriangleUvs,
              // or 0
} Triangle;

// Apart from the triangle, which is read for each ray that comes near it: these only where one is seen.
typedef struct {
    scalar4 a, b, c; // unit
} TriangleNormals;

// Where a picture lies on it.
typedef struct {
    scalar4 a_b;       // u and v of a, u and v of b
    scalar4 c_density; // u and v of c; z: texels of the full picture per unit of length
} TriangleUvs;

// Every shape: its feature, its struct, its name and its array's. Adding one begins here:
// docs/adding-a-shape.md.
// clang-format off
#define SHAPE_LIST(SHAPE)                           \
    SHAPE(SPHERES,   Sphere,   sphere,   spheres)   \
    SHAPE(PLANES,    Plane,    plane,    planes)    \
    SHAPE(DISCS,     Disc,     disc,     discs)     \
    SHAPE(BOXES,     Box,      box,      boxes)     \
    SHAPE(CYLINDERS, Cylinder, cylinder, cylinders) \
    SHAPE(CONES,     Cone,     cone,     cones)     \
    SHAPE(TRIANGLES, Triangle, triangle, triangles) \
    SHAPE(TORI,      Torus,    torus,    tori)
// clang-format on

#define SHAPE_KIND(feature, Type, name, names) KIND_##feature,
enum { SHAPE_LIST(SHAPE_KIND) KIND_COUNT };

// A node of the bounding volume hierarchy: the boxes of up to BVH_WIDTH children, of all children first the
// low x, then the low y and so on. A child is another node, or the primitives first .. first + count of one
// kind. Where there is none the box is inside out.
//
// The host makes nodes as wide as the kernel's packets are, but no narrower than 4.
enum { BVH_WIDTH_LEAST = 4, BVH_WIDTH_LARGEST = 16 };
enum { BVH_LOW = 0, BVH_HIGH = 3, BVH_PLANES = 6 };
#ifdef __OPENCL_VERSION__
#define BVH_WIDTH   (LANES < BVH_WIDTH_LEAST ? BVH_WIDTH_LEAST : LANES)
#define BVH_QUARTER (BVH_WIDTH >> 2)
typedef struct {
    scalar4 planes[BVH_PLANES * BVH_QUARTER];
    uint4 first[BVH_QUARTER]; // the child's node or first primitive
    uint4 what[BVH_QUARTER];  // BVH_NODE or count << 8 | kind, 16 bits
} BvhNode;
#endif

enum { BVH_NODE = 0xff, BVH_DEPTH_LARGEST = 80 };

// A ball around something, as seen from an common_origin: a point that all rays of a packet pass through, the
// eye or a light at a place. Each common_origin has a row of SceneHeader's cull_spheres.x of them: that of
// all that hangs in the hierarchy, then of each shape that does not, kind by kind; planes have none.
//
// xyz: from the common_origin to the center; w: the common_origin's power, |xyz|^2 - radius^2, lowered by
// CULL_SPHERE_SLACK u |xyz|^2, or -CULL_SPHERE_LARGEST around the unbounded.
typedef struct {
    scalar4 center_power;
} CullSphere;

#define CULL_SPHERE_LARGEST 1e37f

// What cull_spheres count as larger by, in units of roundoff: of |xyz|^2, and of the square of a ray's
// direction.
enum { CULL_SPHERE_SLACK = 256, CULL_DIRECTION_SLACK = 128 };

enum { COMMON_ORIGIN_NONE, COMMON_ORIGIN_EYE, COMMON_ORIGIN_FIRST_LIGHT };

// Where an object's id leads.
typedef struct {
    uint4 kind_index_material; // x: KIND_…, y: index in that shape's array, z: index of the material
} ObjectEntry;

typedef struct {
    scalar4 color;       // rgb, w: ka
    scalar4 diffuse;     // kd rgb, w: ks
    scalar4 other_color; // the checker's second color, w: shininess
    scalar4 grid;        // xyz: where the eye stands among the checker's cells, w: cells per unit; 0: plain
    scalar4 reflection_transmission_ior; // w: texels of the picture per unit of length, on planes and discs
    // How much light a shadow ray loses here, as -log2(transmission) in whole steps, whose sum does not
    // depend on the order of the objects. x: steps of 2^-24, for float; y, z: low and high half of steps of
    // 2^-48, for double.
    uint4 optical_depth;
    uint4 image; // x: 1 + the index of its picture's first level, 0: none; y: number of levels
} Material;

// A picture, full or halved again and again down to one texel.
typedef struct {
    uint4 place; // x: index of its first texel, the top left one; y: width, z: height
} TextureLevel;

typedef struct {
    uint4 color; // xyz: the bits of red, green and blue as floats
} Texel;

enum { OPAQUE = 0x7fffffff }; // in x: no light passes

// Of a ray's two bounces one waits while the other is followed: there is room for one at each depth.
enum { BOUNCES_LARGEST = 16 };

// The signature of a ray's way through the scene: from PATH_START on, for the ray itself and each that comes
// of it, the mirrored one and its offspring before the one that passes, 32 bits of
// (signature ^ (id + 1) * PATH_EVENTS + events) * PATH_FACTOR. The id is of the object met, -1 for the
// background; events tells what was sent on there, 0 where the object was only seen.
// (Fowler, Noll, Vo: FNV-1a, by words instead of bytes.)
enum { PATH_REFLECTED = 1, PATH_REFRACTED = 2, PATH_TOTAL_REFLECTION = 4, PATH_EVENTS = 8 };
#define PATH_START  0x811c9dc5u
#define PATH_FACTOR 0x01000193u

// The tile of neighboring pixels that a work-item of 1, 4, 8 or 16 lanes carries at once.
#define TILE_WIDTH_OF(lanes)  ((lanes) >= 8 ? 4 : (lanes) == 4 ? 2 : 1)
#define TILE_HEIGHT_OF(lanes) ((lanes) == 16 ? 4 : (lanes) == 1 ? 1 : 2)

// Neighboring tiles along a row that a work-item of several lanes carries, one after the other. As its own
// group, which it is on a CPU, it costs PoCL some hundred cycles to start.
enum { ITEM_TILES_LARGEST = 8 };

// The scalars of an explicit ray, and of what is answered to it (kernels/trace.cl): where each vector begins.
enum { RAY_ORIGIN, RAY_DIRECTION = 3, RAY_NEAR = 6, RAY_FAR, RAY_SCALARS };
enum {
    RESULT_T,
    RESULT_NORMAL,
    RESULT_POSITION = 4,
    RESULT_MIRRORED_ORIGIN = 7,
    RESULT_MIRRORED_DIRECTION = 10,
    RESULT_PASSED_ORIGIN = 13,
    RESULT_PASSED_DIRECTION = 16,
    RESULT_PASSED = 19,
    RESULT_LIGHT,
    RESULT_SCALARS
};

// What a counting build counts.
enum { RAYS_CAMERA, RAYS_CAMERA_HITS, RAYS_REFLECTED, RAYS_REFRACTED, RAYS_SHADOW, RAYS_COUNT };

enum { LIGHT_KIND_POINT, LIGHT_KIND_DIRECTIONAL, LIGHT_KIND_SPOT };

typedef struct {
    scalar4 color;
    scalar4 position;  // from the eye; point and spot
    scalar4 direction; // unit, the way the light travels; directional and spot
    scalar4
        cone; // spot: x: 1 - cos(half-angle), y: 1 - cos(angle - penumbra), z: 1 / (x - y), 0 for a hard edge
    uint4 kind; // x: LIGHT_KIND_…
} Light;

typedef struct {
    scalar4 background, ambient;
    // A picture's ray: forward + x right + y up, x and y in half pixels from the picture's center.
    scalar4 forward, right, up;
    scalar4 bounds; // of what hangs in the hierarchy: xyz: center, w: no point lies farther from it, summed
                    // over the axes
    scalar4 bounds_low, bounds_high; // its corners
    // corners of a box around all places where something transparent may touch something opaque; low is above
    // high where nothing does
    scalar4 contact_low, contact_high;
    scalar4 sample;          // x: width of a sample's share of a pixel, at distance 1
    uint4 picture;           // x: width, y: height, z: samples per pixel, w: number of lights
    uint4 bounces;           // x: of a ray, at most
    uint4 cull_spheres;      // x: of each common_origin; 0: there are none
    uint4 counts[2];         // of each KIND_…, in its order
    uint4 bounded_counts[2]; // as many of them, from the first, hang in the hierarchy
} SceneHeader;

#endif
