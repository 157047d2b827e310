// Devices as their platforms describe them. A query that fails leaves its field zero or its text empty: a
// runtime that cannot answer must not keep the other devices from being used.
#include "host/opencl/device.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static char *platform_text(cl_platform_id platform, cl_platform_info what)
{
    size_t size = 0;
    if (clGetPlatformInfo(platform, what, 0, NULL, &size) != CL_SUCCESS) size = 0;
    char *text = memory_allocate_zeroed(size + 1, 1);
    if (size > 0 && clGetPlatformInfo(platform, what, size, text, NULL) != CL_SUCCESS) text[0] = '\0';
    return text;
}

static char *device_text(cl_device_id id, cl_device_info what)
{
    size_t size = 0;
    if (clGetDeviceInfo(id, what, 0, NULL, &size) != CL_SUCCESS) size = 0;
    char *text = memory_allocate_zeroed(size + 1, 1);
    if (size > 0 && clGetDeviceInfo(id, what, size, text, NULL) != CL_SUCCESS) text[0] = '\0';
    return text;
}

// The same for numbers: `value` must be zero before and stays so where the device cannot answer.
#define device_number(id, what, value)                                                                       \
    do {                                                                                                     \
        if (clGetDeviceInfo((id), (what), sizeof *(value), (value), NULL) != CL_SUCCESS) *(value) = 0;       \
    } while (0)

// The first three, where the device tells of at most eight dimensions.
static void device_sides(cl_device_id id, size_t longest[3])
{
    size_t sides[8] = {0};
    if (clGetDeviceInfo(id, CL_DEVICE_MAX_WORK_ITEM_SIZES, sizeof sides, sides, NULL) != CL_SUCCESS) return;
    memcpy(longest, sides, 3 * sizeof *sides);
}

static bool device_flag(cl_device_id id, cl_device_info what)
{
    cl_bool flag = CL_FALSE;
    device_number(id, what, &flag);
    return flag != CL_FALSE;
}

// A whole word of the blank-separated list of extensions.
static bool extensions_have(const char *extensions, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = extensions; (at = strstr(at, name)) != NULL; at += length) {
        bool begins = at == extensions || at[-1] == ' ';
        if (begins && (at[length] == ' ' || at[length] == '\0')) return true;
    }
    return false;
}

