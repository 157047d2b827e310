// A scene as its file describes it: plain arrays in double, world coordinates, no OpenCL. Readers fill it,
// and scene_compile (host/compile) turns it into the device's arrays.
#pragma once

#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/text.h"
#include "host/image/image.h"
#include "host/scene/affine.h"
#include "host/scene/bounds.h"
#include "host/scene/vector.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef Vector3 Color; // linear RGB in x, y and z, where 1 is full intensity

// The side of the image that the field of view spans. Pixels are square.
typedef enum { FIELD_VERTICAL, FIELD_HORIZONTAL } FieldAxis;

typedef enum {
    PROJECTION_PERSPECTIVE,
    PROJECTION_ORTHOGRAPHIC, // rays are parallel to the view
    // The image shows all directions, by longitude from left to right and latitude from bottom to top.
    // half_tangent is then pi along the width, and there is neither a shift nor a lens.
    PROJECTION_EQUIRECTANGULAR
} Projection;

// What the plane in focus passes through: the camera's look_at, the point at a distance along the view, or a
// given point.
typedef enum { FOCUS_LOOK_AT, FOCUS_DISTANCE, FOCUS_POINT } LensFocus;

typedef struct {
    // `look_at` differs from `position`, but `up` may be zero or parallel to the view.
    Vector3 position, look_at, up;
    FieldAxis field_axis;
    // The tangent of half the field of view along field_axis, which is half the frame over the focal length
    // and above 0. With parallel rays it is half the frame itself.
    double half_tangent;
    double frame_aspect; // width over height of the frame, or 0 if the file does not give it
    double shift[2];     // the frame's shift to the right and up, in lengths of the frame along field_axis
    Projection projection;
    // The plane across the view that `focus` chooses is in focus.
    struct {
        double radius; // 0 without a lens
        LensFocus focus;
        double distance; // used and above 0 with FOCUS_DISTANCE
        Vector3 point;   // used with FOCUS_POINT
    } lens;
} Camera;

typedef enum { LIGHT_POINT, LIGHT_DIRECTIONAL, LIGHT_SPOT } LightType;

// The area that a light shines from, which is its position, a rectangle or an ellipse around it, a sphere, a
// triangle, or the directions of sky.cells.
typedef enum { AREA_NONE, AREA_RECTANGLE, AREA_ELLIPSE, AREA_SPHERE, AREA_TRIANGLE, AREA_SKY } LightAreaType;

typedef struct {
    LightType type;
    Color color;       // multiplied by the intensity
    Vector3 position;  // of a point or a spot light
    Vector3 direction; // in which the light travels, or look_at - position for a spot light; any length
    // The angles from the axis of a spot light in degrees. There is no light beyond half_angle, and full
    // light within half_angle - penumbra.
    struct {
        double half_angle, penumbra;
    } spot;
    struct {
        LightAreaType type;
        bool is_visible; // an object shows `color` in its place and casts no shadow
        double radius;   // of a sphere or a disc
        // The vectors from the center of a rectangle or an ellipse to the middles of two sides. For a
        // directional light they are across `direction`, and relative to its length. For a triangle they are
        // two sides from one vertex, which is at position - (across[0] + across[1]) / 4.
        Vector3 across[2];
    } area;
    // The light of a point or a spot light fades with the distance d unless fading[1] and fading[2] are 0.
    // Its strength is then divided by fading[0] + fading[1] d + fading[2] d^2.
    double fading[3];
} Light;

static inline bool light_fades(const Light *light)
{
    return light->fading[1] != 0 || light->fading[2] != 0;
}

// Divides the color by a fading that is the same at all distances, and clears it.
void light_fold_fading(Light *light);

// The continuation of a texture on a mesh beyond its edges.
typedef enum { TEXTURE_REPEATED, TEXTURE_CLAMPED, TEXTURE_MIRRORED } TextureWrap;

// How much of a shadow ray's light a surface blocks, which is what it does not transmit, all of it, or none.
typedef enum { SHADOW_OF_TRANSMISSION, SHADOW_FULL, SHADOW_NONE } ShadowType;

// The complex index of refraction n + i k of a metal.
typedef struct {
    Color n, k;
} Conductor;

// A color, split into its largest channel and a tint. The tint is the channels divided by the largest, or 0
// if they are all equal.
typedef struct {
    double largest;
    Color tint;
} TintedFactor;

