#include "host/opencl/capture.h"

#include "host/base/array.h"
#include "host/base/base64.h"
#include "host/base/hash.h"
#include "host/base/json.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void capture_argument(Compute *compute, cl_kernel kernel, cl_uint index, bool is_buffer, size_t size,
                      const void *value)
{
    const CapturedArgument unset = {.kernel = kernel, .index = index};
    size_t i = 0;
    while (i < compute->captured.count &&
           (compute->captured.items[i].kernel != kernel || compute->captured.items[i].index != index))
        i++;
    if (i == compute->captured.count) array_push(compute->captured, unset);
    CapturedArgument *argument = &compute->captured.items[i];
    argument->is_buffer = is_buffer; // a released kernel may have had this one's address
    text_free(&argument->value);
    text_append(&argument->value, value, size);
}

void capture_close(Compute *compute)
{
    for (size_t i = 0; i < compute->captured.count; i++)
        text_free(&compute->captured.items[i].value);
    free(compute->captured.items);
}

// Writes a file named by the hash of its bytes, unless it exists, and adds its name to the JSON object.
// On failure sets the Compute's failure and returns false.
static bool capture_write(Compute *compute, Json *json, const char *key, const char *ending,
                          const void *bytes, size_t size)
{
    OWNED char *name = text_format("%016" PRIx64 ".%s", hash_bytes(HASH_START, bytes, size), ending),
               *path = text_format("%s/%s", compute->device->capture_folder, name);
    OwnedMessageList messages = {0};
    const bool is_written = access(path, F_OK) == 0 || output_write_file(path, bytes, size, &messages);
    if (!is_written && compute_ok(compute)) {
        compute_fail(compute, "capture", CL_SUCCESS, "%s", messages.items[0].text);
        compute->failure.is_of_host = true;
    }
    if (json) json_text(json, key, name);
    return is_written;
}

static bool buffer_write_file(Compute *compute, Json *json, cl_mem buffer)
{
    size_t size = 0;
    if (!buffer) json_none(json, "buffer");
    if (!buffer || !compute_try(compute, clGetMemObjectInfo(buffer, CL_MEM_SIZE, sizeof size, &size, NULL)))
        return compute_ok(compute);
    OWNED char *bytes = memory_allocate(size, 1);
    return buffer_read(compute, buffer, size, bytes) &&
           capture_write(compute, json, "buffer", "bin", bytes, size);
}

static bool argument_write(Compute *compute, Json *json, const CapturedArgument *argument)
{
    bool is_written = true;
    json_begin_object(json, NULL);
    json_count(json, "index", argument->index);
    if (argument->is_buffer) {
        cl_mem buffer;
        memcpy(&buffer, text_c(&argument->value), sizeof buffer);
        is_written = buffer_write_file(compute, json, buffer);
    } else {
        OwnedText value = {0};
        base64_append(&value, (const uint8_t *)argument->value.items, argument->value.count);
        json_text(json, "value", text_c(&value));
    }
    json_end(json);
    return is_written;
}

static void sizes_write(Json *json, const char *key, cl_uint dimensions, const size_t *sizes)
{
    if (!sizes) return;
    json_begin_array(json, key);
    for (cl_uint i = 0; i < dimensions; i++)
        json_count(json, NULL, sizes[i]);
    json_end(json);
}

void capture_launch(Compute *compute, const Launch *launch)
{
    if (!compute->device->capture_folder || !compute_ok(compute)) return;
    const ProgramRequest *request = launch->request;
    OWNED char *text = program_request_text(request, launch->is_out_of_line);
    OwnedText options = {0};
    program_options_append(&options, compute->device, request->options);
    Json *json = json_open();
    json_text(json, "device", compute->device->name);
    json_text(json, "driver", compute->device->driver);
    json_text(json, "kernel", request->kernel);
    json_text(json, "options", text_c(&options));
    bool is_written = capture_write(compute, json, "text", "cl", text, strlen(text));
    sizes_write(json, "first", launch->dimensions, launch->first);
    sizes_write(json, "items", launch->dimensions, launch->items);
    sizes_write(json, "group", launch->dimensions, launch->group);
    json_begin_array(json, "arguments");
    // an earlier, released kernel at this address may have had more arguments
    cl_uint argument_count = 0;
    is_written =
        is_written && compute_try(compute, clGetKernelInfo(launch->kernel, CL_KERNEL_NUM_ARGS,
                                                           sizeof argument_count, &argument_count, NULL));
    for (size_t i = 0; i < compute->captured.count && is_written; i++)
        if (compute->captured.items[i].kernel == launch->kernel &&
            compute->captured.items[i].index < argument_count)
            is_written = argument_write(compute, json, &compute->captured.items[i]);
    json_end(json);
    OwnedText index = json_close(json);
    if (is_written) capture_write(compute, NULL, NULL, "json", index.items, index.count);
}
