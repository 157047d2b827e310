// libglint: renders scenes and traces rays on OpenCL devices, and measures the errors of images.
//
// Functions that can fail return a GlintStatus. Functions with a `messages` parameter, which may be NULL, set
// *messages to their warnings and errors, one or more lines each, or to NULL if there are none. The caller
// frees it with glint_text_free. Messages about a scene begin with FILE:LINE:COLUMN. A device warns once if
// its kernel cache cannot be used. If a kernel does not compile, its text stays in a file in TMPDIR, which
// the message names. The library prints nothing, unless memory runs out or it finds a bug in itself. Then the
// process prints a message to stderr and exits.
//
// Each struct begins with its size, which the caller sets to sizeof, so that later versions of the library
// can add members. Members beyond the caller's size are read as 0. A member that this version of the library
// does not have must be 0, or the call is refused. In structs that the library fills, members beyond the
// caller's size are not written, and members that this version does not have are set to 0. Pointers must not
// be NULL unless a comment permits it.
//
// A scene does not depend on a device; a tracer needs its device. A device serves one call at a time, and
// calls from other threads wait. Calls only read a scene, so several threads may use it at once. Listing
// devices and opening one set the environment variable POCL_WORK_GROUP_SPECIALIZATION unless it is set.
#ifndef GLINT_H
#define GLINT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifdef __GNUC__
#pragma GCC visibility push(default)
#endif

// Incremented with each incompatible version of the interface.
#define GLINT_API_VERSION 1

typedef enum {
    GLINT_DONE = 0,
    GLINT_WRONG_INPUT = 1,   // a scene, a setting or a device's name is wrong; the messages explain it
    GLINT_DEVICE_FAILED = 2, // an OpenCL call failed; close the device
    GLINT_STOPPED = 3        // the caller's progress function stopped the render
} GlintStatus;

typedef enum {
    GLINT_SINGLE,   // float
    GLINT_STRICT,   // float, with the same bits on every device
    GLINT_DOUBLE,   // double
    GLINT_CERTIFIED // float with error bounds, then double where those leave a decision uncertain
} GlintPrecision;

typedef enum { GLINT_FLOAT32, GLINT_FLOAT64 } GlintReal;

typedef struct GlintDevice GlintDevice;
typedef struct GlintScene GlintScene;
typedef struct GlintTracer GlintTracer;

// Returns the version of the library, such as "0.2.0" or, between releases, "0.2.0-3-g5d2aaa6".
const char *glint_version(void);
void glint_text_free(char *text); // accepts NULL

// Devices

typedef struct {
    size_t size;
    uint32_t index; // in decimal, a selector for glint_device_open
    uint32_t compute_units;
    uint64_t memory_bytes; // 0 if unknown
    int is_gpu, is_cpu;
    int has_double;
    int is_usable; // whether glint can render with it
    char name[128], platform[128], driver[64];
} GlintDeviceInfo;

// Lists the devices of all platforms. Sets *count to their number, which may exceed `capacity`, the number of
// elements of `infos`. infos[0].size is the distance between elements. `infos` may be NULL if capacity is 0.
GlintStatus glint_devices_list(GlintDeviceInfo *infos, size_t capacity, size_t *count, char **messages);

// Opens the device that `selector` names: an index, a part of its name, its place on the PCI bus, its UUID,
// "cpu" or "gpu". NULL selects the one that the environment variable GLINT_DEVICE names, otherwise a GPU if
// there is one, otherwise a CPU. Sets *device to NULL on failure.
GlintStatus glint_device_open(const char *selector, GlintDevice **device, char **messages);
void glint_device_close(GlintDevice *device); // close its tracers first; accepts NULL
// Fills *info, whose size the caller has set.
void glint_device_info(const GlintDevice *device, GlintDeviceInfo *info);

// Scenes

// Options for reading a scene. Only YAML scenes have values to replace and frames.
typedef struct {
    size_t size;
    // Values to replace, in the syntax of glint render --set, such as "camera.fov=60". An empty value removes
    // the key.
    const char *const *overrides;
    size_t override_count;
    double frame; // the frame of an animated scene, which its shutter does not blur
    // The path of another scene, whose camera replaces the scene's, or NULL. Only glint_scene_load uses it.
    const char *camera;
    uint32_t max_pixels; // images with more pixels are refused; 0 means 134217728
} GlintSceneOptions;

// Reads a scene, mesh or glTF file. `options` may be NULL. Sets *scene to NULL on failure. Formats that
// assimp reads, such as FBX, need the program glint in PATH.
GlintStatus glint_scene_load(const char *path, const GlintSceneOptions *options, GlintScene **scene,
                             char **messages);
