// A Renderer's members, for the files of this room.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/render/renderer.h"

typedef enum { KERNEL_RENDER, KERNEL_AOV, KERNEL_PATH, KERNEL_TRACE, KERNEL_COUNT } KernelKind;

typedef struct {
    ProgramRequest request;
    Program program;
    cl_kernel kernel; // NULL until first requested
} KernelSlot;

struct Renderer {
    Compute *compute;
    RenderSettings settings;
    RenderReport report;
    Text prelude;
    const char *options;
    cl_mem arrays[FLAT_COUNT];
    CompiledTexture *textures; // of the scene, once uploaded
    cl_mem offsets;            // of a pixel's samples
    size_t light_count;
    double unit;                   // scene lengths per device length, a power of two
    uint32_t pending_children_max; // of the BVH
    KernelSlot kernels[KERNEL_COUNT];
};

size_t renderer_scalar_size(const Renderer *renderer);

// The kernel with the scene's arrays set as its first FLAT_COUNT arguments; built when first requested. NULL:
// the device failed.
cl_kernel renderer_kernel(Renderer *renderer, KernelKind kind);

// Launches as kernel_launch does and adds the time to the report.
LaunchTime renderer_launch(Renderer *renderer, KernelKind kind, cl_uint dimensions, const size_t *items,
                           const size_t *group);

// Maps a buffer for the host to read and adds the time to the report; NULL: the device failed. Released with
// renderer_unmap, which accepts NULL.
void *renderer_map(Renderer *renderer, cl_mem buffer, size_t size);
void renderer_unmap(Renderer *renderer, cl_mem buffer, const void *mapped);
