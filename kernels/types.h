// Defines the flat structs that host and kernels share, one array per shape.
//
// In the kernels `scalar` is float or double, the kernel's precision. The host writes double and narrows
// each array on upload. So in every struct the scalar4 members come first and the uint4 members last. Then
// no member needs padding, and narrowing proceeds element by element (tests/test_layout.c checks each struct
// on the device).
//
// Positions are relative to the eye that the scene was compiled for. Axes and normals are those of the scene,
// scaled by a power of two to a length in 1/2..1, so that they are exact and never overflow.
#ifndef TYPES_H
#define TYPES_H

#ifndef __OPENCL_VERSION__
#include <stdbool.h>
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

// Bits of a shape's id.y. If front faces are ignored, only rays from inside hit. Capped shapes never ignore
// them.
//
// HAS_POWER is set if the eye's power defines the shape. For a sphere the power is |center|^2 - radius^2
// before either is rounded, and it replaces the radius. Next to a planet, center and radius round to half a
// meter, the power to an ulp of the distance. id.z has its bits as a float, or id.z and id.w have the low and
// high half of its bits as a double.
enum { REVOLUTION_FINITE = 1, REVOLUTION_CAPPED = 2, IGNORES_FRONT_FACES = 4, HAS_POWER = 8 };

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
    scalar4 foot; // with HAS_POWER, the point of its plane nearest to the eye
    uint4 id;     // y: HAS_POWER, for the sphere around it
} Disc;

typedef struct {
    scalar4 low, high;
    uint4 id;
} Box;

// Roundings of the ends of a cylinder or cone turn its axis, and change its length, by less than this part of
// the length. Otherwise only the base is rounded.
#define AXIS_TURN_MAX 0x1p-6f

// A cylinder or cone: the points p, measured from the base, with |p x axis| = radius |axis| +
// slope (p . axis), for an axis of any length.
//
// With HAS_POWER the base is the point of the axis nearest to the eye, heights along the axis are measured
// from the eye's height, and the power is |m|^2 - R^2 at the eye (kernels/shapes/revolution_quadric.h).
typedef struct {
    scalar4 base_radius; // xyz base (an infinite cone's apex), w radius at the base times |axis|
    scalar4 axis_slope;  // xyz axis, w slope: the tangent of the half-angle, 0 for a cylinder
    scalar4 range;       // if finite, p . axis runs from w (0 without a power) to x; y: |axis|; z: |axis|^2
    uint4 id;            // y: REVOLUTION_FINITE | REVOLUTION_CAPPED | IGNORES_FRONT_FACES | HAS_POWER
} Revolution;

typedef Revolution Cylinder;
typedef Revolution Cone;

typedef struct {
    scalar4 center_major; // w: radius of the circle
    scalar4 axis_minor;   // unit; w: radius of the tube, r
    // With HAS_POWER, values seen from the eye. a leads to the eye from the circle's nearest point, and A is
    // its component along `radial`, the unit direction away from the axis. `gradient` is a / r. The power is
    // (|a|^2 - r^2) / (2 r) (kernels/shapes/torus.h).
    scalar4 gradient; // w: A / r
    scalar4 radial;   // w: the eye's distance from the axis
    uint4 id;         // y: HAS_POWER
} Torus;

typedef struct {
    scalar4 a, b, c; // w: x, y and z of the normal; the largest is 1/2 to 1, or all are 0
    // y: 1 + index of its TriangleNormals, or 0 if flat. z: 1 + index of its TriangleUvs, or 0. w: the bits
    // of normal . (a - eye) before a is rounded, as a float, or 0 if the rounded a suffices.
    uint4 id;
} Triangle;

// A triangle's vertex normals. Only the closest hit reads these, so they are separate from Triangle.
typedef struct {
    scalar4 a, b, c; // unit; w of a: 1 if all are on one side of the triangle, else 0
} TriangleNormals;

