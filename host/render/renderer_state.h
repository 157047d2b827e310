// A Renderer's members, for the files of this room.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/opencl/passport.h"
#include "host/render/pace.h"
#include "host/render/renderer.h"

typedef enum {
    KERNEL_RENDER,
    KERNEL_AOV,
    KERNEL_PATH,
    KERNEL_TRACE,
    KERNEL_CLOSEST,
    KERNEL_COUNT
} KernelKind;

typedef struct {
    ProgramRequest request;
    Program program;
    cl_kernel kernel; // NULL until first requested
} KernelSlot;

// Kernels with the same definitions before their text.
typedef struct {
    Text prelude;
    Text easy_prelude; // with functions out of line; empty where they are in any case
    const char *options;
    KernelSlot kernels[KERNEL_COUNT];
} KernelVariant;

// The scene on the device: the arena (kernels/types.h), and the arrays that are not in it.
typedef enum { BUFFER_ARENA, BUFFER_NODES, BUFFER_TEXELS, SCENE_BUFFER_COUNT } SceneBuffer;

// Returns the size of an array with the padding up to the next one in its buffer.
static inline uint64_t padded_size(uint64_t size)
{
    return (size + ARENA_UNIT - 1) / ARENA_UNIT * ARENA_UNIT;
}

// Where each array begins in its buffer, in bytes.
typedef struct {
    uint64_t begins[FLAT_COUNT], array_sizes[FLAT_COUNT], buffer_sizes[SCENE_BUFFER_COUNT];
} SceneLayout;

struct Renderer {
    Compute *compute;
    RenderSettings settings;
    PixelPass pass;
    const Passport *passport; // of its kernels
    RenderReport report;
    CompiledScene compiled; // without the arrays that are only on the device
    cl_mem buffers[SCENE_BUFFER_COUNT];
    void *staged[SCENE_BUFFER_COUNT]; // the contents of a buffer until it is created
    SceneLayout layout;
    cl_mem sample_offsets; // in the pixel
    size_t light_count;
    // The one in use, and the one before: near a shape a moving camera alternates between two.
    KernelVariant variant, other_variant;
    Pace paces[KERNEL_COUNT]; // of the variant in use
    // For the next pass; NULL: this is the last.
    Renderer *repeat;
};

size_t renderer_scalar_size(const Renderer *renderer);

// Whether this one's kernels bound their errors and leave pixels in doubt: at `certified`, and at `double`
// for those pixels.
bool renderer_certifies(const Renderer *renderer);

// Chooses the variant of the kernels that the settings, the device and the compiled scene need; of the two
// last used it takes the one that suits, with its kernels.
void renderer_kernels_choose(Renderer *renderer);
// Takes the kernels of an earlier renderer of the device, which is left with none, and has none before.
void renderer_kernels_take(Renderer *renderer, Renderer *earlier);
void renderer_kernels_close(Renderer *renderer);

// The numbers of SCENE_ARGUMENTS (kernels/scene.h); a kernel's other arguments follow.
enum { ARGUMENT_ARENA, ARGUMENT_OFFSETS, ARGUMENT_NODES, ARGUMENT_TEXELS, SCENE_ARGUMENT_COUNT };

// The kernel with the scene's arguments set; built when first requested. NULL: the device failed.
cl_kernel renderer_kernel(Renderer *renderer, KernelKind kind);

// Launches as kernel_launch_from does and adds the time to the report. Returns the launch's seconds: the
// event's if trusted, else the host's.
double renderer_launch(Renderer *renderer, KernelKind kind, cl_uint dimensions, const size_t *first,
                       const size_t *items, const size_t *group);

// The pace of a kernel's launches, with its target by the settings.
Pace *renderer_pace(Renderer *renderer, KernelKind kind);

// Maps `size` bytes of a buffer, which begin at `begin`, for the host to read or write, and adds the time to
// the report. Returns NULL if the device failed. Released with renderer_unmap, which accepts NULL.
void *renderer_map(Renderer *renderer, cl_mem buffer, size_t begin, size_t size, cl_map_flags access);
void renderer_unmap(Renderer *renderer, cl_mem buffer, const void *mapped);
