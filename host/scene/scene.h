// A scene as its file describes it: plain arrays in double, world coordinates, no OpenCL. Readers fill it,
// and scene_compile (host/compile) turns it into the device's arrays.
#pragma once

#include "host/base/array.h"
#include "host/base/text.h"
#include "host/image/image.h"
#include "host/scene/affine.h"
#include "host/scene/bounds.h"
#include "host/scene/vector.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef Vector3 Color; // linear RGB in x, y, z; 1 = full

// The side of the image that the field of view spans; pixels are square.
typedef enum { FIELD_VERTICAL, FIELD_HORIZONTAL } FieldAxis;

typedef enum {
    PROJECTION_PERSPECTIVE,
    PROJECTION_ORTHOGRAPHIC, // rays are parallel to the view
    // The image shows all directions, by longitude from left to right and latitude from bottom to top.
    // half_tangent is then pi along the width, and there is neither a shift nor a lens.
    PROJECTION_EQUIRECTANGULAR
} Projection;

// The place of the plane in focus: through the camera's look_at, at a distance, or through a point.
typedef enum { FOCUS_LOOK_AT, FOCUS_DISTANCE, FOCUS_POINT } LensFocus;

typedef struct {
    Vector3 position, look_at, up; // look_at differs from position; up may be zero or parallel to the view
    FieldAxis field_axis;
    // tan(field / 2) along field_axis, > 0: half the frame over the focal length. With parallel rays, half
    // the frame itself.
    double half_tangent;
    double frame_aspect; // width over height of the frame, or 0 where the file gives none
    double shift[2];     // of the frame in its plane, to the right and up, in frames along field_axis
    Projection projection;
    // The plane across the view that `focus` chooses is in focus.
    struct {
        double radius; // 0: no lens
        LensFocus focus;
        double distance; // > 0 with FOCUS_DISTANCE
        Vector3 point;   // with FOCUS_POINT
    } lens;
} Camera;

typedef enum { LIGHT_POINT, LIGHT_DIRECTIONAL, LIGHT_SPOT } LightType;

// The area that a light shines from: its position, a rectangle or an ellipse around it, a sphere, a
// triangle, or the directions of sky.cells.
typedef enum { AREA_NONE, AREA_RECTANGLE, AREA_ELLIPSE, AREA_SPHERE, AREA_TRIANGLE, AREA_SKY } LightAreaType;