// The neighbors of a triangle at `certified`. x, y and z are the ids of the triangles across the edges
// opposite a, b and c. w has NEIGHBOR_SIDES_BITS bits for each, the lowest first. A bit is set if exact
// arithmetic on the scene's vertices proves it; the last one means that the neighbor's normals lift its
// points away from the plane of this triangle. The array is indexed by the ids of objects.
typedef struct {
    uint4 ids_sides;
} TriangleNeighbors;

enum {
    NEIGHBOR_HAS_THIS_BEHIND = 1,
    NEIGHBOR_IN_FRONT = 2,
    NEIGHBOR_BEHIND = 4,
    NEIGHBOR_LIFTS_AWAY = 8,
    NEIGHBOR_SIDES_BITS = 4,
    NEIGHBOR_SIDES_MASK = (1 << NEIGHBOR_SIDES_BITS) - 1
};
#define NO_NEIGHBOR 0xfffffffeu

// The texture coordinates of a triangle's vertices.
typedef struct {
    scalar4 a_b;       // u and v of a, u and v of b
    scalar4 c_density; // u and v of c; z: texels of the full texture per unit of length
} TriangleUvs;

// A paraboloid: the points p, measured from the apex, with |p x axis|^2 = k (p . axis).
typedef struct {
    scalar4 apex_k;   // w: k, 4 |axis| times the focal length
    scalar4 axis_end; // w: if finite, p . axis runs from 0 to this
    // With HAS_POWER, the point of the axis nearest to the eye; w is that point's p . axis, which axis_end.w
    // then excludes. The power is |m|^2 - k p . axis at the eye (kernels/shapes/paraboloid.h).
    scalar4 foot_lift;
    uint4 id; // y: REVOLUTION_FINITE | REVOLUTION_CAPPED | HAS_POWER
} Paraboloid;

// A superellipsoid: the points p, measured from the center, whose products with the rows have powers of an
// even exponent that add up to 1.
typedef struct {
    scalar4 center;  // w: the radius of a sphere around it
    scalar4 rows[3]; // w: a bound on the row's length
    scalar4 extent;  // half of its box; w: the rounding scale of its points
    uint4 id;        // y: the exponent
} Superellipsoid;

// A sphere, disc, cylinder, cone, torus or paraboloid under an affine map, such as an ellipsoid. The map
// leads from the space of a unit shape, centered at 0 on the z axis, to that of the eye.
typedef struct {
    scalar4 rows[3]; // rows of the map; w: the image of the unit shape's 0
    // Rows of its inverse. w of the first: a bound on its norm; w of the second: the shape's reach, half the
    // diagonal of its box, or its unit if unbounded. Rays that start farther than twice the reach from the
    // image of 0 are moved before they are mapped.
    scalar4 inverses[3];
    scalar4 extent; // half of its box, 0 if unbounded; w: its condition (INSTANCE_CONDITION_MAX)
    // Parameters of the unit shape. x: the radius, a power of two; w: half the height if finite; y, z: a
    // cone's radius at the base and slope, a torus' radii, or a paraboloid's k.
    scalar4 sizes;
    uint4 id; // y: REVOLUTION_FINITE | REVOLUTION_CAPPED, z: the unit shape's TYPE_…
} Oval;

// Every shape: feature, struct, name, name of its array. Adding a shape begins here (docs/adding-a-shape.md).
// clang-format off
#define SHAPE_LIST(SHAPE)                                                   \
    SHAPE(SPHERES,         Sphere,         sphere,         spheres)         \
    SHAPE(PLANES,          Plane,          plane,          planes)          \
    SHAPE(DISCS,           Disc,           disc,           discs)           \
    SHAPE(BOXES,           Box,            box,            boxes)           \
    SHAPE(CYLINDERS,       Cylinder,       cylinder,       cylinders)       \
    SHAPE(CONES,           Cone,           cone,           cones)           \
    SHAPE(TRIANGLES,       Triangle,       triangle,       triangles)       \
    SHAPE(TORI,            Torus,          torus,          tori)            \
    SHAPE(PARABOLOIDS,     Paraboloid,     paraboloid,     paraboloids)     \
    SHAPE(SUPERELLIPSOIDS, Superellipsoid, superellipsoid, superellipsoids) \
    SHAPE(OVALS,           Oval,           oval,           ovals)
