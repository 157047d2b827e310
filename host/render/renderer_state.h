// Defines the members of a Renderer for the files of this room.
#pragma once

#include "host/opencl/passport.h"
#include "host/render/device_scene.h"
#include "host/render/pace.h"
#include "host/render/renderer.h"
#include "host/render/spare_buffers.h"

typedef enum {
    KERNEL_RENDER,
    KERNEL_AOV,
    KERNEL_PATH,
    KERNEL_COVERAGE,
    KERNEL_TRACE,
    KERNEL_CLOSEST,
    KERNEL_COUNT
} KernelType;

typedef struct {
    ProgramRequest request;
    Program program;
    cl_kernel kernel; // NULL until it is first requested
} KernelSlot;

// Kernels whose text follows the same definitions.
typedef struct {
    Text prelude;
    Text easy_prelude; // keeps functions out of line; empty if `prelude` does so
    const char *options;
    KernelSlot kernels[KERNEL_COUNT];
} KernelVariant;

struct Renderer {
    Compute *compute;
    RenderSettings settings;
    PixelPass pass;
    const Passport *passport; // of the renderer's kernels
    RenderReport report;
    DeviceScene scene;
    cl_mem sample_offsets; // positions in the pixel
    SpareBuffers spares;
    // The variant in use and the one before it. Near a shape a moving camera alternates between two variants.
    KernelVariant variant, other_variant;
    Pace paces[KERNEL_COUNT]; // for the variant in use
    Renderer *next_pass;      // NULL in the last
};

// Returns the index behind the last sample that is rendered.
static inline uint32_t samples_end(const RenderSettings *settings)
{
    return settings->end_sample > 0 ? settings->end_sample : settings->sample_count;
}

static inline uint32_t renderer_light_count(const Renderer *renderer)
{
    return (uint32_t)renderer->scene.compiled.arrays[FLAT_LIGHTS].count;
}

size_t renderer_scalar_size(const Renderer *renderer);

// Returns whether the renderer's kernels bound their errors and flag pixels, which they do at `certified` and
// in double precision for the pixels that `certified` flagged.
bool renderer_certifies(const Renderer *renderer);

// Chooses the variant of the kernels that the settings, the device and the compiled scene need. If one of the
// last two variants suits, reuses it with its kernels.
void renderer_kernels_choose(Renderer *renderer);
// Moves the kernels of an earlier renderer of the device to this one, which must have none. The earlier
// renderer has none afterwards.
void renderer_kernels_adopt(Renderer *renderer, Renderer *earlier);
void renderer_kernels_close(Renderer *renderer);

// Returns the kernel with the scene's arguments set, and builds it when first requested. Returns NULL if the
// device failed.
cl_kernel renderer_kernel(Renderer *renderer, KernelType type);

// Launches a kernel as kernel_launch_from does and adds the time to the report. Returns the launch's seconds
// by its event if that is trusted, else by the host's clock.
double renderer_launch(Renderer *renderer, KernelType type, cl_uint dimensions, const size_t *first,
                       const size_t *items, const size_t *group);

// Returns the pace of a kernel's launches, with the target of the settings.
Pace *renderer_pace(Renderer *renderer, KernelType type);

// Maps `size` bytes of a buffer, beginning at `begin`, for the host to read or write, and adds the time to
// the report. Returns NULL if the device failed. renderer_unmap releases the mapping and accepts NULL.
void *renderer_map(Renderer *renderer, cl_mem buffer, size_t begin, size_t size, cl_map_flags access);
// Reads a part of a buffer and waits. Returns false if the device failed.
bool renderer_read(Renderer *renderer, cl_mem buffer, size_t begin, size_t size, void *bytes);
void renderer_unmap(Renderer *renderer, cl_mem buffer, const void *mapped);