typedef struct {
    LightType type;
    Color color;       // times intensity
    Vector3 position;  // point, spot
    Vector3 direction; // directional: where the light travels; spot: look_at - position; not unit
    // degrees from the axis of a spot: no light beyond half_angle, full light within half_angle - penumbra
    struct {
        double half_angle, penumbra;
    } spot;
    struct {
        LightAreaType type;
        bool is_visible; // it is an object that shows `color` and casts no shadow
        double radius;   // of a sphere or a disc
        // The vectors from the center of a rectangle or an ellipse to the middles of two sides. For a
        // directional light they are across `direction`, and relative to its length. For a triangle they are
        // two sides from one vertex, which is at position - (across[0] + across[1]) / 4.
        Vector3 across[2];
    } area;
    // point, spot: unless the latter two are 0, the strength is divided by fading[0] + fading[1] d +
    // fading[2] d^2 at the distance d
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

// The part of a shadow ray that a surface blocks: what it does not transmit, all, or nothing.
typedef enum { SHADOW_OF_TRANSMISSION, SHADOW_FULL, SHADOW_NONE } ShadowType;

// The complex index of refraction n + i k of a metal.
typedef struct {
    Color n, k;
} Conductor;

// A color as its largest channel and its tint, the channels over the largest, or 0 where they are equal.
typedef struct {
    double largest;
    Color tint;
} TintedFactor;

typedef struct {
    Color color;
    double ambient;                        // ka
    Color diffuse;                         // kd, per channel
    TintedFactor specular;                 // ks
    double shininess;                      // Phong's power, >= 0
    TintedFactor reflection, transmission; // weights of the reflected and the refracted ray
    Color emission;                        // added to what the surface shows; lights nothing else
    bool fresnel;        // the surface reflects a part of `transmission`, or of `reflection` without it
    Conductor conductor; // reflects by this index; n is 0 if it does not
    double ior;
    ShadowType shadow;
    Color absorption; // exp(-absorption d) of what is transmitted is left after a length d within
    struct {
        bool is_on;
        Color colors[2]; // in place of color
        double size;     // side of a square, > 0, in scene units
    } checker;
    double texture_size; // width of the textures below on a plane or disc, > 0, in scene units
    struct {
        uint32_t texture;     // in place of color: 1 + index into the scene's textures; 0: none
        TextureWrap wraps[2]; // along u and v, on a mesh; also those of the cutout
        bool ignores_alpha;   // its format defines the use of the alpha
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
        double threshold; // 0: the surface is present everywhere
        bool blends;      // its format blends by this alpha
    } cutout;
} Material;

// Returns the texture whose place on a surface is that of all textures of its material, or 0.
static inline uint32_t material_any_texture(const Material *material)
{
    if (material->image.texture > 0) return material->image.texture;
    return material->cutout.texture > 0 ? material->cutout.texture : material->normal_map.texture;
}

// The cutout for images by whose alpha other programs blend.
#define CUTOUT_OF_BLENDED 0.5

// The largest side of an image: floats, with 24 bits, cannot place a point within a texel of a longer one.
// The largest number of texels of all images: coarser levels add a third, and kernels count in 32 bits.
enum { TEXTURE_SIDE_MAX = 1 << 16, TEXELS_MAX = 1 << 28 };

// The meaning of an image's values.
typedef enum {
    TEXTURE_COLORS,
    TEXTURE_OPACITY, // colors; if every pixel is opaque, decoding sets alpha to the luminance
    TEXTURE_NORMALS, // stored without a transfer curve
    TEXTURE_BUMPS    // normals or, if the image is gray, heights, which decoding converts to normals
} TextureContent;

typedef struct {
    char *path;    // of the image's file; where it has `bytes` or no file, only for messages
    char *layer;   // of an EXR file; NULL: its default layer, or its only one with colors
    size_t offset; // of its name in the scene's text
    Text bytes;    // of an image within another file, until it is decoded; else empty
    TextureContent content;
    Image image; // decoded, or made without a file; its colors are finite
} SceneTexture;

// Every shape of scene files by its name there, in the order of the kernels' SHAPE_LIST (kernels/types.h).
// After them come the oval, which transforms make of shapes, and the mesh.
#define SCENE_SHAPE_LIST(SHAPE)                                                                              \
    SHAPE(SPHERE, "sphere")                                                                                  \
    SHAPE(PLANE, "plane")                                                                                    \
    SHAPE(DISC, "disc")                                                                                      \
    SHAPE(BOX, "box")                                                                                        \
    SHAPE(CYLINDER, "cylinder")                                                                              \
    SHAPE(CONE, "cone")                                                                                      \
    SHAPE(TRIANGLE, "triangle")                                                                              \
    SHAPE(TORUS, "torus")                                                                                    \
    SHAPE(PARABOLOID, "paraboloid")

#define SHAPE_ENUMERATOR(NAME, name) SHAPE_##NAME,
typedef enum { SCENE_SHAPE_LIST(SHAPE_ENUMERATOR) SHAPE_OVAL, SHAPE_MESH, SHAPE_COUNT } ShapeType;
#undef SHAPE_ENUMERATOR

extern const char *const shape_names[SHAPE_COUNT];

// Axes and normals are those of the file: not normalized, never zero.
typedef struct {
    ShapeType type;
    uint32_t material; // index into the scene's materials
    uint32_t line;     // of its file, from 1; 0: unknown
    uint32_t file;     // 0: the scene's, else 1 + index into those that it includes
    union {
        struct {
            Vector3 center;
            double radius;
            bool only_inside; // hit from inside only: rays that enter pass through
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
        // finite: from .. from + axis; infinite: through `from` along axis; only_inside, without caps: as for
        // a sphere
        struct {
            Vector3 from, axis;
            double radius;
            bool finite, caps, only_inside;
        } cylinder;
        // finite: radius[0] at from, radius[1] at from + axis, not both zero
        // infinite: both nappes, apex at `from`, radius grows by `slope` for each unit of length along the
        // axis
        struct {
            Vector3 from, axis;
            double radius[2], slope;
            bool finite, caps, only_inside;
        } cone;
        struct {
            Vector3 vertices[3], normals[3];
            bool smooth;
        } triangle;
        // radii of the circle and of the tube around it
        struct {
            Vector3 center, axis;
            double major, minor;
        } torus;
        // the points equidistant from the focus and the directrix plane; finite: up to a height along the
        // axis
        struct {
            Vector3 apex, axis;
            double focal_length, height;
            bool finite, caps;
        } paraboloid;
        // a round shape that an affine map has changed to another type (host/scene/oval.h): the points
        // center + x axes[0] + y axes[1] + z axes[2] for those of a unit shape. half_height: of a finite
        // one. radii: of a finite cone at its ends, the larger 1, or of a torus, with the sum 1. rise: the
        // slope of an infinite cone, or r^2 / z of an infinite paraboloid.
        struct {
            Vector3 center, axes[3];
            double half_height, radii[2], rise;
            ShapeType unit;
            bool finite, caps;
        } oval;
        struct {
            uint32_t index;        // into the scene's meshes
            bool is_instance;      // which `transform` places, of a mesh that other objects may have
            bool has_own_material; // instead of the mesh's
            Affine transform;
        } mesh;
    } as;
} Object;

// Triangles that share vertices, in world coordinates unless it has instances. A mesh or an instance is one
// object in the file, and each of its triangles has an id.
typedef struct {
    Vector3 *vertices;
    Vector3 *normals; // one for each vertex, unit or zero (flat there), or NULL: flat
    double (*uvs)[2]; // one for each vertex, or NULL
    size_t vertex_count;
    uint32_t (*triangles)[3];
    uint32_t *materials; // one for each triangle, or NULL: the object's
    size_t triangle_count;
    Bounds bounds;                    // of the vertices, if the mesh has instances
    char *path;                       // the file it was read from, or NULL
    uint64_t file_device, file_index; // of that file, by whatever name
} Mesh;

// A file that a scene's file includes.
typedef struct {
    char *path;
    uint64_t hash; // of its bytes; hash_bytes
} IncludedFile;

// A range of directions: of longitudes in turns, from -1/2 to 1/2, and of the sines of latitudes.
typedef struct {
    double longitude_begin, longitude_end, sine_begin, sine_end;
} SkyCell;

enum { SKY_CELL_ROWS = 128, SKY_CELL_COLUMNS = 128 };

// The meaning of a format's colors: linear light, or values that a display shows unchanged.
typedef enum { COLORS_LINEAR, COLORS_DISPLAY } ColorMeaning;

typedef struct {
    bool has_keys;        // values depend on the frame
    uint32_t frame_count; // 0: not given
    double frame_rate;    // frames per second; 0: not given
    double frame;         // named by the options
    double shutter;       // the part of the time to the next frame for which the shutter is open, 0 to 1
    bool has_shutter;     // whether it is given
} SceneAnimation;

typedef struct {
    Camera camera;
    Color background, ambient;
    // The background of the directions along `up`, against it, and, by the cosine, of those in between;
    // `background` is that of those across it. Nothing where `up` is zero.
    struct {
        Vector3 up;
        Color zenith, nadir;
        // An image of all directions replaces these colors; the number is that of a Material's image. Its
        // colors are multiplied by `intensity`, and its center lies along `forward`, across `up`.
        uint32_t texture;
        Vector3 forward;
        double intensity;
        bool is_ambient; // its mean becomes `ambient` when the image is decoded
        bool is_light;   // becomes one of `lights` when the image is decoded
        // NULL unless the sky is a light: SKY_CELL_ROWS x SKY_CELL_COLUMNS cells of nearly equal light, laid
        // out as its image.
        SkyCell *cells;
        // The product of the sky's color, both ranges of a cell and this is a part of the light's color.
        double cell_factor;
    } sky;
    ARRAY_OF(Light) lights;
    ARRAY_OF(Material) materials;
    ARRAY_OF(char *) material_names; // one for each material; may be ""
    ARRAY_OF(Object) objects;        // an object's id is the number of primitives before it
    ARRAY_OF(Mesh) meshes;
    size_t copied_triangle_count; // of meshes whose file another mesh has
    ARRAY_OF(SceneTexture) textures;
    uint64_t text_hash; // of the bytes of all files and the overrides; hash_bytes
    ARRAY_OF(IncludedFile) included;
    Source *overrides; // what replaced values of the file, PATH=VALUE each, in order; NULL if none
    SceneAnimation animation;
    ColorMeaning color_meaning;
    unsigned width, height; // the file's own image size, or 0
} Scene;

void scene_free(Scene *scene); // and zeroes

// Returns the distance along the view that is in focus, above 0. Returns 0, for all distances, if there is
// no lens or the point in focus lies behind it.
double camera_focal_distance(const Camera *camera);

// Returns the part of the light that a surface lets through to what it shadows.
Color material_passing(const Material *material);

// Adds the objects of visible lights.
void scene_add_lamps(Scene *scene);

// Returns the material's index.
uint32_t scene_add_material(Scene *scene, const Material *material, const char *name);

// Bounds the cost of a hostile file.
enum { SCENE_TEXTURES_MAX = 1000 };

// Returns the value of a material's `image.texture` for the image, which materials with the same image share,
// or 0 if the scene has too many. `layer` may be NULL, as in SceneTexture.
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
// Returns the tint of a color: its channels over the largest, or 0 if they are equal.
Color color_tint(Color color);
// Returns the absorption of a body in which `left` of white light is left after a distance above 0. Black
// would need an infinite one, so channels below 1e-6 count as 1e-6.
Color color_absorption(Color left, double distance);
// Returns the factors of a tint, which are 1 where it is 0.
Color tint_factors(Color tint);
Color factor_color(TintedFactor factor);
// Makes a material pass the fraction 1 - opacity of the light from behind, undeflected, and dims what the
// surface itself shows by the opacity.
void material_set_opacity(Material *material, double opacity);

enum { FRAMES_MAX = 1000000 };

enum { IMAGE_SIDE_MAX = 1 << 20 }; // in pixels

// Chooses an image size where none is given (width 0): the scene's, else 1280 wide with the camera frame's
// aspect ratio, or 16:9.
void scene_choose_image_size(const Scene *scene, uint32_t *width, uint32_t *height);

// Returns how many ids an object takes: one for each triangle of a mesh, otherwise one.
size_t object_primitive_count(const Scene *scene, const Object *object);
size_t scene_primitive_count(const Scene *scene);
// Returns the shape that the file named: of an oval, that of which a transform made it.
ShapeType object_shape(const Object *object);
// Returns whether an object consists of triangles with the normals of vertices.
bool object_is_smooth(const Scene *scene, const Object *object);
