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

static bool device_query(DeviceList *list, cl_device_id id, cl_device_info what, size_t size, void *value,
                         size_t *needed)
{
    fault_record_call("clGetDeviceInfo");
    return list_check(list, clGetDeviceInfo(id, what, size, value, needed), "clGetDeviceInfo");
}

static bool platform_query(DeviceList *list, cl_platform_id platform, cl_platform_info what, size_t size,
                           void *value, size_t *needed)
{
    fault_record_call("clGetPlatformInfo");
    return list_check(list, clGetPlatformInfo(platform, what, size, value, needed), "clGetPlatformInfo");
}

static char *platform_text(DeviceList *list, cl_platform_id platform, cl_platform_info what)
{
    size_t size = 0;
    if (!platform_query(list, platform, what, 0, NULL, &size)) size = 0;
    char *text = memory_allocate_zeroed(size + 1, 1);
    if (size > 0 && !platform_query(list, platform, what, size, text, NULL)) text[0] = '\0';
    return text;
}

static char *device_text(DeviceList *list, cl_device_id id, cl_device_info what)
{
    size_t size = 0;
    if (!device_query(list, id, what, 0, NULL, &size)) size = 0;
    char *text = memory_allocate_zeroed(size + 1, 1);
    if (size > 0 && !device_query(list, id, what, size, text, NULL)) text[0] = '\0';
    return text;
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

static void device_describe(DeviceList *list, Device *device)
{
    cl_device_id id = device->id;
    device->platform_name = platform_text(list, device->platform, CL_PLATFORM_NAME);
    device->platform_version = platform_text(list, device->platform, CL_PLATFORM_VERSION);
    device->name = device_text(list, id, CL_DEVICE_NAME);
    device->vendor = device_text(list, id, CL_DEVICE_VENDOR);
    device->version = device_text(list, id, CL_DEVICE_VERSION);
    device->driver = device_text(list, id, CL_DRIVER_VERSION);
    device->extensions = device_text(list, id, CL_DEVICE_EXTENSIONS);
    device_identify(list, device);

    device_number(list, id, CL_DEVICE_TYPE, &device->type);
    device_number(list, id, CL_DEVICE_MAX_COMPUTE_UNITS, &device->compute_units);
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

    cl_device_fp_config fp32 = 0, fp64 = 0;
    device_number(list, id, CL_DEVICE_SINGLE_FP_CONFIG, &fp32);
    device_number(list, id, CL_DEVICE_DOUBLE_FP_CONFIG, &fp64);
    device->denormals = (fp32 & CL_FP_DENORM) != 0;
    device->fma_in_hardware = (fp32 & CL_FP_FMA) != 0;
    device->correctly_rounded = (fp32 & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
    char *profile = device_text(list, id, CL_DEVICE_PROFILE);
    device->embedded_profile = strcmp(profile, "EMBEDDED_PROFILE") == 0;
    free(profile);
    // a configuration of 0 is unknown
    device->rounds_toward_zero = fp32 != 0 && !(fp32 & CL_FP_ROUND_TO_NEAREST);
    device->lacks_infinity = fp32 != 0 && !(fp32 & CL_FP_INF_NAN);
    device->fp64 = fp64 != 0 || extensions_have(device->extensions, "cl_khr_fp64");
    // kernels in double use 64-bit integers, an extension there
    if (device->embedded_profile && !extensions_have(device->extensions, "cles_khr_int64"))
        device->fp64 = false;

    device_number(list, id, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, &device->native_float_width);
    if (device->native_float_width == 0) device->native_float_width = 1;
    device_number(list, id, CL_DEVICE_NATIVE_VECTOR_WIDTH_DOUBLE, &device->native_double_width);
    if (!device->fp64) device->native_double_width = 0;
    if (device->fp64 && device->native_double_width == 0) device->native_double_width = 1;

    device->compiler = device_flag(list, id, CL_DEVICE_COMPILER_AVAILABLE);
    device->available = device_flag(list, id, CL_DEVICE_AVAILABLE);
    device->little_endian = device_flag(list, id, CL_DEVICE_ENDIAN_LITTLE);
}

static void device_list_add(DeviceList *list, cl_platform_id platform, cl_device_id id)
{
    Device device = {.platform = platform, .id = id, .index = (unsigned)list->count};
    device_describe(list, &device);
    device.passports = device_passports_open();
    for (size_t i = 0; i < list->count; i++) {
        const Device *other = &list->items[i];
        if (other->platform == platform && strcmp(other->name, device.name) == 0) device.same_name_index++;
    }
    array_push(*list, device);
}

// Sets a variable that PoCL reads when it compiles a kernel for its first launch. A kernel specialized for
// one work-group size is not faster here than the generic one, which its binaries need in any case, so this
// avoids compiling both.
static void pocl_compile_once(void)
{
    setenv("POCL_WORK_GROUP_SPECIALIZATION", "0", false);
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

void device_list_open(DeviceList *list)
{
    pocl_compile_once();
    *list = (DeviceList){0};
    cl_uint platform_count = 0;
    fault_record_call("clGetPlatformIDs");
    if (!list_check(list, clGetPlatformIDs(0, NULL, &platform_count), "clGetPlatformIDs") ||
        platform_count == 0)
        return;
    cl_platform_id *platforms = memory_allocate_zeroed(platform_count, sizeof *platforms);
    if (list_check(list, clGetPlatformIDs(platform_count, platforms, NULL), "clGetPlatformIDs"))
        list->platform_count = platform_count;

    for (cl_uint i = 0; i < list->platform_count; i++) {
        cl_uint device_count;
        cl_device_id *ids = platform_devices(list, platforms[i], &device_count);
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
        device_passports_close(device->passports);
        free(device->board);
        free(device->pci);
        free(device->uuid);
    }
    free(list->items);
    *list = (DeviceList){0};
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

const char *device_selector(const char *option)
{
    if (option) return option;
    const char *selector = getenv("GLINT_DEVICE");
    return selector && selector[0] != '\0' ? selector : NULL;
}

// Ranks GPUs before CPUs before other devices.
static int device_rank(const Device *device)
{
    return device->type & CL_DEVICE_TYPE_GPU ? 2 : device->type & CL_DEVICE_TYPE_CPU ? 1 : 0;
}

static bool is_number(const char *selector)
{
    return selector[0] != '\0' && selector[strspn(selector, "0123456789")] == '\0';
}

// Returns whether the name contains the selector. A number must match a whole number there, so 51 does not
// match "haswell-avx512".
static bool name_matches(const char *name, const char *selector)
{
    if (!is_number(selector)) return strcasestr(name, selector) != NULL;
    for (const char *at = name + strcspn(name, "0123456789"); *at; at += strcspn(at, "0123456789")) {
        size_t length = strspn(at, "0123456789");
        if (length == strlen(selector) && strncmp(at, selector, length) == 0) return true;
        at += length;
    }
    return false;
}

// Returns whether the selector is the PCI place, with or without its domain.
static bool pci_matches(const char *pci, const char *selector)
{
    const char *bus = strchr(pci, ':');
    return bus && (strcasecmp(pci, selector) == 0 || strcasecmp(bus + 1, selector) == 0);
}

static bool device_matches(const Device *device, const char *selector)
{
    if (!selector) return true;
    if (strcasecmp(selector, "gpu") == 0) return (device->type & CL_DEVICE_TYPE_GPU) != 0;
    if (strcasecmp(selector, "cpu") == 0) return (device->type & CL_DEVICE_TYPE_CPU) != 0;
    return name_matches(device->name, selector) || name_matches(device->platform_name, selector) ||
           name_matches(device->board, selector) || pci_matches(device->pci, selector) ||
           (selector[0] != '\0' && strcasecmp(device->uuid, selector) == 0);
}

// Returns whether the selector is a device's index. A number such as "3090" can be part of a name instead.
static bool selector_is_index(const DeviceList *list, const char *selector, size_t *index)
{
    if (!selector || !is_number(selector)) return false;
    *index = strtoul(selector, NULL, 10);
    return *index < list->count;
}

char *device_list_failure_text(const DeviceList *list)
{
    Text failure = {0};
    if (list->failed_call)
        text_appendf(&failure, "%s: %s (%d)", list->failed_call, cl_status_name(list->failed_status),
                     list->failed_status);
    return failure.items;
}

static void report_no_match(const DeviceList *list, const char *selector, MessageList *messages)
{
    char *failure = device_list_failure_text(list);
    Text text = {0};
    if (list->count > 0) {
        text_appendf(&text, "no usable device");
        if (selector) text_appendf(&text, " matches \"%s\"", selector);
    } else {
        text_appendf(&text, "no OpenCL device on %u platform%s", list->platform_count,
                     text_plural(list->platform_count));
    }
    if (failure) text_appendf(&text, " (%s)", failure);
    text_appendf(&text, "%s", fault_limits());
    for (size_t i = 0; i < list->count; i++) {
        const Device *device = &list->items[i];
        const char *why;
        text_appendf(&text, "%s%u (%s, %s", i ? "; " : "; there are: ", device->index, device->name,
                     device_type_name(device->type));
        if (!device_usable(device, &why)) text_appendf(&text, ", unusable: %s", why);
        text_append(&text, ")", 1);
    }
    bool is_limited = fault_limits()[0] != '\0';
    if (list->count == 0 && is_limited)
        text_appendf(&text, "; a driver may not load within that");
    else if (list->count == 0)
        text_appendf(&text, "; PoCL runs on any CPU: `apt install pocl-opencl-icd` on Debian and Ubuntu");
    if (list->count == 0 && list->platform_count > 0 && !is_limited)
        text_appendf(&text,
                     "; if it is installed, its cache needs a writable folder: set HOME, XDG_CACHE_HOME "
                     "or POCL_CACHE_DIR");
    message_error(messages, "%s", text_c(&text));
    text_free(&text);
    free(failure);
}

const Device *device_choose(const DeviceList *list, const char *selector, MessageList *messages)
{
    const Device *best = NULL;
    size_t index = 0;
    bool is_index = selector_is_index(list, selector, &index);
    for (size_t i = 0; i < list->count; i++) {
        const Device *device = &list->items[i];
        if (is_index ? i != index : !device_matches(device, selector)) continue;
        if (!device_usable(device, NULL)) continue;
        if (!best || device_rank(device) > device_rank(best)) best = device;
    }
    if (!best) report_no_match(list, selector, messages);
    return best;
}

const Device *device_choose_reference(const DeviceList *list, const char *selector, MessageList *messages)
{
    const Device *best = selector ? device_choose(list, selector, messages) : NULL;
    for (size_t i = 0; i < list->count && !selector; i++) {
        const Device *other = &list->items[i];
        if (!device_usable(other, NULL) || !other->fp64) continue;
        if (!best || device_rank(other) > device_rank(best)) best = other;
    }
    if (!best || best->fp64) return best;
    message_error(messages, "the reference device \"%s\" has no 64-bit floating point", best->name);
    return NULL;
}

static bool any_matches(const DeviceList *list, const char *selector)
{
    for (size_t i = 0; i < list->count; i++)
        if (device_matches(&list->items[i], selector)) return true;
    return false;
}

static size_t devices_choose_all(const DeviceList *list, const Device **chosen, MessageList *messages)
{
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++)
        if (device_usable(&list->items[i], NULL)) chosen[count++] = &list->items[i];
    if (count == 0) report_no_match(list, NULL, messages);
    return count;
}

static bool is_listed(const Device *const *chosen, size_t count, const Device *device)
{
    for (size_t i = 0; i < count; i++)
        if (chosen[i] == device) return true;
    return false;
}

size_t devices_choose(const DeviceList *list, const char *selector, const Device ***devices,
                      MessageList *messages)
{
    const Device **chosen = *devices = memory_allocate_zeroed(list->count + 1, sizeof *chosen);
    if (selector && strcasecmp(selector, "all") == 0) return devices_choose_all(list, chosen, messages);
    // a name may contain a comma, such as llvmpipe's
    bool is_single = !selector || !strchr(selector, ',') || any_matches(list, selector);
    size_t count = 0;
    for (const char *at = selector, *end;; at = end + 1) {
        end = is_single ? NULL : strchr(at, ',');
        char *part = at ? memory_copy_part(at, end ? (size_t)(end - at) : strlen(at)) : NULL;
        const Device *device = NULL;
        if (part && part[0] == '\0')
            report_no_match(list, part, messages);
        else
            device = device_choose(list, part, messages);
        free(part);
        if (!device) return 0;
        if (is_listed(chosen, count, device)) {
            message_error(messages, "device %u (%s) is listed twice", device->index, device->name);
            return 0;
        }
        chosen[count++] = device;
        if (!end) return count;
    }
}