// Reads a scene in glint's YAML format from memory. Messages begin with `name`, which must not be NULL, and
// files that the scene names are relative to its folder.
GlintStatus glint_scene_parse(const char *text, size_t length, const char *name,
                              const GlintSceneOptions *options, GlintScene **scene, char **messages);

// Triangles in memory. A triangle's index is its object in hits and images.
typedef struct {
    size_t size;
    GlintReal real;            // the type of vertices and normals
    const void *vertices;      // 3 per vertex
    const void *normals;       // 3 per vertex, for smooth shading, or NULL; zero normals mean flat shading
    size_t vertex_count;       // at most 4294967295
    const uint32_t *triangles; // 3 vertex indices each
    size_t triangle_count;     // 1 to 16777216
} GlintMesh;

// Makes a scene of one gray mesh, with a camera that frames it and two lights. The arrays are copied.
GlintStatus glint_scene_of_mesh(const GlintMesh *mesh, GlintScene **scene, char **messages);
void glint_scene_free(GlintScene *scene); // accepts NULL

// Returns the number of objects; each triangle of a mesh counts as one.
size_t glint_scene_object_count(const GlintScene *scene);
size_t glint_scene_light_count(const GlintScene *scene);
// Returns the number of frames that an animated scene names, or 0.
uint32_t glint_scene_frame_count(const GlintScene *scene);
// Sets the size that the scene's file asks for, otherwise one that is 1280 pixels wide and has the camera's
// aspect ratio.
void glint_scene_image_size(const GlintScene *scene, uint32_t *width, uint32_t *height);

// Images

// glint_render calls this repeatedly, from the thread that renders, with the fraction that is done. A nonzero
// result stops the render. The function may trace on the device that renders and close its tracers, but must
// not close the device.
typedef int (*GlintProgress)(void *context, double fraction_done);

typedef struct {
    size_t size;
    uint32_t width, height; // 1 to 1048576; both 0 select glint_scene_image_size
    uint32_t samples;       // per pixel, 1 to 1048576; 0 means 1
    uint32_t bounces;       // the maximum per ray, 0 to 255
    GlintPrecision precision;
    uint32_t lanes;          // rays per work-item: 1, 4, 8 or 16; 0 lets glint choose
    GlintProgress progress;  // or NULL
    void *context;           // passed to progress
    double min_contribution; // 0 to 1; rays whose weight in the pixel is lower are not traced
} GlintRenderSettings;

// Arrays of height x width pixels from the top left, which the caller owns, or NULL for layers that are not
// wanted. Colors are linear light. The layers from t to shadow describe the ray through a pixel's center. If
// it misses, t is infinite, normal and position are 0, and object is 4294967295.
typedef struct {
    size_t size;
    double *color;    // 3 per pixel; required
    double *t;        // distance from the camera
    double *normal;   // 3 per pixel: shading normal, unit
    double *position; // 3 per pixel: the hit point, in the scene's coordinates
    uint32_t *object;
    uint32_t *shadow; // glint_scene_light_count per pixel: 1 where that light is occluded, 0 elsewhere
    uint32_t *flag;   // at GLINT_CERTIFIED 1 where re-rendered in double, 2 where uncertified, otherwise 0
    double *coverage; // fraction of the samples that hit an object
    double *backdrop; // 3 per pixel: the background's part of the color
} GlintImage;

// Renders the scene. A failure leaves the arrays undefined.
GlintStatus glint_render(GlintDevice *device, const GlintScene *scene, const GlintRenderSettings *settings,
                         GlintImage *image, char **messages);

// Rays

typedef struct {
    size_t size;
    GlintPrecision precision;
    uint32_t lanes; // rays per work-item: 1, 4, 8 or 16; 0 lets glint choose
} GlintTraceSettings;

// Prepares a scene for many calls of the functions that trace. The scene may be freed afterwards, but the
// device must outlive the tracer. Sets *tracer to NULL on failure.
GlintStatus glint_tracer_open(GlintDevice *device, const GlintScene *scene,
                              const GlintTraceSettings *settings, GlintTracer **tracer, char **messages);
void glint_tracer_close(GlintTracer *tracer); // accepts NULL

// Rays in memory that the caller owns. Numbers are finite, except that tmax may be infinite, and directions
// have any length but 0. At GLINT_SINGLE and GLINT_STRICT each number is rounded to float. Hits lie strictly
// between tmin and tmax, in lengths of the direction.
typedef struct {
    size_t size;
    size_t count;
    GlintReal real;         // the arrays' type
    const void *origins;    // 3 per ray
    const void *directions; // 3 per ray
    const void *tmin;       // 1 per ray; NULL means 0; at GLINT_CERTIFIED every tmin must be 0
    const void *tmax;       // 1 per ray; NULL means no end
} GlintRays;

