// Queries devices from their platforms. A query that fails leaves its field zero or its text empty, so that
// one faulty runtime does not make the other devices unusable.
#include "host/opencl/device.h"

#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/opencl/passport.h"
#include <CL/cl_ext.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

// Returns whether a call succeeded, and keeps the first failure. A missing device or platform is not a
// failure, nor is a property that the runtime does not know (CL_INVALID_VALUE), such as double's format
// without fp64.
static bool list_check(DeviceList *list, cl_int status, const char *call)
{
    fault_record_call(NULL);
    bool is_absent =
        status == CL_DEVICE_NOT_FOUND || status == CL_PLATFORM_NOT_FOUND_KHR || status == CL_INVALID_VALUE;
    if (status != CL_SUCCESS && !is_absent && !list->failed_call) {
        list->failed_call = call;
        list->failed_status = status;
    }
    return status == CL_SUCCESS;
}

static bool device_query(DeviceList *list, void *id, cl_uint what, size_t size, void *value, size_t *needed)
{
    fault_record_call("clGetDeviceInfo");
    return list_check(list, clGetDeviceInfo(id, what, size, value, needed), "clGetDeviceInfo");
}

static bool platform_query(DeviceList *list, void *id, cl_uint what, size_t size, void *value, size_t *needed)
{
    fault_record_call("clGetPlatformInfo");
    return list_check(list, clGetPlatformInfo(id, what, size, value, needed), "clGetPlatformInfo");
}

typedef bool Query(DeviceList *list, void *id, cl_uint what, size_t size, void *value, size_t *needed);

static char *text_query(Query *query, DeviceList *list, void *id, cl_uint what)
{
    size_t size = 0;
    if (!query(list, id, what, 0, NULL, &size)) size = 0;
    char *text = memory_allocate_zeroed(size + 1, 1);
    if (size > 0 && !query(list, id, what, size, text, NULL)) text[0] = '\0';
    return text;
}

static char *device_text(DeviceList *list, cl_device_id id, cl_device_info what)
{
    return text_query(device_query, list, id, what);
}

// Queries a number. A failure sets `value` to 0.
#define device_number(list, id, what, value)                                                                 \
    do {                                                                                                     \
        if (!device_query((list), (id), (what), sizeof *(value), (value), NULL)) *(value) = 0;               \
    } while (0)

// Queries the first three of up to eight dimensions.
static void device_sides(DeviceList *list, cl_device_id id, size_t longest[3])
{
    size_t sides[8] = {0};
    if (!device_query(list, id, CL_DEVICE_MAX_WORK_ITEM_SIZES, sizeof sides, sides, NULL)) return;
    memcpy(longest, sides, 3 * sizeof *sides);
}

static bool device_flag(DeviceList *list, cl_device_id id, cl_device_info what)
{
    cl_bool flag = CL_FALSE;
    device_number(list, id, what, &flag);
    return flag != CL_FALSE;
}

// Returns whether `name` is a whole word of the blank-separated list.
static bool extensions_have(const char *extensions, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = extensions; (at = strstr(at, name)) != NULL; at += length) {
        bool begins = at == extensions || at[-1] == ' ';
        if (begins && (at[length] == ' ' || at[length] == '\0')) return true;
    }
    return false;
}

// The extensions' queries by their specifications.
enum {
    QUERY_NV_PCI_BUS = 0x4008,
    QUERY_NV_PCI_SLOT = 0x4009, // device and function
    QUERY_NV_PCI_DOMAIN = 0x400A,
    QUERY_AMD_TOPOLOGY = 0x4037,
    QUERY_AMD_BOARD_NAME = 0x4038,
    QUERY_UUID = 0x106A,
    QUERY_PCI_BUS_INFO = 0x410F,
    AMD_TOPOLOGY_PCIE = 1,
};

typedef struct {
    cl_uint domain, bus, device, function;
} PciPlace;

static bool pci_of_khr(DeviceList *list, cl_device_id id, PciPlace *place)
{
    return device_query(list, id, QUERY_PCI_BUS_INFO, sizeof *place, place, NULL);
}

static bool pci_of_nv(DeviceList *list, cl_device_id id, PciPlace *place)
{
    cl_uint slot = 0;
    if (!device_query(list, id, QUERY_NV_PCI_BUS, sizeof place->bus, &place->bus, NULL) ||
        !device_query(list, id, QUERY_NV_PCI_SLOT, sizeof slot, &slot, NULL))
        return false;
    device_number(list, id, QUERY_NV_PCI_DOMAIN, &place->domain);
    place->device = slot >> 3;
    place->function = slot & 7;
    return true;
}

static bool pci_of_amd(DeviceList *list, cl_device_id id, PciPlace *place)
{
    struct {
        cl_uint type;
        cl_uchar unused[17], bus, device, function;
    } topology = {0};
    if (!device_query(list, id, QUERY_AMD_TOPOLOGY, sizeof topology, &topology, NULL)) return false;
    *place = (PciPlace){0, topology.bus, topology.device, topology.function};
    return topology.type == AMD_TOPOLOGY_PCIE;
}