typedef struct {
    Color color;
    double ambient;                        // ka, the factor of the ambient light
    Color diffuse;                         // kd for each channel
    TintedFactor specular;                 // ks
    double shininess;                      // the power of Phong's highlights, 0 or more
    TintedFactor reflection, transmission; // weights of the reflected and the refracted ray
    Color emission;                        // added to what the surface shows, but lights nothing else
    bool fresnel;        // reflects a part of `transmission`, or of `reflection` if that is 0
    Conductor conductor; // the index of a metal's reflection, with n = 0 on other surfaces
    double ior;          // index of refraction
    ShadowType shadow;
    Color absorption; // attenuates light by exp(-absorption d) over a distance d inside
    struct {
        bool is_on;
        Color colors[2]; // replace `color`
        double size;     // side of a square in scene units, above 0
    } checker;
    double texture_size; // width of the textures below on a plane or a disc, in scene units, above 0
    struct {
        uint32_t texture;     // replaces `color`; 1 + index into the scene's textures, or 0 for none
        TextureWrap wraps[2]; // along u and v on a mesh, for the image and the cutout
        bool ignores_alpha;   // whether the file's format defines the use of the alpha
    } image;
    struct {
        uint32_t texture;
        TextureWrap wraps[2];
        double rows[2][3]; // the affine map from the other textures' coordinates to u and v of this one
        double strength;   // the factor of the tangential components
    } normal_map;
    // The surface is absent where the alpha of the texture is below the threshold.
    struct {
        uint32_t texture;
        double threshold; // 0 keeps the whole surface
        bool blends;      // whether the file's format blends by this alpha
    } cutout;
} Material;

// Returns one of the material's textures, or 0 if it has none. All of them have the same place on a surface.
static inline uint32_t material_any_texture(const Material *material)
{
    if (material->image.texture > 0) return material->image.texture;
    return material->cutout.texture > 0 ? material->cutout.texture : material->normal_map.texture;
}

// The threshold for images whose alpha other programs use to blend.
#define CUTOUT_OF_BLENDED 0.5

// TEXTURE_SIDE_MAX is the largest side of an image, since a float's 24 bits cannot place a point within a
// texel of a longer one. TEXELS_MAX is the largest number of texels of all images, since coarser levels add a
// third and kernels count in 32 bits.
enum { TEXTURE_SIDE_MAX = 1 << 16, TEXELS_MAX = 1 << 28 };

// The meaning of an image's values.
typedef enum {
    TEXTURE_COLORS,
    TEXTURE_OPACITY, // colors, whose alpha becomes their luminance if every pixel is opaque
    TEXTURE_NORMALS, // stored without a transfer curve
    TEXTURE_BUMPS    // normals or, if the image is gray, heights, which decoding converts to normals
} TextureContent;

typedef struct {
    char *path;    // of the image's file, or a name for messages if there are `bytes` or no file
    char *layer;   // of an EXR file, or NULL for its default layer or its only one with colors
    size_t offset; // of the path in the scene's text
    Text bytes;    // of an image within another file until it is decoded, otherwise empty
    TextureContent content;
    Image image; // decoded or made without a file, with finite colors
} SceneTexture;

// Every shape of scene files by its name there, in the order of the kernels' SHAPE_LIST (kernels/types.h).
// After them come the oval, which transforms make of shapes, and the mesh. Each shape's member of Object.as
// begins with as many positions, directions and lengths as its row counts, in this order.
// clang-format off
#define SCENE_SHAPE_LIST(SHAPE)                      \
    SHAPE(SPHERE,         "sphere",         1, 0, 1) \
    SHAPE(PLANE,          "plane",          1, 1, 0) \
    SHAPE(DISC,           "disc",           1, 1, 1) \
    SHAPE(BOX,            "box",            2, 0, 0) \
    SHAPE(CYLINDER,       "cylinder",       1, 1, 1) \
    SHAPE(CONE,           "cone",           1, 1, 2) \
    SHAPE(TRIANGLE,       "triangle",       3, 3, 0) \
    SHAPE(TORUS,          "torus",          1, 1, 2) \
    SHAPE(PARABOLOID,     "paraboloid",     1, 1, 2) \
    SHAPE(SUPERELLIPSOID, "superellipsoid", 1, 3, 0)
// clang-format on

#define SHAPE_ENUMERATOR(NAME, ...) SHAPE_##NAME,
typedef enum { SCENE_SHAPE_LIST(SHAPE_ENUMERATOR) SHAPE_OVAL, SHAPE_MESH, SHAPE_COUNT } ShapeType;
#undef SHAPE_ENUMERATOR

extern const char *const shape_names[SHAPE_COUNT];