// clang-format on

// An instance of a shared mesh, a primitive of the scene's BVH with a BVH inside. It maps the mesh's space,
// where the mesh's box is around 0 and its largest coordinate is 1/2 to 1, to that of the eye.
typedef struct {
    scalar4 rows[3];     // rows of the map; w: the image of the mesh's 0
    scalar4 inverses[3]; // rows of its inverse; w of the first: the root of the map's |determinant|
    scalar4 extent;      // half of the box around the instance; w: its condition
    uint4 id;            // x: first triangle's id, y: SharedMesh, z: 1 + the material, or 0: the mesh's
} Instance;

// The condition of an instance is the largest row sum of |map| |inverse|. Mapping multiplies the roundings
// of a ray and of the points that it hits by it. Above this maximum the host copies the mesh instead.
enum { INSTANCE_CONDITION_MAX = 32 };
// Mapping a ray moves it by at most this many u of a distance times the condition, within that distance
// (docs/numerics.md).
enum { INSTANCE_RAY_SLACK = 10 };

// Lists every type of primitive: the shapes and the instance.
// clang-format off
#define PRIMITIVE_LIST(PRIMITIVE) \
    SHAPE_LIST(PRIMITIVE)         \
    PRIMITIVE(INSTANCES, Instance, instance, instances)
// clang-format on

#define SHAPE_TYPE(feature, Type, name, names) TYPE_##feature,
enum { PRIMITIVE_LIST(SHAPE_TYPE) TYPE_COUNT, TYPE_QUARTETS = (TYPE_COUNT + 3) / 4 };

// A BVH node: the boxes of up to BVH_WIDTH children, as arrays of low x, low y, low z, high x, high y and
// high z. A child is another node, or a leaf of the primitives first .. first + count - 1 of one type. With
// several lanes a leaf of triangles or spheres is a block. The box of an empty slot is inverted, low above
// high.
//
// Nodes are as wide as the kernel's packets, and at least 4 wide.
enum { BVH_WIDTH_MIN = 4, BVH_WIDTH_MAX = 16 };
enum { BVH_LOW = 0, BVH_HIGH = 3, BVH_PLANES = 6 };
#ifdef __OPENCL_VERSION__
#define BVH_WIDTH   (LANES < BVH_WIDTH_MIN ? BVH_WIDTH_MIN : LANES)
#define BVH_QUARTER (BVH_WIDTH >> 2)
typedef struct {
    scalar4 planes[BVH_PLANES * BVH_QUARTER];
    uint4 child_index[BVH_QUARTER]; // the child's node, first primitive, or its block
    uint4 child_type[BVH_QUARTER];  // BVH_NODE, BVH_EMPTY, or a leaf's count << 8 | type, at most 16 bits
} BvhNode;
#endif

enum { BVH_EMPTY = 0, BVH_NODE = 0xff };

// Returns the TYPE_… of a leaf's primitives, and another number for BVH_NODE.
static inline unsigned leaf_type(unsigned child_type)
{
    return child_type & 0xff;
}

// Returns the number of a leaf's primitives, and 0 for BVH_NODE and BVH_EMPTY.
static inline unsigned leaf_count(unsigned child_type)
{
    return child_type >> 8;
}

// Returns whether kernels with several lanes read the leaves of a type as blocks.
static inline bool type_has_blocks(unsigned type)
{
    return type == TYPE_TRIANGLES || type == TYPE_SPHERES;
}

// The vertices of a leaf's triangles, for kernels with several lanes, which test one triangle per lane
// (kernels/traversal/triangle_block.h). The rows a.x, a.y, a.z, b.x ... c.z are as wide as a node. If a leaf
// has fewer triangles, the first one is repeated.
enum { BLOCK_ROWS = 9 };
#ifdef __OPENCL_VERSION__
typedef struct {
    scalar4 rows[BLOCK_ROWS * BVH_QUARTER];
} TriangleBlock;
#endif

