#include "host/render/device_scene.h"

#include "host/base/clock.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include <stdlib.h>

static SceneBuffer buffer_of(size_t type)
{
    return type < FLAT_NODES ? BUFFER_ARENA : type == FLAT_NODES ? BUFFER_NODES : BUFFER_TEXELS;
}

// Returns the layout of the buffers once the arrays that have changed are uploaded.
static SceneLayout scene_layout(const DeviceScene *scene, const CompiledScene *compiled)
{
    SceneLayout layout = {.begins = {0}};
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        uint64_t *end = &layout.buffer_sizes[buffer_of(type)];
        layout.array_sizes[type] = compiled->changed[type]
                                       ? flat_array_size(&compiled->arrays[type], scene->is_double)
                                       : scene->layout.array_sizes[type];
        layout.begins[type] = *end;
        *end += padded_size(layout.array_sizes[type]);
    }
    return layout;
}

// The size of the largest buffer that the host and the arena's offsets can address.
static const uint64_t buffer_bytes_max =
    SIZE_MAX / ARENA_UNIT < UINT32_MAX ? SIZE_MAX : (uint64_t)UINT32_MAX * ARENA_UNIT;

bool device_scene_fits(const DeviceScene *scene, const CompiledScene *compiled, MessageList *messages)
{
    const Device *device = scene->compute->device;
    const SceneLayout layout = scene_layout(scene, compiled);
    const bool is_known = device->memory_bytes > 0 && device->largest_buffer_bytes > 0;
    const uint64_t memory = is_known ? device->memory_bytes : UINT64_MAX,
                   reported = is_known ? device->largest_buffer_bytes : UINT64_MAX,
                   most = reported < buffer_bytes_max ? reported : buffer_bytes_max;
    uint64_t sum = 0, largest = 0;
    for (SceneBuffer i = 0; i < SCENE_BUFFER_COUNT; i++) {
        sum += layout.buffer_sizes[i];
        if (layout.buffer_sizes[i] > largest) largest = layout.buffer_sizes[i];
    }
    if (sum <= memory && largest <= most) return true;
    const ShortText sum_text = text_size((double)sum), largest_text = text_size((double)largest),
                    most_text = text_size((double)most);
    if (!is_known)
        return message_error(messages, "the scene needs a buffer of %s, but at most %s can be addressed",
                             largest_text.text, most_text.text);
    return message_error(messages,
                         "the scene needs %s on the device, %s of it in one buffer; the device \"%s\" has "
                         "%s, and at most %s in one buffer",
                         sum_text.text, largest_text.text, device->name, text_size((double)memory).text,
                         most_text.text);
}

// Returns whether scene_move neither reads nor changes an array.
static bool array_ignores_eye(size_t type)
{
    return type == FLAT_TRIANGLE_NORMALS || type == FLAT_TRIANGLE_UVS || type == FLAT_TRIANGLE_NEIGHBORS ||
           type == FLAT_SKY_CELLS || type == FLAT_TEXTURE_LEVELS || type == FLAT_TEXELS;
}

// Stages the buffers whose size differs. All arrays in them have then changed, because only scene_compile
// changes the size of an array, and it writes all but the texels, which have a separate buffer.
static void buffers_stage(DeviceScene *scene, const CompiledScene *compiled)
{
    const SceneLayout layout = scene_layout(scene, compiled);
    for (SceneBuffer i = 0; i < SCENE_BUFFER_COUNT; i++) {
        if (scene->buffers[i] && scene->layout.buffer_sizes[i] == layout.buffer_sizes[i]) continue;
        buffer_release(scene->buffers[i]);
        scene->buffers[i] = NULL;
        scene->staged[i] = memory_allocate_large((size_t)layout.buffer_sizes[i], 1);
    }
    scene->layout = layout;
    scene->upload_seconds = 0;
}

// Writes an array to its staged buffer, or to its place in the buffer on the device.
static void array_upload(DeviceScene *scene, size_t type, const FlatArray *array)
{
    const SceneBuffer buffer = buffer_of(type);
    char *staged = scene->staged[buffer];
    const size_t begin = (size_t)scene->layout.begins[type], size = (size_t)scene->layout.array_sizes[type];
    if (size == 0) return;
    void *bytes = staged ? staged + begin : buffer_map(scene->compute, scene->buffers[buffer], begin, size);
    if (!bytes) return;
    flat_array_write(array, scene->is_double, bytes);
    if (scene->hashes && !is_ordered_by_bvh(type)) scene->hash = hash_bytes(scene->hash, bytes, size);
    if (!staged) compute_unmap(scene->compute, scene->buffers[buffer], bytes);
}

static void staged_upload(DeviceScene *scene)
{
    const double start = clock_seconds();
    for (SceneBuffer i = 0; i < SCENE_BUFFER_COUNT; i++) {
        if (!scene->staged[i]) continue;
        scene->buffers[i] =
            buffer_adopt(scene->compute, (size_t)scene->layout.buffer_sizes[i], scene->staged[i]);
        scene->staged[i] = NULL;
    }
    scene->upload_seconds += clock_seconds() - start;
}

void device_scenes_upload(DeviceScene *const *scenes, size_t count, CompiledScene *compiled)
{
    for (size_t i = 0; i < count; i++)
        buffers_stage(scenes[i], compiled);
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        for (size_t i = 0; i < count && compiled->changed[type]; i++) {
            const double start = clock_seconds();
            array_upload(scenes[i], type, &compiled->arrays[type]);
            scenes[i]->upload_seconds += clock_seconds() - start;
        }
        compiled->changed[type] = false;
        if (scenes[0]->moves && !array_ignores_eye(type)) continue;
        free(compiled->arrays[type].items);
        compiled->arrays[type].items = NULL;
    }
    for (size_t i = 0; i < count; i++) {
        staged_upload(scenes[i]);
        if (scenes[i]->hashes) { // lengths are restored with the unit
            const uint64_t hash = hash_bytes(scenes[i]->hash, &compiled->primitives_hash, sizeof(uint64_t));
            scenes[i]->hash = hash_bytes(hash, &compiled->unit, sizeof compiled->unit);
        }
        if (compiled == &scenes[i]->compiled) continue;
        scenes[i]->compiled = *compiled;
        compiled->textures = NULL; // scenes[0] has them; only a scene that is alone reads these two
        compiled->instances = NULL;
    }
}

void device_scene_release(DeviceScene *scene)
{
    for (SceneBuffer i = 0; i < SCENE_BUFFER_COUNT; i++) {
        buffer_release(scene->buffers[i]);
        scene->buffers[i] = NULL;
    }
    compiled_scene_free(&scene->compiled);
}

void device_scene_set_arguments(const DeviceScene *scene, cl_kernel kernel)
{
    Compute *compute = scene->compute;
    const cl_mem *buffers = scene->buffers;
#define OFFSET_VALUE(NAME, Type, name, names) (unsigned)(scene->layout.begins[FLAT_##NAME] / ARENA_UNIT),
    const ArenaOffsets offsets = {ARENA_LIST(OFFSET_VALUE)};
    kernel_buffer(compute, kernel, ARGUMENT_ARENA, buffers[BUFFER_ARENA]);
    kernel_argument(compute, kernel, ARGUMENT_OFFSETS, sizeof offsets, &offsets);
    kernel_buffer(compute, kernel, ARGUMENT_NODES, buffers[BUFFER_NODES]);
    kernel_buffer(compute, kernel, ARGUMENT_TEXELS, buffers[BUFFER_TEXELS]);
}
