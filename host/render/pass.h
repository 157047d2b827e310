// A pass over an image: which pixels it renders, at which precision and on which device.
#pragma once

#include "host/opencl/passport.h"
#include "host/render/buffer_pool.h"
#include "host/render/kernels.h"
#include "host/render/render_settings.h"
#include "host/scene/scene.h"

typedef struct {
    PixelPass type;
    Compute *compute;
    RenderSettings settings;
    uint32_t lanes;
    bool certifies;           // whether its kernels bound their errors and flag pixels for the next pass
    const Passport *passport; // describes the arithmetic of its kernels
    RenderReport *report;     // shared by all passes; describes the scene and kernels of the first
    DeviceScene scene;
    Kernels kernels;
    cl_mem sample_offsets; // positions in the pixel
    BufferPool pool;
} Pass;

// Opens a pass of an image with these settings on its device, with neither a scene nor kernels.
void pass_open(Pass *pass, PixelPass type, Compute *compute, const RenderSettings *settings,
               RenderReport *report);
// Frees the memory that the scene takes. Only the kernels are left, for a later pass.
void pass_release_scene(Pass *pass);
void pass_close(Pass *pass);

// Uploads the compiled scene to passes of its variant, at least one, on devices that have room for it, and
// takes ownership of it. A pass whose settings have `moves` is alone and keeps the arrays.
void passes_receive_scene(Pass *const *passes, size_t count, CompiledScene *compiled);
// Compiles another scene into *fresh or, if the settings have `moves`, moves the pass's arrays on the host.
// Returns false with a message, and nothing to free, if the scene cannot be compiled or does not fit the
// device. Kernels read the earlier scene until pass_move.
bool pass_compile(Pass *pass, const Scene *scene, const RenderSettings *settings, CompiledScene *fresh,
                  MessageList *messages);
// Uploads the scene that pass_compile prepared, takes ownership of it, and adopts the image's settings.
void pass_move(Pass *pass, CompiledScene *fresh, const RenderSettings *settings);

// Returns the pass that re-renders this one's flagged pixels. The passes of a renderer are an array.
static inline Pass *pass_next(Pass *pass)
{
    return pass->certifies ? pass + 1 : NULL;
}

static inline size_t pass_scalar_size(const Pass *pass)
{
    return pass->scene.is_double ? sizeof(double) : sizeof(float);
}

static inline uint32_t pass_light_count(const Pass *pass)
{
    return (uint32_t)pass->scene.compiled.arrays[FLAT_LIGHTS].count;
}

// Maps `size` bytes of a buffer, beginning at `begin`, for the host to read or write, and adds the time to
// the report. Returns NULL if the device failed. compute_unmap unmaps them.
void *pass_map(Pass *pass, cl_mem buffer, size_t begin, size_t size, cl_map_flags access);
// Reads a part of a buffer, waits, and adds the time to the report. Returns false if the device failed.
bool pass_read(Pass *pass, cl_mem buffer, size_t begin, size_t size, void *bytes);