// Axes and normals are as in the file, so they are never zero but need not be unit vectors.
typedef struct {
    ShapeType type;
    uint32_t material; // index into the scene's materials
    uint32_t line;     // of its file, counted from 1, or 0 if unknown
    uint32_t file;     // 0 for the scene's file, else 1 + index into `included`
    union {
        struct {
            Vector3 center;
            double radius;
            bool only_inside; // rays that enter pass through, and only rays that leave hit it
        } sphere;
        struct {
            Vector3 point, normal;
        } plane;
        struct {
            Vector3 center, normal;
            double radius;
        } disc;
        struct {
            Vector3 min, max;
        } box; // min <= max in each component
        // A finite cylinder extends from `from` to from + axis, an infinite one along its axis through
        // `from`. One with only_inside has no caps, and rays that enter pass through it.
        struct {
            Vector3 from, axis;
            double radius;
            bool finite, caps, only_inside;
        } cylinder;
        // A finite cone has radius[0] at `from` and radius[1] at from + axis, not both zero. An infinite one
        // has both nappes and its apex at `from`, and its radius grows by `slope` per unit of length along
        // the axis.
        struct {
            Vector3 from, axis;
            double radius[2], slope;
            bool finite, caps, only_inside;
        } cone;
        struct {
            Vector3 vertices[3], normals[3];
            bool smooth;
        } triangle;
        // `major` is the radius of the circle, `minor` that of the tube around it.
        struct {
            Vector3 center, axis;
            double major, minor;
        } torus;
        // The points equidistant from the focus and the directrix plane. A finite paraboloid ends at a height
        // along the axis.
        struct {
            Vector3 apex, axis;
            double focal_length, height;
            bool finite, caps;
        } paraboloid;
        // The points center + x axes[0] + y axes[1] + z axes[2] with |x|^n + |y|^n + |z|^n = 1 for the
        // exponent n, an even integer.
        struct {
            Vector3 center, axes[3];
            double exponent;
        } superellipsoid;
        // A round shape that an affine map has changed to another type (host/scene/oval.h). It consists of
        // the points center + x axes[0] + y axes[1] + z axes[2] for each point (x, y, z) of a unit shape.
        // `half_height` is that of a finite unit shape. `radii` are those of a finite cone at its ends, of
        // which the larger is 1, or of a torus, whose sum is 1. `rise` is the slope of an infinite cone, or
        // r^2 / z of an infinite paraboloid.
        struct {
            Vector3 center, axes[3];
            double half_height, radii[2], rise;
            ShapeType unit;
            bool finite, caps;
        } oval;
        struct {
            uint32_t index;        // into the scene's meshes
            bool is_instance;      // `transform` places the mesh, which other objects may share
            bool has_own_material; // `material` replaces those of the mesh
            Affine transform;
        } mesh;
    } as;
} Object;

// Triangles that share vertices, in world coordinates unless the mesh has instances. A mesh or an instance is
// one object in the file, and each of its triangles has an id.
typedef struct {
    Vector3 *vertices;
    Vector3 *normals; // a unit vector for each vertex, or zero where it is flat; NULL for a flat mesh
    double (*uvs)[2]; // one for each vertex, or NULL
    size_t vertex_count;
    uint32_t (*triangles)[3];
    uint32_t *materials; // one for each triangle, or NULL if all have the object's
    size_t triangle_count;
    Bounds bounds; // of the vertices, if the mesh has instances
    char *path;    // the file it was read from, or NULL
    FileId file;
} Mesh;

// A file that a scene's file includes.
typedef struct {
    char *path;
    uint64_t hash; // hash_bytes of its bytes
} IncludedFile;

// A range of directions, given by longitudes in turns from -1/2 to 1/2 and by the sines of latitudes.
typedef struct {
    double longitude_begin, longitude_end, sine_begin, sine_end;
} SkyCell;

// kernels/types.h has the same definitions. The compiler warns if they differ.
#define SKY_CELL_ROWS    128
#define SKY_CELL_COLUMNS 128

// What a format's colors mean, which is linear light or values that a display shows unchanged.
typedef enum { COLORS_LINEAR, COLORS_DISPLAY } ColorMeaning;

typedef struct {
    bool has_keys;        // whether values depend on the frame
    uint32_t frame_count; // 0 if not given
    double frame_rate;    // in frames per second, 0 if not given
    double frame;         // the frame that the options select
    double shutter;       // how long the shutter is open, from 0 to 1 frame
    bool has_shutter;     // whether the file gives `shutter`
} SceneAnimation;