// The spheres of a leaf, for kernels with several lanes (kernels/traversal/sphere_block.h). Rows of the
// centers' x, y and z and of the radii, which are at least FLT_MAX for spheres with HAS_POWER, precede the
// ids, with SPHERE_HAS_FLAGS if the sphere has any, and the indices in the array of spheres. If a leaf has
// fewer spheres, the first one is repeated.
enum { SPHERE_ROWS = 4 };
#define SPHERE_HAS_FLAGS 0x80000000u
#ifdef __OPENCL_VERSION__
typedef struct {
    scalar4 rows[SPHERE_ROWS * BVH_QUARTER];
    uint4 ids[BVH_QUARTER], indices[BVH_QUARTER];
} SphereBlock;
#endif

// The indices of the first triangles of four blocks.
typedef struct {
    uint4 triangles;
} BlockTriangles;

// A bounding sphere as seen from a common origin: a point that all rays of a packet pass through, such as the
// eye or a point or spot light. Each common origin has a row of SceneHeader's cull_spheres.x spheres: one for
// the whole BVH, then one for each primitive outside it, type by type. Planes have none.
//
// xyz is v, from the common origin to the center. w is the origin's power |v|^2 - radius^2, lowered by
// CULL_SPHERE_SLACK u |v|^2. With v = 0, -CULL_SPHERE_MAX is never culled (unbounded, or out of float's
// range) and +CULL_SPHERE_MAX always (an empty BVH).
typedef struct {
    scalar4 center_power;
} CullSphere;

#define CULL_SPHERE_MAX 1e37f

// The enlargement of cull spheres in units of roundoff, relative to |v|^2 and to the ray's direction squared.
enum { CULL_SPHERE_SLACK = 256, CULL_DIRECTION_SLACK = 128 };
// At `certified` the exact shadow ray may be off by SHADOW_ERROR_MAX u of the distance
// (kernels/shading/certain_light.h), and near misses count. So the lights' spheres, whose radius is below
// |v|, are also enlarged by that.
enum { CERTIFIED_CULL_SPHERE_SLACK = 1 << 10, CERTIFIED_CULL_DIRECTION_SLACK = 1 << 10 };

enum { COMMON_ORIGIN_NONE, COMMON_ORIGIN_EYE, COMMON_ORIGIN_FIRST_LIGHT };

// A mesh that instances share. Its triangles, whose id.x counts from 0, follow those of the scene.
typedef struct {
    scalar4 extent;   // half of its box
    uint4 root_entry; // x: its BVH's root, y: the ObjectEntry of its first triangle
} SharedMesh;

// The ids of an instance. The array has an element for each instance, in the order of ids. The ids between
// the ranges of instances belong to other objects. Each of these, and each instance, has one ObjectEntry.
// After an instance an id exceeds the index of its entry by ids.z.
typedef struct {
    uint4 ids; // x: the first, y: one past the last, w: the index of the instance
} InstanceIds;

// The shape and the material that an object's id refers to. Ids are indices unless there are instances.
typedef struct {
    uint4 type_index_material; // x: TYPE_…, y: index in that shape's array, z: index of the material
} ObjectEntry;

