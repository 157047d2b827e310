// A Renderer's members, for the files of this room.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/opencl/passport.h"
#include "host/render/pace.h"
#include "host/render/renderer.h"

typedef enum { KERNEL_RENDER, KERNEL_AOV, KERNEL_PATH, KERNEL_TRACE, KERNEL_COUNT } KernelKind;

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

struct Renderer {
    Compute *compute;
    RenderSettings settings;
    PixelPass pass;
    const Passport *passport; // of its kernels
    RenderReport report;
    CompiledScene compiled; // without the arrays that are only on the device
    cl_mem arrays[FLAT_COUNT];
    size_t array_sizes[FLAT_COUNT];
    cl_mem offsets; // of a pixel's samples
    size_t light_count;
    // The one in use, and the one before: near a shape a moving eye goes to and fro between two.
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

// The kernel with the scene's arrays set as its first FLAT_COUNT arguments; built when first requested. NULL:
// the device failed.
cl_kernel renderer_kernel(Renderer *renderer, KernelKind kind);

// Launches as kernel_launch_from does and adds the time to the report. Returns the launch's seconds: the
// event's if trusted, else the host's.
double renderer_launch(Renderer *renderer, KernelKind kind, cl_uint dimensions, const size_t *first,
                       const size_t *items, const size_t *group);

// The pace of a kernel's launches, with its target by the settings.
Pace *renderer_pace(Renderer *renderer, KernelKind kind);

// Maps a buffer for the host, to read or also to write, and adds the time to the report; NULL: the device
// failed. Released with renderer_unmap, which accepts NULL.
void *renderer_map(Renderer *renderer, cl_mem buffer, size_t size, cl_map_flags access);
void renderer_unmap(Renderer *renderer, cl_mem buffer, const void *mapped);