typedef struct {
    Camera camera;
    Color background, ambient;
    // The sky, unless `up` is zero. It is `zenith` along `up`, `background` across it and `nadir` against it,
    // and the cosine interpolates in between.
    struct {
        Vector3 up;
        Color zenith, nadir;
        // An image of all directions that replaces these colors: 1 + index into `textures`, or 0 for none.
        // Its colors are multiplied by `intensity`, and its center lies along `forward`, which is
        // perpendicular to `up`.
        uint32_t texture;
        Vector3 forward;
        double intensity;
        bool is_ambient; // whether `ambient` becomes the image's mean when it is decoded
        bool is_light;   // whether the sky becomes one of `lights` when the image is decoded
        // SKY_CELL_ROWS x SKY_CELL_COLUMNS cells of nearly equal light, in the order of the image's pixels,
        // or NULL unless the sky is a light.
        SkyCell *cells;
        // A cell's share of the light's color is the product of the sky's color, both ranges of the cell and
        // this factor.
        double cell_factor;
    } sky;
    ARRAY_OF(Light) lights;
    ARRAY_OF(Material) materials;
    ARRAY_OF(char *) material_names; // one for each material, which may be ""
    ARRAY_OF(Object) objects;        // an object's id is the number of primitives before it
    ARRAY_OF(Mesh) meshes;
    size_t copied_triangle_count; // triangles of meshes that were read from the file of another mesh
    ARRAY_OF(SceneTexture) textures;
    uint64_t text_hash; // hash_bytes of all files and the overrides
    ARRAY_OF(IncludedFile) included;
    Source *overrides; // PATH=VALUE texts that replaced values of the file, in order; NULL if none
    SceneAnimation animation;
    ColorMeaning color_meaning;
    unsigned width, height; // the image size that the file gives, or 0
} Scene;

void scene_free(Scene *scene); // frees and zeroes
#define OwnedScene __attribute__((cleanup(scene_free))) Scene

// Sets the position, and look_at along a unit direction, far enough that rounding keeps the direction.
void camera_look_along(Camera *camera, Vector3 position, Vector3 direction);

// Returns the distance along the view that is in focus. Returns 0, which means that all distances are in
// focus, if there is no lens or the point in focus lies behind it.
double camera_focal_distance(const Camera *camera);

// Returns the fraction of light that a surface lets through to what it shadows.
Color material_passing(const Material *material);

// Adds the objects of visible lights.
void scene_add_lamps(Scene *scene);

// Returns the material's index.
uint32_t scene_add_material(Scene *scene, const Material *material, const char *name);

// Limits the cost of a hostile file.
enum { SCENE_TEXTURES_MAX = 1000 };

// Returns the value of a material's `image.texture` for the image, which materials with the same image share,
// or 0 if the scene has too many. `layer` may be NULL for an EXR file's default layer.
uint32_t scene_add_texture(Scene *scene, const char *path, const char *layer, TextureContent content,
                           size_t offset);

// Adds an object with a separate material.
void scene_add_object(Scene *scene, Object object, const Material *material);

// Adds PATH=VALUE to the scene's overrides, which its reader applies. `name` names its origin in messages,
// and must outlive the scene.
void scene_add_override(Scene *scene, const char *name, const char *text);

// Returns whether `path` is the file that the scene was read from or includes, or one of its images or
// meshes, by whatever name.
bool scene_was_read_from(const Scene *scene, const char *scene_path, const char *path);

// Returns a material with every default of the YAML format: white, ambient 1, diffuse 1, specular 0,
// shininess 32, ior 1.5.
Material material_default(void);
// Returns the tint of a color, which is its channels divided by the largest, or 0 if they are equal.
Color color_tint(Color color);
// Returns the absorption of a body in which white light becomes `left` after a distance, which is above 0.
// Channels of `left` below 1e-6 count as 1e-6, since black would need infinite absorption.
Color color_absorption(Color left, double distance);
// Returns the channels of a tint, or 1 for each if the tint is 0.
Color tint_factors(Color tint);
Color factor_color(TintedFactor factor);
// Makes a material pass the fraction 1 - opacity of the light from behind, undeflected, and dims what the
// surface itself shows by the opacity.
void material_set_opacity(Material *material, double opacity);

enum { FRAMES_MAX = 1000000 };

enum { IMAGE_SIDE_MAX = 1 << 20 }; // in pixels

// Sets an image size whose width is 0 to that of the scene or, if it gives none, to 1280 wide with the camera
// frame's aspect ratio or 16:9.
void scene_choose_image_size(const Scene *scene, uint32_t *width, uint32_t *height);

// Returns how many ids an object takes: one for each triangle of a mesh, otherwise one.
size_t object_primitive_count(const Scene *scene, const Object *object);
size_t scene_primitive_count(const Scene *scene);
// Returns the shape that the file names. For an oval it is the shape from which a transform made it.
ShapeType object_shape(const Object *object);
// Returns whether an object consists of triangles with vertex normals.
bool object_is_smooth(const Scene *scene, const Object *object);
