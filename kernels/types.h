// The flat structs that host and kernels share, one array per shape.
//
// In the kernels `scalar` is float or double, the kernel's own precision. The host writes double and narrows
// each array on upload. So in every struct the scalar4 members come first, the uint4 members last: then no
// member needs padding, and narrowing goes element by element (tests/test_layout.c checks each on the
// device).
//
// Positions are relative to the eye that the scene was compiled for. Axes and normals are the scene's own,
// scaled by a power of two to a length in 1/2..1, so that they are exact and never overflow.
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
    uint4 id;              // x: the object's id, y: IGNORES_FRONT_FACES | HAS_POWER
} Sphere;

// In a shape's id.y. The eye's power defines the shape: of a sphere |center|^2 - radius^2 before either is
// rounded, instead of the radius. Next to a planet the two round to half a meter, the power to an ulp of the
// distance. id.z: its bits as a float, or id.z, id.w: low and high half of its bits as a double.
enum { HAS_POWER = 16 };

// In a shape's id.y: front faces are ignored, only rays from inside hit. Never with REVOLUTION_CAPPED.
enum { IGNORES_FRONT_FACES = 8 };

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
    scalar4 foot; // with HAS_POWER its plane's point nearest to the eye
    uint4 id;     // y: HAS_POWER, of the sphere around it
} Disc;

typedef struct {
    scalar4 low, high;
    uint4 id;
} Box;

// Cylinder and cone: the points with |p x axis| = radius |axis| + slope (p . axis), p from the base, for an
// axis of any length.
//
// With HAS_POWER the base is the axis' point nearest to the eye, heights along the axis are those above the
// eye, and the power is |m|^2 - R^2 at the eye (kernels/shapes/revolution.h).
typedef struct {
    scalar4 base_radius; // xyz base (an infinite cone's apex), w radius at the base times |axis|
    scalar4 axis_slope;  // xyz axis, w slope: the tangent of the half-angle, 0 for a cylinder
    scalar4 range;       // where finite p . axis runs from w, 0 without a power, to x; y: |axis|; z: |axis|^2
    uint4 id;            // y: REVOLUTION_FINITE | REVOLUTION_CAPPED | IGNORES_FRONT_FACES | HAS_POWER
} Revolution;

enum { REVOLUTION_FINITE = 1, REVOLUTION_CAPPED = 2 };

typedef Revolution Cylinder;
typedef Revolution Cone;

typedef struct {
    scalar4 center_major; // w: radius of the circle
    scalar4 axis_minor;   // unit; w: radius of the tube, r
    // With HAS_POWER, seen from the eye: a / r and A / r, where a leads to the eye from the circle's nearest
    // point and A is its part along `radial`, the unit direction away from the axis; the eye's distance from
    // that. The power is (|a|^2 - r^2) / (2 r) (kernels/shapes/torus.h).
    scalar4 gradient; // w: A / r
    scalar4 radial;   // w: the eye's distance from the axis
    uint4 id;         // y: HAS_POWER
} Torus;

typedef struct {
    scalar4 a, b, c; // w: x, y and z of the normal; the largest is 1/2 to 1, or all are 0
    // y: 1 + index of its TriangleNormals, 0: flat; z: 1 + index of its TriangleUvs, 0: none. w: the bits of
    // normal . (a - eye) before a is rounded, as a float; 0: the rounded a will do.
    uint4 id;
} Triangle;

// Apart from Triangle: every intersection test reads that, only the closest hit reads these.
typedef struct {
    scalar4 a, b, c; // unit
} TriangleNormals;

// At `certified`, of a triangle, or of any object, whose id is the index: the ids of the triangles across the
// edges opposite a, b and c, and 3 bits for each, from the lowest on. They are set where signs of exact
// arithmetic on the scene's vertices say so.
typedef struct {
    uint4 ids_sides;
} TriangleNeighbors;

enum { NEIGHBOR_HAS_THIS_BEHIND = 1, NEIGHBOR_IN_FRONT = 2, NEIGHBOR_BEHIND = 4, NEIGHBOR_SIDES_BITS = 3 };
#define NO_NEIGHBOR 0xfffffffeu

// Texture coordinates.
typedef struct {
    scalar4 a_b;       // u and v of a, u and v of b
    scalar4 c_density; // u and v of c; z: texels of the full texture per unit of length
} TriangleUvs;

