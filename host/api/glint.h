// libglint: renders scenes and traces rays on OpenCL devices.
//
// Functions that can fail return a GlintStatus. Where they take `messages` (NULL: not wanted), they set
// *messages to their warnings and errors, one or more lines each, which glint_text_free frees, or to NULL if
// there are none.
//
// A struct begins with its size, which the caller sets to sizeof, so that later versions of the library may
// add members: those beyond the caller's size count as 0. There is no global state. Handles of one kind do
// not depend on each other; a device serves one call at a time, and lets those of other threads wait. A scene
// is only read, and may be used by several threads at once. Lack of memory ends the process.
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

// Rises with each version of the interface that is not compatible with the one before.
#define GLINT_API_VERSION 1

typedef enum {
    GLINT_DONE = 0,
    GLINT_WRONG_INPUT = 1,   // a scene, setting or name of a device is wrong: see the messages
    GLINT_DEVICE_FAILED = 2, // an OpenCL call failed: close the device
    GLINT_STOPPED = 3        // the caller's progress function ended it
} GlintStatus;

typedef enum {
    GLINT_SINGLE,   // float
    GLINT_STRICT,   // float, with the same bits on every device
    GLINT_DOUBLE,   // double
    GLINT_CERTIFIED // float with error bounds, then double where these leave a decision open
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
    uint32_t index; // as a selector of glint_device_open
    uint32_t compute_units;
    uint64_t memory_bytes; // 0: unknown
    int is_gpu, is_cpu;
    int has_double;
    int is_usable; // glint can render with it
    char name[128], platform[128], driver[64];
} GlintDeviceInfo;

// Lists the devices of all platforms. Sets *count to their number, which may exceed `capacity`, the number of
// elements of `infos`; each of these has its size set. `infos` may be NULL if capacity is 0.
GlintStatus glint_devices_list(GlintDeviceInfo *infos, size_t capacity, size_t *count, char **messages);

// Opens the device that `selector` names: an index, a part of its name, its place on the PCI bus, its UUID,
// "cpu" or "gpu"; NULL: the one that the environment variable GLINT_DEVICE names, else a GPU, else a CPU.
// *device is NULL on failure.
GlintStatus glint_device_open(const char *selector, GlintDevice **device, char **messages);
void glint_device_close(GlintDevice *device); // its tracers are closed before; accepts NULL
void glint_device_info(const GlintDevice *device, GlintDeviceInfo *info);

// Scenes

// Reads a scene, mesh or glTF file. *scene is NULL on failure. Formats that assimp reads, such as FBX, need
// the program glint in PATH.
GlintStatus glint_scene_load(const char *path, GlintScene **scene, char **messages);
// Reads a scene in glint's YAML format from memory. `name` heads messages, and files that the scene names are
// relative to its folder.
GlintStatus glint_scene_parse(const char *text, size_t length, const char *name, GlintScene **scene,
                              char **messages);

// Triangles in memory. A triangle's index is its object in hits and images.
typedef struct {
    size_t size;
    GlintReal real;            // of vertices and normals
    const void *vertices;      // 3 per vertex
    const void *normals;       // 3 per vertex, for smooth shading, zero: flat there; NULL: flat
    size_t vertex_count;       // at most 4294967295
    const uint32_t *triangles; // 3 indices of vertices each
    size_t triangle_count;     // 1 to 16777216
} GlintMesh;

// Makes a scene of one mesh, gray, with a camera that frames it and two lights. The arrays are copied.
GlintStatus glint_scene_of_mesh(const GlintMesh *mesh, GlintScene **scene, char **messages);
void glint_scene_free(GlintScene *scene); // accepts NULL

// Objects, with each triangle of a mesh as one.
size_t glint_scene_object_count(const GlintScene *scene);
size_t glint_scene_light_count(const GlintScene *scene);
// The size that the scene's file asks for, else one of 1280 pixels' width with its camera's aspect ratio.
void glint_scene_image_size(const GlintScene *scene, uint32_t *width, uint32_t *height);

