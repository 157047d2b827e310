// A compiled scene in the memory of a device.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/opencl/compute.h"

// The buffers of the scene: the arena (kernels/types.h), and one for each array outside it.
typedef enum { BUFFER_ARENA, BUFFER_NODES, BUFFER_TEXELS, SCENE_BUFFER_COUNT } SceneBuffer;

// Returns the size of an array with the padding up to the next one in its buffer.
static inline uint64_t padded_size(uint64_t size)
{
    return (size + ARENA_UNIT - 1) / ARENA_UNIT * ARENA_UNIT;
}

// The offset of each array in its buffer and the sizes of both, in bytes.
typedef struct {
    uint64_t begins[FLAT_COUNT], array_sizes[FLAT_COUNT], buffer_sizes[SCENE_BUFFER_COUNT];
} SceneLayout;

// Starts as zero except for the members before `compiled`, with HASH_START as `hash`.
typedef struct {
    Compute *compute;
    bool is_double;         // whether the structs are in double
    bool moves;             // keeps in `compiled` the arrays that scene_move reads or changes
    bool hashes;            // extends `hash` by what is uploaded, except the BVH and the order that it gives
    uint64_t hash;          // the primitives
    CompiledScene compiled; // lacks arrays that are only on the device
    SceneLayout layout;
    cl_mem buffers[SCENE_BUFFER_COUNT];
    void *staged[SCENE_BUFFER_COUNT]; // each buffer's contents until it is created
    double upload_seconds;            // of the last upload
} DeviceScene;

// Returns false with a message if a buffer for the compiled scene would be larger than the host and the
// arena's offsets can address, or if its buffers would exceed the memory that the device reports. If the
// device reports none, creating the buffers may fail.
bool device_scene_fits(const DeviceScene *scene, const CompiledScene *compiled, MessageList *messages);
// Uploads the arrays of the compiled scene that have changed to devices, at least one, that read the same
// arrays and have room for them. Frees each array once all have it, unless the scene moves, which is then
// alone, so that at most one array is in memory twice. Takes ownership of the compiled scene, which may be
// scenes[0]->compiled.
void device_scenes_upload(DeviceScene *const *scenes, size_t count, CompiledScene *compiled);
// Frees the memory that the scene takes on the device and on the host.
void device_scene_release(DeviceScene *scene);

// The indices of SCENE_ARGUMENTS (kernels/scene.h). A kernel's other arguments follow them.
enum { ARGUMENT_ARENA, ARGUMENT_OFFSETS, ARGUMENT_NODES, ARGUMENT_TEXELS, SCENE_ARGUMENT_COUNT };

void device_scene_set_arguments(const DeviceScene *scene, cl_kernel kernel);