// The points with |p x axis|^2 = k (p . axis), p from the apex.
typedef struct {
    scalar4 apex_k;   // w: k, 4 |axis| times the focal length
    scalar4 axis_end; // w: p . axis runs from 0 to this where finite
    // With HAS_POWER the axis' point nearest to the eye, and in w its p . axis, which axis_end.w then lacks;
    // the power is |m|^2 - k p . axis at the eye (kernels/shapes/paraboloid.h).
    scalar4 foot_lift;
    uint4 id; // y: REVOLUTION_FINITE | REVOLUTION_CAPPED | HAS_POWER
} Paraboloid;

// Every shape: feature, struct, name, name of its array. Adding a shape begins here: docs/adding-a-shape.md.
// clang-format off
#define SHAPE_LIST(SHAPE)                           \
    SHAPE(SPHERES,   Sphere,   sphere,   spheres)   \
    SHAPE(PLANES,    Plane,    plane,    planes)    \
    SHAPE(DISCS,     Disc,     disc,     discs)     \
    SHAPE(BOXES,     Box,      box,      boxes)     \
    SHAPE(CYLINDERS, Cylinder, cylinder, cylinders) \
    SHAPE(CONES,     Cone,     cone,     cones)     \
    SHAPE(TRIANGLES, Triangle, triangle, triangles) \
    SHAPE(TORI,      Torus,    torus,    tori)      \
    SHAPE(PARABOLOIDS, Paraboloid, paraboloid, paraboloids)
// clang-format on

#define SHAPE_KIND(feature, Type, name, names) KIND_##feature,
enum { SHAPE_LIST(SHAPE_KIND) KIND_COUNT, KIND_QUARTETS = (KIND_COUNT + 3) / 4 };

// A BVH node: the boxes of up to BVH_WIDTH children, as arrays of low x, low y, low z, high x, high y and
// high z. A child is another node, or a leaf of the primitives first .. first + count - 1 of one kind. With
// several lanes a leaf of triangles is a block. The box of an empty slot is inverted, low above high.
//
// The host makes nodes as wide as the kernel's packets, and at least 4 wide.
enum { BVH_WIDTH_MIN = 4, BVH_WIDTH_MAX = 16 };
enum { BVH_LOW = 0, BVH_HIGH = 3, BVH_PLANES = 6 };
#ifdef __OPENCL_VERSION__
#define BVH_WIDTH   (LANES < BVH_WIDTH_MIN ? BVH_WIDTH_MIN : LANES)
#define BVH_QUARTER (BVH_WIDTH >> 2)
typedef struct {
    scalar4 planes[BVH_PLANES * BVH_QUARTER];
    uint4 child_index[BVH_QUARTER]; // the child's node, first primitive or block of triangles
    uint4 child_kind[BVH_QUARTER];  // BVH_NODE, or a leaf's count << 8 | kind; 16 bits, count <= 255
} BvhNode;
#endif

enum { BVH_NODE = 0xff };

// The vertices of a leaf's triangles, for kernels with several lanes, which test a lane per triangle
// (kernels/traversal/triangle_block.h): rows of a.x, a.y, a.z, b.x ... c.z, as wide as a node. Triangles that
// a leaf lacks repeat its first one.
enum { BLOCK_ROWS = 9 };
#ifdef __OPENCL_VERSION__
typedef struct {
    scalar4 rows[BLOCK_ROWS * BVH_QUARTER];
} TriangleBlock;
#endif

// The first triangles of four blocks.
typedef struct {
    uint4 triangles;
} BlockPlaces;

// A bounding sphere as seen from a common origin: a point that all rays of a packet pass through, the eye or
// a point or spot light. Each common origin has a row of SceneHeader's cull_spheres.x of them: one of the
// whole BVH, then one of each primitive outside it, kind by kind; planes have none.
//
// xyz: v, from the common origin to the center; w: the origin's power |v|^2 - radius^2, lowered by
// CULL_SPHERE_SLACK u |v|^2. With v = 0, -CULL_SPHERE_MAX is never culled (unbounded, or out of float's
// range) and +CULL_SPHERE_MAX always (an empty BVH).
typedef struct {
    scalar4 center_power;
} CullSphere;

#define CULL_SPHERE_MAX 1e37f