// Images

// Called by glint_render now and then with the fraction that is done; not 0 ends the render.
typedef int (*GlintProgress)(void *context, double fraction_done);

typedef struct {
    size_t size;
    uint32_t width, height; // 0: glint_scene_image_size
    uint32_t samples;       // per pixel; 0: 1
    uint32_t bounces;       // of a ray, at most
    GlintPrecision precision;
    uint32_t lanes;         // rays per work-item: 1, 4, 8 or 16; 0: as suits the device
    GlintProgress progress; // NULL: none
    void *context;          // of progress
} GlintRenderSettings;

// Arrays of height x width pixels from the top left, which the caller owns; NULL: not wanted. Colors are
// linear light. AOVs are of the ray through a pixel's center; where it misses, t is infinite, normal and
// position are 0, and object is 4294967295.
typedef struct {
    size_t size;
    double *color;    // 3 per pixel; required
    double *t;        // distance from the camera
    double *normal;   // 3 per pixel: shading normal, unit
    double *position; // 3 per pixel: the hit point, in the scene's coordinates
    uint32_t *object;
    uint32_t *shadow; // glint_scene_light_count per pixel: 1 where that light is occluded, 0 elsewhere
    uint32_t *doubt;  // at GLINT_CERTIFIED: 1 where re-rendered in double, 2 where uncertain, else 0
} GlintImage;

// Renders the scene. A failure leaves the arrays undefined.
GlintStatus glint_render(GlintDevice *device, const GlintScene *scene, const GlintRenderSettings *settings,
                         GlintImage *image, char **messages);

// Rays

typedef struct {
    size_t size;
    GlintPrecision precision;
    uint32_t lanes; // as in GlintRenderSettings
} GlintTraceSettings;

// Prepares a scene for many calls of glint_trace. The scene may be freed afterwards; the device must outlive
// the tracer. *tracer is NULL on failure.
GlintStatus glint_tracer_open(GlintDevice *device, const GlintScene *scene,
                              const GlintTraceSettings *settings, GlintTracer **tracer, char **messages);
void glint_tracer_close(GlintTracer *tracer); // accepts NULL

// Rays in memory that the caller owns. Directions may have any length but 0. Hits lie strictly between tmin
// and tmax, in lengths of the direction.
typedef struct {
    size_t size;
    size_t count;
    GlintReal real;         // of the arrays
    const void *origins;    // 3 per ray
    const void *directions; // 3 per ray
    const void *tmin;       // 1 per ray; NULL: 0, as it must be at GLINT_CERTIFIED
    const void *tmax;       // 1 per ray; NULL: no end
} GlintRays;

typedef enum {
    GLINT_UNCERTAIN = 0,
    GLINT_CERTAIN = 1,           // by float with bounds
    GLINT_CERTAIN_IN_DOUBLE = 2, // by double with bounds
} GlintCertainty;

// Arrays of one value per ray, which the caller owns; NULL: not wanted. On a miss object is 4294967295, t,
// low and high are infinite, and normal and position 0.
typedef struct {
    size_t size;
    uint32_t *object;
    double *t;          // of the nearest hit, in lengths of the direction
    double *low, *high; // bounds of the exact t where certain, else t
    double *normal;     // 3 per ray: geometric, unit, facing the ray
    double *position;   // 3 per ray: the hit point, moved onto the surface
    uint8_t *certainty; // GlintCertainty: what is certain has the object, or miss, that exact arithmetic on
                        // the rays' and the scene's numbers finds; below GLINT_CERTIFIED nothing is
} GlintHits;

// Finds the nearest hit of each ray.
GlintStatus glint_trace(GlintTracer *tracer, const GlintRays *rays, GlintHits *hits, char **messages);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#ifdef __cplusplus
}
#endif

#endif