typedef struct {
    scalar4 color;       // rgb, w: ka
    scalar4 diffuse;     // kd rgb, w: ks
    scalar4 other_color; // the checker's second color, w: shininess
    scalar4 grid;        // xyz: the eye's position in checker cells, w: cells per unit; 0: no checker
    scalar4 reflection_transmission_ior; // w: texels of the texture per unit of length, on planes and discs
    scalar4 reflection_tint;   // factors of reflected light, the largest 1; w: 1 with Fresnel's equations
    scalar4 specular_tint;     // factors of highlights
    scalar4 transmission_tint; // factors of refracted light
    scalar4 emission;          // rgb
    scalar4 absorption; // rgb: density; within the body exp(-density d) of light remains after a length d
    // A conductor has the index n + i k. conductor_real: n^2 - k^2, w: 1 for a conductor. The other is
    // (2 n k)^2.
    scalar4 conductor_real, conductor_imaginary_squared;
    // The normal map's u and v are xy . (u, v) + z of each row. normal_u.w is the strength, and normal_v.w
    // the map's texels per unit of length over the density of the surface's texture coordinates.
    scalar4 normal_u, normal_v;
    // The optical depth that a shadow ray gains here, -log2(transmission) in integer steps, whose sum does
    // not depend on the order of the objects. x counts steps of 2^-24, for float; y and z are the low and
    // high half of the steps of 2^-48, for double. Red's is that of all channels unless materials have
    // filters.
    uint4 optical_depth, optical_depth_green, optical_depth_blue;
    // x: 1 + the index of its first level, or 0; y: number of levels; z, w: WRAP_… along u and v
    uint4 texture;
    // x: 1 + the index of the first level of the texture whose alpha decides where rays pass, or 0; y: the
    // bits of the least alpha that stops them, as a float; z, w: WRAP_… along u and v
    uint4 cutout;
    uint4 normal_map; // x: 1 + the index of its first level, or 0; y: number of levels; z, w: WRAP_…
} FlatMaterial;

// Modes in which a texture extends beyond its edges.
enum { WRAP_REPEATED, WRAP_CLAMPED, WRAP_MIRRORED };

// One level of a texture's mipmap, each half the size of the one before, down to one texel.
typedef struct {
    uint4 range; // x: index of its first texel, top left; y: width, z: height
} TextureLevel;

typedef struct {
    uint4 color; // the bits of red, green, blue and, in first levels, alpha as floats
} Texel;

enum { OPAQUE = 0x7fffffff };     // in optical_depth.x, passes no light
enum { PASSING_DEPTH_MAX = 125 }; // the largest -log2(transmission) whose float is normal after rounding

// The largest bounce depth.
enum { BOUNCES_MAX = 255 };

// The signature of a ray tree starts as PATH_START. Each ray, depth first and reflected before refracted,
// replaces it by the low 32 bits of (signature ^ (id + 1) * PATH_EVENTS + events) * PATH_FACTOR. The id is
// that of the object hit, or -1 for the background. The events are the bounces there, or 0. (Fowler, Noll,
// Vo: FNV-1a, by words instead of bytes.)
enum { PATH_REFLECTED = 1, PATH_REFRACTED = 2, PATH_TOTAL_REFLECTION = 4, PATH_EVENTS = 8 };
#define PATH_START  0x811c9dc5u
#define PATH_FACTOR 0x01000193u

// At `certified` a sample's color differs from the exact one by at most this fraction of its largest
// channel, or of 1 if that is more, unless a texture is on its path.
#define CERTIFIED_COLOR_ERROR 0x1p-8

// The tile of pixels that a packet of 1, 4, 8 or 16 lanes covers.
#define TILE_WIDTH_OF(lanes)  ((lanes) >= 8 ? 4 : (lanes) == 4 ? 2 : 1)
#define TILE_HEIGHT_OF(lanes) ((lanes) == 16 ? 4 : (lanes) == 1 ? 1 : 2)

// The macro-tile that a work-item renders is a square of as many tiles as a packet has lanes. On a CPU each
// work-item is a separate work-group, which costs PoCL some hundred cycles to start.
#define MACRO_TILE_COLUMNS_LOG2_OF(lanes) ((lanes) == 16 ? 2 : (lanes) == 1 ? 0 : 1)
#define MACRO_TILE_COLUMNS_OF(lanes)      (1 << MACRO_TILE_COLUMNS_LOG2_OF(lanes))
#define MACRO_TILE_ROWS_OF(lanes)         ((lanes) >> MACRO_TILE_COLUMNS_LOG2_OF(lanes))