static void device_describe(Device *device)
{
    cl_device_id id = device->id;
    device->platform_name = platform_text(device->platform, CL_PLATFORM_NAME);
    device->platform_version = platform_text(device->platform, CL_PLATFORM_VERSION);
    device->name = device_text(id, CL_DEVICE_NAME);
    device->vendor = device_text(id, CL_DEVICE_VENDOR);
    device->version = device_text(id, CL_DEVICE_VERSION);
    device->driver = device_text(id, CL_DRIVER_VERSION);
    device->extensions = device_text(id, CL_DEVICE_EXTENSIONS);

    device_number(id, CL_DEVICE_TYPE, &device->type);
    device_number(id, CL_DEVICE_MAX_COMPUTE_UNITS, &device->compute_units);
    device_number(id, CL_DEVICE_MAX_CLOCK_FREQUENCY, &device->clock_mhz);
    device_number(id, CL_DEVICE_MAX_WORK_GROUP_SIZE, &device->largest_work_group);
    device_sides(id, device->longest_group_sides);
    device_number(id, CL_DEVICE_GLOBAL_MEM_SIZE, &device->memory_bytes);
    device_number(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE, &device->largest_buffer_bytes);
    device_number(id, CL_DEVICE_LOCAL_MEM_SIZE, &device->local_memory_bytes);

    size_t timer_nanoseconds = 0;
    device_number(id, CL_DEVICE_PROFILING_TIMER_RESOLUTION, &timer_nanoseconds);
    device->timer_resolution_seconds = 1e-9 * (double)timer_nanoseconds;

    cl_device_fp_config single = 0, wide = 0;
    device_number(id, CL_DEVICE_SINGLE_FP_CONFIG, &single);
    device_number(id, CL_DEVICE_DOUBLE_FP_CONFIG, &wide);
    device->denormals = (single & CL_FP_DENORM) != 0;
    device->fma_in_hardware = (single & CL_FP_FMA) != 0;
    device->correctly_rounded = (single & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
    device->fp64 = wide != 0 || extensions_have(device->extensions, "cl_khr_fp64");

    device_number(id, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, &device->native_float_width);
    if (device->native_float_width == 0) device->native_float_width = 1;
    device_number(id, CL_DEVICE_NATIVE_VECTOR_WIDTH_DOUBLE, &device->native_double_width);
    if (!device->fp64) device->native_double_width = 0;
    if (device->fp64 && device->native_double_width == 0) device->native_double_width = 1;

    device->compiler = device_flag(id, CL_DEVICE_COMPILER_AVAILABLE);
    device->available = device_flag(id, CL_DEVICE_AVAILABLE);
    device->little_endian = device_flag(id, CL_DEVICE_ENDIAN_LITTLE);
}

static void device_list_add(DeviceList *list, cl_platform_id platform, cl_device_id id)
{
    Device device = {.platform = platform, .id = id, .index = (unsigned)list->count};
    device_describe(&device);
    for (size_t i = 0; i < list->count; i++) {
        const Device *other = &list->items[i];
        if (other->platform == platform && strcmp(other->name, device.name) == 0) device.twin++;
    }
    array_push(*list, device);
}

// PoCL reads this when it compiles a kernel for its first launch. A kernel made for one work-group size is no
// faster here than the one for all sizes, which its binaries need in any case: without this, it makes both.
static void pocl_compile_once(void)
{
    setenv("POCL_WORK_GROUP_SPECIALIZATION", "0", false);
}

void device_list_open(DeviceList *list)
{
    pocl_compile_once();
    *list = (DeviceList){0};
    cl_uint platform_count = 0;
    if (clGetPlatformIDs(0, NULL, &platform_count) != CL_SUCCESS || platform_count == 0) return;
    cl_platform_id *platforms = memory_allocate_zeroed(platform_count, sizeof *platforms);
    if (clGetPlatformIDs(platform_count, platforms, NULL) != CL_SUCCESS) platform_count = 0;
    list->platform_count = platform_count;

    for (cl_uint i = 0; i < platform_count; i++) {
        cl_uint device_count = 0;
        if (clGetDeviceIDs(platforms[i], CL_DEVICE_TYPE_ALL, 0, NULL, &device_count) != CL_SUCCESS)
            device_count = 0;
        cl_device_id *ids = memory_allocate_zeroed(device_count + 1u, sizeof *ids);
        if (device_count > 0 &&
            clGetDeviceIDs(platforms[i], CL_DEVICE_TYPE_ALL, device_count, ids, NULL) != CL_SUCCESS)
            device_count = 0;
        if (device_count == 0) list->empty_platform_count++;
        for (cl_uint j = 0; j < device_count; j++)
            device_list_add(list, platforms[i], ids[j]);
        free(ids);
    }
    free(platforms);
}

void device_list_close(DeviceList *list)
{
    for (size_t i = 0; i < list->count; i++) {
        Device *device = &list->items[i];
        free(device->name);
        free(device->vendor);
        free(device->version);
        free(device->driver);
        free(device->platform_name);
        free(device->platform_version);
        free(device->extensions);
    }
    free(list->items);
    *list = (DeviceList){0};
}

bool device_usable(const Device *device, const char **why)
{
    const char *missing = !device->available       ? "not available"
                          : !device->compiler      ? "no compiler"
                          : !device->little_endian ? "big-endian"
                                                   : NULL;
    if (why) *why = missing;
    return missing == NULL;
}

unsigned device_lanes(const Device *device, bool wide)
{
    if (!(device->type & CL_DEVICE_TYPE_CPU)) return 1;
    unsigned width = wide ? device->native_double_width : device->native_float_width;
    return width >= 16 ? 16 : width >= 8 ? 8 : width >= 4 ? 4 : 1;
}

const char *device_type_name(cl_device_type type)
{
    if (type & CL_DEVICE_TYPE_GPU) return "gpu";
    if (type & CL_DEVICE_TYPE_CPU) return "cpu";
    if (type & CL_DEVICE_TYPE_ACCELERATOR) return "accelerator";
    return "other";
}

const char *device_wish(const char *option)
{
    if (option) return option;
    const char *wish = getenv("GLINT_DEVICE");
    return wish && wish[0] != '\0' ? wish : NULL;
}

// GPUs before CPUs before the rest.
static int device_rank(const Device *device)
{
    return device->type & CL_DEVICE_TYPE_GPU ? 2 : device->type & CL_DEVICE_TYPE_CPU ? 1 : 0;
}

static bool is_number(const char *wish)
{
    return wish[0] != '\0' && wish[strspn(wish, "0123456789")] == '\0';
}

// A number fits a whole number of the name: an index that no device has is no part of "haswell-avx512".
static bool name_fits(const char *name, const char *wish)
{
    if (!is_number(wish)) return strcasestr(name, wish) != NULL;
    for (const char *at = name + strcspn(name, "0123456789"); *at; at += strcspn(at, "0123456789")) {
        size_t length = strspn(at, "0123456789");
        if (length == strlen(wish) && strncmp(at, wish, length) == 0) return true;
        at += length;
    }
    return false;
}

static bool device_fits(const Device *device, const char *wish)
{
    if (!wish) return true;
    if (strcasecmp(wish, "gpu") == 0) return (device->type & CL_DEVICE_TYPE_GPU) != 0;
    if (strcasecmp(wish, "cpu") == 0) return (device->type & CL_DEVICE_TYPE_CPU) != 0;
    return name_fits(device->name, wish) || name_fits(device->platform_name, wish);
}

// Whether the wish is the index of a device: "3090" may still be a part of a name.
static bool wish_is_index(const DeviceList *list, const char *wish, size_t *index)
{
    if (!wish || !is_number(wish)) return false;
    *index = strtoul(wish, NULL, 10);
    return *index < list->count;
}

static void complain(const DeviceList *list, const char *wish, MessageList *messages)
{
    if (list->count == 0) {
        message_add(
            messages, MESSAGE_ERROR,
            "no OpenCL device (platforms: %u, none has one); PoCL runs on any CPU: "
            "`apt install pocl-opencl-icd` on Debian and Ubuntu%s",
            list->platform_count,
            list->platform_count == 0
                ? ""
                : "; if it is installed, it needs a folder for its cache that can be written: set HOME, "
                  "XDG_CACHE_HOME or POCL_CACHE_DIR");
        return;
    }
    Text devices = {0};
    for (size_t i = 0; i < list->count; i++) {
        const Device *device = &list->items[i];
        const char *why;
        text_appendf(&devices, "%s%u (%s, %s", i ? "; " : "", device->index, device->name,
                     device_type_name(device->type));
        if (!device_usable(device, &why)) text_appendf(&devices, ", unusable: %s", why);
        text_append(&devices, ")", 1);
    }
    if (wish)
        message_add(messages, MESSAGE_ERROR, "no usable device is \"%s\"; there are: %s", wish,
                    text_c(&devices));
    else
        message_add(messages, MESSAGE_ERROR, "no usable device; there are: %s", text_c(&devices));
    text_free(&devices);
}

const Device *device_choose(const DeviceList *list, const char *wish, MessageList *messages)
{
    const Device *best = NULL;
    size_t index = 0;
    bool is_index = wish_is_index(list, wish, &index);
    for (size_t i = 0; i < list->count; i++) {
        const Device *device = &list->items[i];
        if (is_index ? i != index : !device_fits(device, wish)) continue;
        if (!device_usable(device, NULL)) continue;
        if (!best || device_rank(device) > device_rank(best)) best = device;
    }
    if (!best) complain(list, wish, messages);
    return best;
}