typedef enum {
    GLINT_UNCERTAIN = 0,
    GLINT_CERTAIN = 1,           // proven by float with bounds
    GLINT_CERTAIN_IN_DOUBLE = 2, // proven by double with bounds
} GlintCertainty;

// Arrays of one value per ray, which the caller owns, or NULL where not wanted. On a miss object is
// 4294967295, t, low and high are infinite, and normal and position are 0.
typedef struct {
    size_t size;
    uint32_t *object;
    double *t;          // the nearest hit's t, in lengths of the direction
    double *low, *high; // bounds on the exact t where certain, otherwise t
    double *normal;     // 3 per ray: geometric, unit, facing the ray
    double *position;   // 3 per ray: the hit point, moved onto the surface
    // GlintCertainty. Unless it is GLINT_UNCERTAIN, exact arithmetic on the rays' and the scene's numbers
    // gives the same object or miss. It is always GLINT_UNCERTAIN below GLINT_CERTIFIED.
    uint8_t *certainty;
} GlintHits;

// Finds the nearest hit of each ray. A failure, such as an invalid ray, leaves the arrays undefined.
GlintStatus glint_trace(GlintTracer *tracer, const GlintRays *rays, GlintHits *hits, char **messages);

// Arrays of one value per ray, which the caller owns, or NULL where not wanted.
typedef struct {
    size_t size;
    uint8_t *occluded; // 1 where anything lies strictly between tmin and tmax, otherwise 0
    // GlintCertainty of the nearest hit. It may be GLINT_UNCERTAIN where only the object is uncertain.
    uint8_t *certainty;
} GlintOcclusion;

// Determines whether each ray hits anything. Time and certainty are those of glint_trace, because it finds
// the nearest hit. A ray that starts at a hit point may hit the same surface again, because the point is
// rounded. For shadows of a light with a place, trace from there to the points at GLINT_DOUBLE or
// GLINT_CERTIFIED, with a tmax of 1 - 1e-6 where the directions end at the points; for others start outside
// the scene. A failure leaves the arrays undefined.
GlintStatus glint_trace_occlusion(GlintTracer *tracer, const GlintRays *rays, GlintOcclusion *occlusion,
                                  char **messages);

// Hits of many rays, sorted by ray and then by t. The library allocates the arrays.
typedef struct {
    size_t size;
    size_t count;     // the number of hits
    size_t *ray;      // the index of each hit's ray
    uint32_t *object; // this and the following members are as in GlintHits
    double *t;
    double *normal;
    double *position;
} GlintAllHits;

// Finds up to hits_max hits of each ray, or all for SIZE_MAX, nearest first. If several hits have the same t,
// it finds one. The caller sets hits->size; the other members are overwritten and must not hold arrays of an
// earlier call. glint_all_hits_free frees the arrays. After a failure there are none, and count is 0.
// GLINT_CERTIFIED is refused, because its bounds are those of rays from their origins.
GlintStatus glint_trace_all(GlintTracer *tracer, const GlintRays *rays, size_t hits_max, GlintAllHits *hits,
                            char **messages);
void glint_all_hits_free(GlintAllHits *hits); // accepts NULL

// Errors of images

// An image and its reference: arrays of height x width x channels values from the top left, which the caller
// owns. 3 channels are colors in linear light, unless is_data is set. Any other number of channels is data,
// such as t.
typedef struct {
    size_t size;
    GlintReal real; // the type of both arrays
    uint32_t width, height, channels;
    const void *reference;
    const void *image;
    int is_data;
} GlintImagePair;

// The figures of glint diff, with the names of its JSON report.
typedef struct {
    size_t size;
    uint64_t differing_values; // in any bit
    uint64_t unmatched_values; // pairs in which one is infinite or NaN and the other is not the same
    uint64_t nonfinite_reference, nonfinite_image; // pixels
    // The pairs of finite values, and their errors, which are NaN if there are none.
    uint64_t compared_values;
    double max_abs, rmse, bias, p99_9, psnr, rel_mse;
    double max_ulp; // in units in the last place of the arrays' type; infinite if a value is unmatched
    uint32_t worst_x, worst_y; // the pixel with the largest error
    // Colors as a screen shows them. For data the counts are 0 and the doubles NaN.
    uint64_t srgb8_off_by_1, srgb8_off_by_2_or_more; // 8-bit values
    double srgb8_psnr, flip_mean, flip_max;
} GlintImageMetrics;

// Compares an image with its reference and fills *metrics, whose size the caller has set. To measure the
// error of a precision, compare a render at it with one at a higher precision.
GlintStatus glint_images_compare(const GlintImagePair *images, GlintImageMetrics *metrics, char **messages);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#ifdef __cplusplus
}
#endif

#endif