// The scalars of an explicit ray and of its result (kernels/trace.h), as the offset of each vector.
// closest.cl fills CLOSEST_SCALARS per ray, trace.cl all.
enum { RAY_ORIGIN, RAY_DIRECTION = 3, RAY_TMIN = 6, RAY_TMAX, RAY_SCALARS };
enum {
    RESULT_T,
    RESULT_NORMAL,
    RESULT_POSITION = 4,
    RESULT_LOW = 7,
    RESULT_HIGH,
    RESULT_UNCERTAIN,
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

enum { LIGHT_TYPE_POINT, LIGHT_TYPE_DIRECTIONAL, LIGHT_TYPE_SPOT };

// The area that a light shines from: a rectangle or an ellipse around its position, the half of a sphere that
// faces the surface, a triangle, or the sky.
enum {
    LIGHT_AREA_NONE,
    LIGHT_AREA_RECTANGLE,
    LIGHT_AREA_ELLIPSE,
    LIGHT_AREA_SPHERE,
    LIGHT_AREA_TRIANGLE,
    LIGHT_AREA_SKY
};

// One of SKY_CELL_ROWS x SKY_CELL_COLUMNS ranges of directions with nearly equal light, laid out as the sky's
// image.
typedef struct {
    // x: least longitude, in turns from sky_forward; y: its range; z, w: these of the latitude's sine
    scalar4 range;
} FlatSkyCell;

#define SKY_CELL_ROWS    128
#define SKY_CELL_COLUMNS 128

typedef struct {
    scalar4 color;     // w: the largest of its channels
    scalar4 position;  // relative to the eye; point and spot
    scalar4 direction; // unit, away from the light; directional and spot
    // For spots, x: 1 - cos(half-angle), from the axis to the edge; y: 1 - cos(half-angle - penumbra), which
    // kernels do not read; z: 1 / (x - y), or 0 for a hard edge.
    scalar4 cone;
    // With HAS_FADING_LIGHTS, the strength is divided by x + y d + z d^2 at the distance d.
    scalar4 fading;
    // With HAS_AREA_LIGHTS, the vectors from the center of a rectangle or an ellipse to the middles of two
    // sides, relative to the direction for directional lights, or two sides of a triangle with a vertex at
    // position - (across_u + across_v) / 4. across_u.w is a sphere's radius or, for the sky, the factor that
    // turns the product of a cell's color and both its ranges into a fraction of `color`.
    scalar4 across_u, across_v;
    uint4 type; // x: LIGHT_TYPE_…, y: LIGHT_AREA_…
} FlatLight;

enum { CAMERA_ORTHOGRAPHIC = 1, CAMERA_EQUIRECTANGULAR };

typedef struct {
    scalar4 background, ambient;
    // With HAS_SKY, `background` is the color of directions across the unit vector sky_up. sky_above is
    // added along it and sky_below against it, in proportion to the cosine. sky_up.w is the largest
    // magnitude of their channels. With HAS_IMAGES and sky_texture.x > 0 the sky is an image of all
    // directions. Its center lies along the unit vector sky_forward, and the middle of its right half along
    // sky_right; sky_forward.w is the factor of its colors.
    scalar4 sky_up, sky_above, sky_below, sky_forward, sky_right;
    // A camera ray runs from the eye along forward + x right + y up, with x and y in half pixels from the
    // image's center. The eye is the origin, except in a preview of a scene compiled for another eye.
    //
    // With HAS_LENS and lens_right.w > 0, one over the distance of the focal plane, it runs from a point of
    // the lens to where the ray from the lens' center crosses that plane; lens_right and lens_up lead from
    // the center to the edge. With HAS_ORTHOGRAPHIC and lens_up.w = CAMERA_ORTHOGRAPHIC it runs along
    // forward, from the eye + x right + y up. With HAS_EQUIRECTANGULAR and lens_up.w =
    // CAMERA_EQUIRECTANGULAR its longitude is x right.w turns, from forward towards right, and its latitude
    // y up.w turns, towards up; these three are then unit vectors. With HAS_ORTHOGRAPHIC the eye is that of
    // the shifted frame. At `certified` forward.w is the direction error of these rays, in u of their
    // length.
    scalar4 eye, forward, right, up;
    scalar4 lens_right, lens_up;
    scalar4 bounds;                  // of the BVH; xyz: center, w: largest |x| + |y| + |z| from the center
    scalar4 bounds_low, bounds_high; // their corners; low.w: the box slack that mapping to instances adds
    // The corners of a box around all points where a transparent object may touch an opaque one. Low is above
    // high if there are no such points.
    scalar4 contact_low, contact_high;
    // x: width of a sample's share of a pixel, at distance 1. y: the first rival of every hit at
    // `certified`: the largest scalar, or its negative if no bound holds, and every hit is uncertain. z:
    // with HAS_ORTHOGRAPHIC, that width at any distance, or 0. w: the least weight of a ray that is traced.
    scalar4 sample;
    uint4 image;                     // x: width, y: height, z: samples per pixel, w: number of lights
    uint4 bounces;                   // x: largest depth
    uint4 cull_spheres;              // x: number per common origin, 0 if there are none
    uint4 sky_texture;               // x: 1 + the index of its first level, or 0; y: number of levels
    uint4 counts[TYPE_QUARTETS];     // primitives by TYPE_…
    uint4 bvh_counts[TYPE_QUARTETS]; // primitives in the BVH by TYPE_…, which come first
} SceneHeader;

// The arena is one buffer with the header followed by these arrays, because devices may allow a kernel only 8
// buffers. Nodes and texels have separate buffers, because devices limit the size of each. ARRAY(NAME,
// struct, a shape's name, name of the array).
// clang-format off
#define ARENA_LIST(ARRAY)                                              \
    PRIMITIVE_LIST(ARRAY)                                              \
    ARRAY(TRIANGLE_NORMALS, TriangleNormals, , triangle_normals)       \
    ARRAY(TRIANGLE_UVS, TriangleUvs, , triangle_uvs)                   \
    ARRAY(TRIANGLE_NEIGHBORS, TriangleNeighbors, , triangle_neighbors) \
    ARRAY(TRIANGLE_BLOCKS, TriangleBlock, , triangle_blocks)           \
    ARRAY(BLOCK_TRIANGLES, BlockTriangles, , block_triangles)          \
    ARRAY(SPHERE_BLOCKS, SphereBlock, , sphere_blocks)                 \
    ARRAY(CULL_SPHERES, CullSphere, , cull_spheres)                    \
    ARRAY(OBJECTS, ObjectEntry, , objects)                             \
    ARRAY(MATERIALS, FlatMaterial, , materials)                        \
    ARRAY(LIGHTS, FlatLight, , lights)                                 \
    ARRAY(SKY_CELLS, FlatSkyCell, , sky_cells)                         \
    ARRAY(TEXTURE_LEVELS, TextureLevel, , texture_levels)              \
    ARRAY(SHARED_MESHES, SharedMesh, , shared_meshes)                  \
    ARRAY(INSTANCE_IDS, InstanceIds, , instance_ids)
// clang-format on

// The words of a pixel in a list of flagged pixels (Band in film.h).
enum { LIST_WORDS = 4 };

// The words that record a ray's decisions (shading/decisions.h), and how many rays of a tree are recorded:
// the first eight of a path or, if rays are refracted, those of up to three bounces.
enum { RECORD_WORDS = 2 };
#define RECORDED_NODES_OF(has_transmission) ((has_transmission) ? 15 : 8)

// Holds the offset of each array in units of the largest alignment, that of a double16.
enum { ARENA_UNIT = 128 };
#define ARENA_OFFSET(NAME, Type, name, names) unsigned names;
typedef struct {
    ARENA_LIST(ARENA_OFFSET)
} ArenaOffsets;

#endif