// The enlargement of cull spheres, in units of roundoff: of |v|^2, and of the ray's direction squared.
enum { CULL_SPHERE_SLACK = 256, CULL_DIRECTION_SLACK = 128 };
// At `certified` the exact shadow ray may be off by SHADOW_ERROR_MAX u of the distance
// (kernels/shading/phong.h), and near misses count: the lights' spheres, of a radius below |v|, are enlarged
// by that, too.
enum { CERTIFIED_CULL_SPHERE_SLACK = 1 << 10, CERTIFIED_CULL_DIRECTION_SLACK = 1 << 10 };

enum { COMMON_ORIGIN_NONE, COMMON_ORIGIN_EYE, COMMON_ORIGIN_FIRST_LIGHT };

// What an object's id refers to.
typedef struct {
    uint4 kind_index_material; // x: KIND_…, y: index in that shape's array, z: index of the material
} ObjectEntry;

typedef struct {
    scalar4 color;       // rgb, w: ka
    scalar4 diffuse;     // kd rgb, w: ks
    scalar4 other_color; // the checker's second color, w: shininess
    scalar4 grid;        // xyz: the eye's position in checker cells, w: cells per unit; 0: no checker
    scalar4 reflection_transmission_ior; // w: texels of the texture per unit of length, on planes and discs
    // What a shadow ray loses here: -log2(transmission) in integer steps, whose sum does not depend on the
    // order of the objects. x: steps of 2^-24, for float; y, z: low and high half of steps of 2^-48, for
    // double.
    uint4 optical_depth;
    // x: 1 + the index of its first level, 0: none; y: number of levels; z, w: WRAP_… along u and v
    uint4 texture;
} Material;

// What a texture shows beyond its edges.
enum { WRAP_REPEATED, WRAP_CLAMPED, WRAP_MIRRORED };

// One level of a texture's mipmap, each half the size of the one before, down to one texel.
typedef struct {
    uint4 place; // x: index of its first texel, top left; y: width, z: height
} TextureLevel;

typedef struct {
    uint4 color; // xyz: the bits of red, green and blue as floats
} Texel;

enum { OPAQUE = 0x7fffffff };     // in optical_depth.x: no light passes
enum { PASSING_DEPTH_MAX = 125 }; // the largest -log2(transmission) of which a float is normal after rounding

// The largest bounce depth.
enum { BOUNCES_MAX = 255 };

// The signature of a ray tree: PATH_START, then per ray, depth first and reflected before refracted,
// 32 bits of (signature ^ (id + 1) * PATH_EVENTS + events) * PATH_FACTOR. The id is that of the object hit,
// -1 for the background; events are the bounces there, 0 for none. (Fowler, Noll, Vo: FNV-1a, by words
// instead of bytes.)
enum { PATH_REFLECTED = 1, PATH_REFRACTED = 2, PATH_TOTAL_REFLECTION = 4, PATH_EVENTS = 8 };
#define PATH_START  0x811c9dc5u
#define PATH_FACTOR 0x01000193u

// At `certified` a sample's color is within this part of its largest channel, or of 1 if that is more, of the
// exact one, unless a texture is on its path.
#define CERTIFIED_COLOR_ERROR 0x1p-8

// The tile of pixels that a packet of 1, 4, 8 or 16 lanes covers.
#define TILE_WIDTH_OF(lanes)  ((lanes) >= 8 ? 4 : (lanes) == 4 ? 2 : 1)
#define TILE_HEIGHT_OF(lanes) ((lanes) == 16 ? 4 : (lanes) == 1 ? 1 : 2)

// The macro-tile that a work-item renders: a square of as many tiles as a packet has lanes. On a CPU each
// work-item is a work-group of its own, which costs PoCL some hundred cycles to start.
#define MACRO_TILE_COLUMNS_LOG2_OF(lanes) ((lanes) == 16 ? 2 : (lanes) == 1 ? 0 : 1)
#define MACRO_TILE_COLUMNS_OF(lanes)      (1 << MACRO_TILE_COLUMNS_LOG2_OF(lanes))
#define MACRO_TILE_ROWS_OF(lanes)         ((lanes) >> MACRO_TILE_COLUMNS_LOG2_OF(lanes))