static const struct {
    const char *extension;
    bool (*query)(DeviceList *list, cl_device_id id, PciPlace *place);
} pci_queries[] = {
    {"cl_khr_pci_bus_info", pci_of_khr},
    {"cl_nv_device_attribute_query", pci_of_nv},
    {"cl_amd_device_attribute_query", pci_of_amd},
};

static void device_identify(DeviceList *list, Device *device)
{
    Text pci = {0}, uuid = {0};
    PciPlace place = {0};
    for (size_t i = 0; i < COUNT_OF(pci_queries) && pci.count == 0; i++)
        if (extensions_have(device->extensions, pci_queries[i].extension) &&
            pci_queries[i].query(list, device->id, &place))
            text_appendf(&pci, "%04x:%02x:%02x.%x", place.domain, place.bus, place.device, place.function);
    cl_uchar bytes[16];
    if (extensions_have(device->extensions, "cl_khr_device_uuid") &&
        device_query(list, device->id, QUERY_UUID, sizeof bytes, bytes, NULL))
        for (size_t i = 0; i < sizeof bytes; i++)
            text_appendf(&uuid, "%02x", bytes[i]);
    device->pci = pci.items ? pci.items : memory_copy_text("");
    device->uuid = uuid.items ? uuid.items : memory_copy_text("");
    device->board = extensions_have(device->extensions, "cl_amd_device_attribute_query")
                        ? device_text(list, device->id, QUERY_AMD_BOARD_NAME)
                        : memory_copy_text("");
}

// Limits a size in bytes to what 32 bits can address; 0 is unknown and becomes the limit.
static uint64_t addressable(uint64_t bytes)
{
    return bytes == 0 || bytes > UINT32_MAX ? UINT32_MAX : bytes;
}

static void texts_query(DeviceList *list, Device *device)
{
    cl_device_id id = device->id;
    device->platform_name = text_query(platform_query, list, device->platform, CL_PLATFORM_NAME);
    device->platform_version = text_query(platform_query, list, device->platform, CL_PLATFORM_VERSION);
    device->name = device_text(list, id, CL_DEVICE_NAME);
    device->vendor = device_text(list, id, CL_DEVICE_VENDOR);
    device->version = device_text(list, id, CL_DEVICE_VERSION);
    device->driver = device_text(list, id, CL_DRIVER_VERSION);
    device->extensions = device_text(list, id, CL_DEVICE_EXTENSIONS);
    OWNED char *profile = device_text(list, id, CL_DEVICE_PROFILE);
    device->embedded_profile = strcmp(profile, "EMBEDDED_PROFILE") == 0;
}

static void limits_query(DeviceList *list, Device *device)
{
    cl_device_id id = device->id;
    device_number(list, id, CL_DEVICE_MAX_COMPUTE_UNITS, &device->compute_units);
    if (device->compute_units == 0) device->compute_units = 1;
    device_number(list, id, CL_DEVICE_MAX_CLOCK_FREQUENCY, &device->clock_mhz);
    device_number(list, id, CL_DEVICE_MAX_WORK_GROUP_SIZE, &device->largest_work_group);
    device_sides(list, id, device->longest_group_sides);
    device_number(list, id, CL_DEVICE_GLOBAL_MEM_SIZE, &device->memory_bytes);
    device_number(list, id, CL_DEVICE_MAX_MEM_ALLOC_SIZE, &device->largest_buffer_bytes);
    device_number(list, id, CL_DEVICE_LOCAL_MEM_SIZE, &device->local_memory_bytes);
    device_number(list, id, CL_DEVICE_ADDRESS_BITS, &device->address_bits);
    if (device->address_bits == 32) {
        device->memory_bytes = addressable(device->memory_bytes);
        device->largest_buffer_bytes = addressable(device->largest_buffer_bytes);
    }
    size_t timer_nanoseconds = 0;
    device_number(list, id, CL_DEVICE_PROFILING_TIMER_RESOLUTION, &timer_nanoseconds);
    device->timer_resolution_seconds = 1e-9 * (double)timer_nanoseconds;
}

