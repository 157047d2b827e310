// Lists the OpenCL devices of all platforms, and chooses among them (device_choose.c).
#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include "host/base/message.h"
#include <CL/cl.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Receives the warnings about files of the kernel cache and of kernel folders, which affect no result.
typedef struct {
    // Called on whichever thread builds programs, possibly on several at once. May take the messages with
    // message_list_move.
    void (*deliver)(void *context, MessageList *warnings);
    void *context;
    atomic_bool cache_is_reported; // later warnings about the cache are dropped
} WarningReceiver;

typedef struct {
    cl_platform_id platform;
    cl_device_id id;
    unsigned index;           // from 0 over all platforms, as in `glint devices`
    unsigned same_name_index; // 0 for the first device of this platform and name, 1 for the next, and so on
    cl_device_type type;
    char *name, *vendor, *version, *driver, *platform_name, *platform_version;
    char *extensions;
    // These identify devices of one name if the driver has the extensions. Otherwise they are empty.
    char *board; // such as "AMD Radeon RX 6800"
    char *pci;   // domain, bus, device and function, such as "0000:65:00.0"
    char *uuid;  // 32 hexadecimal digits
    unsigned compute_units, clock_mhz, address_bits;
    unsigned native_float_width, native_double_width; // at least 1, but 0 for double without fp64
    // These are 0 if unknown, and below 4 GiB if addresses have 32 bits.
    uint64_t memory_bytes, largest_buffer_bytes, local_memory_bytes;
    size_t largest_work_group, longest_group_sides[3];
    double timer_resolution_seconds;
    bool fp64, denormals, fma_in_hardware;
    bool correctly_rounded; // supports -cl-fp32-correctly-rounded-divide-sqrt
    bool embedded_profile;
    // Only devices of the embedded profile may have these limits.
    bool rounds_toward_zero, lacks_infinity;
    bool compiler, available, little_endian;
    struct DevicePassports *passports; // host/opencl/passport.h
    const char *build_options; // of --build-options, for each program; outlive the device; may be NULL
    size_t work_group[2];      // of --work-group, for kernels that trace rays; 0 if glint chooses
    // The folder that receives the text and the build log of each kernel that is built. It outlives the
    // device and may be NULL.
    const char *kernel_folder;
    const char *capture_folder; // receives launches (host/opencl/capture.h); outlives the device; may be NULL
    WarningReceiver *warnings;  // outlives the device; may be NULL
} Device;

typedef struct {
    Device *items;
    size_t count, capacity;
    unsigned platform_count, empty_platform_count; // an empty platform has no device, which is not an error
    const char *failed_call;                       // the first call that failed, or NULL
    cl_int failed_status;
} DeviceList;

// Queries all platforms. The list is empty if there are none, which is not a failure. Sets PoCL's
// environment variable POCL_WORK_GROUP_SPECIALIZATION unless it is set. The devices deliver their warnings to
// `warnings`, which outlives the list, or drop them if it is NULL.
void device_list_open(DeviceList *list, WarningReceiver *warnings);
void device_list_close(DeviceList *list);
// Returns "CALL: STATUS (CODE)", or NULL if no call failed. The caller frees it.
char *device_list_failure_text(const DeviceList *list);

// Returns the device that `selector` names. The selector is an index, a part of the device's, board's or
// platform's name (in any case, but a number only as a whole), the device's place on the PCI bus (with or
// without the domain), its UUID, "cpu" or "gpu". NULL selects a GPU if there is one, else a CPU, else any
// device. Considers only usable devices, and chooses the first of identical ones. Returns NULL with an error
// message if none matches. The message lists the devices, or tells how to install PoCL if there are none.
const Device *device_choose(const DeviceList *list, const char *selector, MessageList *messages);

// Finds the devices of `selector`, which is "all" or a list of selectors of single devices, separated by
// commas. Returns their number, or 0 with an error message if none matches one of the selectors or a device
// is listed twice. The caller frees *devices.
size_t devices_choose(const DeviceList *list, const char *selector, const Device ***devices,
                      MessageList *messages);

// Returns the device that computes in double for a device that cannot. It is the one that `selector` names,
// or for NULL the default among those with 64-bit floating point. Returns NULL if none qualifies, with an
// error message unless `selector` is NULL.
const Device *device_choose_reference(const DeviceList *list, const char *selector, MessageList *messages);

// Returns the selector that the user gave: `option`, else the environment variable GLINT_DEVICE if it is not
// empty, else NULL.
const char *device_selector(const char *option);

// Returns whether the device can build and run kernels and has the arithmetic that they need. Otherwise sets
// *why to the missing feature unless `why` is NULL.
bool device_usable(const Device *device, const char **why);

// Returns the number of rays per work-item, 1, 4, 8 or 16. If 0 are requested, it is the native vector width
// on a CPU, of double if `is_double` is set, else of float, rounded down, and 1 on other devices. Otherwise
// it is the requested number, limited to the width of a CPU's vectors if it has them. PoCL 4 and newer inline
// every function whose vectors are wider. Kernels then took minutes to compile, and in one version had wrong
// hits. No scene was faster with two vectors per value.
unsigned device_lanes(const Device *device, bool is_double, unsigned requested);

// Returns a hint on enabling 64-bit floating point, to append to a message that the device lacks it, or "".
const char *device_fp64_hint(const Device *device);

const char *device_type_name(cl_device_type type); // "cpu", "gpu", "accelerator", "other"

const char *cl_status_name(cl_int status); // "CL_SUCCESS", …
// Returns the meaning of an OpenCL function's status in words, or NULL if only its name is known.
const char *cl_status_meaning(const char *function, cl_int status);