// The scalars of an explicit ray and of its result (kernels/trace.h): the offset of each vector. closest.cl
// fills CLOSEST_SCALARS per ray, trace.cl all.
enum { RAY_ORIGIN, RAY_DIRECTION = 3, RAY_TMIN = 6, RAY_TMAX, RAY_SCALARS };
enum {
    RESULT_T,
    RESULT_NORMAL,
    RESULT_POSITION = 4,
    RESULT_LOW = 7,
    RESULT_HIGH,
    RESULT_DOUBT,
    CLOSEST_SCALARS,
    RESULT_REFLECTED_ORIGIN = CLOSEST_SCALARS,
    RESULT_REFLECTED_DIRECTION = 13,
    RESULT_REFRACTED_ORIGIN = 16,
    RESULT_REFRACTED_DIRECTION = 19,
    RESULT_REFRACTED_WEIGHT = 22,
    RESULT_TRANSMITTANCE,
    RESULT_SCALARS
};

// The ray counters of a counting build.
enum { RAYS_CAMERA, RAYS_CAMERA_HITS, RAYS_REFLECTED, RAYS_REFRACTED, RAYS_SHADOW, RAYS_COUNT };

enum { LIGHT_KIND_POINT, LIGHT_KIND_DIRECTIONAL, LIGHT_KIND_SPOT };

typedef struct {
    scalar4 color;     // w: the largest of its channels
    scalar4 position;  // from the eye; point and spot
    scalar4 direction; // unit, away from the light; directional and spot
    // spot: x: 1 - cos(half-angle), from the axis to the edge; y: 1 - cos(half-angle - penumbra), which no
    // kernel reads; z: 1 / (x - y), 0 for a hard edge
    scalar4 cone;
    uint4 kind; // x: LIGHT_KIND_…
} Light;

typedef struct {
    scalar4 background, ambient;
    // A camera ray: from the eye along forward + x right + y up, x and y in half pixels from the image's
    // center. The eye is the origin, but for a preview of a scene compiled for another eye.
    scalar4 eye, forward, right, up;
    scalar4 bounds;                  // of the BVH; xyz: center, w: largest |x| + |y| + |z| from there
    scalar4 bounds_low, bounds_high; // its corners
    // corners of a box around all points where a transparent object may touch an opaque one; low above high
    // where none does
    scalar4 contact_low, contact_high;
    // x: width of a sample's share of a pixel, at distance 1; y: the first rival of every hit at `certified`,
    // the largest scalar, or its negative where no bound holds and so every hit is in doubt
    scalar4 sample;
    uint4 image;                     // x: width, y: height, z: samples per pixel, w: number of lights
    uint4 bounces;                   // x: largest depth
    uint4 cull_spheres;              // x: number per common origin, 0: none
    uint4 counts[KIND_QUARTETS];     // of each KIND_…, in that order
    uint4 bvh_counts[KIND_QUARTETS]; // of these those in the BVH, which come first
} SceneHeader;

// The arena is one buffer with the header and then these arrays, because devices allow a kernel as few as 8
// buffers. Nodes and texels have separate ones, because devices limit the size of each. ARRAY(NAME, struct, a
// shape's name, name of the array).
// clang-format off
#define ARENA_LIST(ARRAY)                                              \
    SHAPE_LIST(ARRAY)                                                  \
    ARRAY(TRIANGLE_NORMALS, TriangleNormals, , triangle_normals)       \
    ARRAY(TRIANGLE_UVS, TriangleUvs, , triangle_uvs)                   \
    ARRAY(TRIANGLE_NEIGHBORS, TriangleNeighbors, , triangle_neighbors) \
    ARRAY(TRIANGLE_BLOCKS, TriangleBlock, , triangle_blocks)           \
    ARRAY(BLOCK_PLACES, BlockPlaces, , block_places)                   \
    ARRAY(CULL_SPHERES, CullSphere, , cull_spheres)                    \
    ARRAY(OBJECTS, ObjectEntry, , objects)                             \
    ARRAY(MATERIALS, Material, , materials)                            \
    ARRAY(LIGHTS, Light, , lights)                                     \
    ARRAY(TEXTURE_LEVELS, TextureLevel, , texture_levels)
// clang-format on

// Where each begins, in units of the largest alignment, that of a double16.
enum { ARENA_UNIT = 128 };
#define ARENA_OFFSET(NAME, Type, name, names) unsigned names;
typedef struct {
    ARENA_LIST(ARENA_OFFSET)
} ArenaOffsets;

#endif