static void arithmetic_query(DeviceList *list, Device *device)
{
    cl_device_id id = device->id;
    cl_device_fp_config fp32 = 0, fp64 = 0;
    device_number(list, id, CL_DEVICE_SINGLE_FP_CONFIG, &fp32);
    device_number(list, id, CL_DEVICE_DOUBLE_FP_CONFIG, &fp64);
    device->denormals = (fp32 & CL_FP_DENORM) != 0;
    device->fma_in_hardware = (fp32 & CL_FP_FMA) != 0;
    device->correctly_rounded = (fp32 & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
    // a configuration of 0 is unknown
    device->rounds_toward_zero = fp32 != 0 && !(fp32 & CL_FP_ROUND_TO_NEAREST);
    device->lacks_infinity = fp32 != 0 && !(fp32 & CL_FP_INF_NAN);
    device->fp64 = fp64 != 0 || extensions_have(device->extensions, "cl_khr_fp64");
    // kernels in double use 64-bit integers, which are an extension of that profile
    if (device->embedded_profile && !extensions_have(device->extensions, "cles_khr_int64"))
        device->fp64 = false;

    device_number(list, id, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, &device->native_float_width);
    if (device->native_float_width == 0) device->native_float_width = 1;
    device_number(list, id, CL_DEVICE_NATIVE_VECTOR_WIDTH_DOUBLE, &device->native_double_width);
    if (!device->fp64) device->native_double_width = 0;
    if (device->fp64 && device->native_double_width == 0) device->native_double_width = 1;
}

static void device_list_add(DeviceList *list, cl_platform_id platform, cl_device_id id,
                            WarningReceiver *warnings)
{
    Device device = {.platform = platform, .id = id, .index = (unsigned)list->count, .warnings = warnings};
    texts_query(list, &device);
    device_identify(list, &device);
    device_number(list, id, CL_DEVICE_TYPE, &device.type);
    device.compiler = device_flag(list, id, CL_DEVICE_COMPILER_AVAILABLE);
    device.available = device_flag(list, id, CL_DEVICE_AVAILABLE);
    device.little_endian = device_flag(list, id, CL_DEVICE_ENDIAN_LITTLE);
    limits_query(list, &device);
    arithmetic_query(list, &device);
    device.passports = device_passports_open();
    for (size_t i = 0; i < list->count; i++) {
        const Device *other = &list->items[i];
        if (other->platform == platform && strcmp(other->name, device.name) == 0) device.same_name_index++;
    }
    array_push(*list, device);
}

// Returns the platform's devices, which the caller frees.
static cl_device_id *platform_devices(DeviceList *list, cl_platform_id platform, cl_uint *count)
{
    *count = 0;
    fault_record_call("clGetDeviceIDs");
    if (!list_check(list, clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, NULL, count), "clGetDeviceIDs"))
        *count = 0;
    cl_device_id *ids = memory_allocate_zeroed(*count, sizeof *ids);
    if (*count > 0 &&
        !list_check(list, clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, *count, ids, NULL), "clGetDeviceIDs"))
        *count = 0;
    return ids;
}

void device_list_open(DeviceList *list, WarningReceiver *warnings)
{
    // PoCL reads this when it compiles a kernel for its first launch. A kernel specialized for one work-group
    // size is not faster here than the generic one, which its binaries need in any case.
    setenv("POCL_WORK_GROUP_SPECIALIZATION", "0", false);
    *list = (DeviceList){0};
    cl_uint platform_count = 0;
    fault_record_call("clGetPlatformIDs");
    if (!list_check(list, clGetPlatformIDs(0, NULL, &platform_count), "clGetPlatformIDs") ||
        platform_count == 0)
        return;
    OWNED cl_platform_id *platforms = memory_allocate_zeroed(platform_count, sizeof *platforms);
    if (list_check(list, clGetPlatformIDs(platform_count, platforms, NULL), "clGetPlatformIDs"))
        list->platform_count = platform_count;

    for (cl_uint i = 0; i < list->platform_count; i++) {
        cl_uint device_count;
        OWNED cl_device_id *ids = platform_devices(list, platforms[i], &device_count);
        if (device_count == 0) list->empty_platform_count++;
        for (cl_uint j = 0; j < device_count; j++)
            device_list_add(list, platforms[i], ids[j], warnings);
    }
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
        device_passports_close(device->passports);
        free(device->board);
        free(device->pci);
        free(device->uuid);
    }
    free(list->items);
    *list = (DeviceList){0};
}

char *device_list_failure_text(const DeviceList *list)
{
    Text failure = {0};
    if (list->failed_call)
        text_appendf(&failure, "%s: %s (%d)", list->failed_call, cl_status_name(list->failed_status),
                     list->failed_status);
    return failure.items;
}

bool device_usable(const Device *device, const char **why)
{
    const char *missing = !device->available           ? "not available"
                          : !device->compiler          ? "no compiler"
                          : !device->little_endian     ? "big-endian"
                          : device->rounds_toward_zero ? "float arithmetic rounds toward zero only"
                          : device->lacks_infinity     ? "float arithmetic has no infinity and no NaN"
                                                       : NULL;
    if (why) *why = missing;
    return missing == NULL;
}

unsigned device_lanes(const Device *device, bool is_double, unsigned requested)
{
    const bool is_cpu = device->type & CL_DEVICE_TYPE_CPU;
    const unsigned width = is_double ? device->native_double_width : device->native_float_width;
    const bool is_limit = requested == 0 || (is_cpu && width > 1);
    unsigned lanes = requested ? requested : is_cpu ? 16 : 1;
    while (is_limit && lanes > 1 && lanes > width)
        lanes = lanes == 4 ? 1 : lanes / 2;
    return lanes;
}

const char *device_fp64_hint(const Device *device)
{
    if (strcasecmp(device->platform_name, "rusticl") != 0) return "";
    return " (newer versions of rusticl have it if the environment variable RUSTICL_FEATURES is fp64)";
}

const char *device_type_name(cl_device_type type)
{
    if (type & CL_DEVICE_TYPE_GPU) return "gpu";
    if (type & CL_DEVICE_TYPE_CPU) return "cpu";
    if (type & CL_DEVICE_TYPE_ACCELERATOR) return "accelerator";
    return "other";
}
