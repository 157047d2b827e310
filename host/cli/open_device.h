// Chooses, opens and closes devices for commands.
#pragma once

#include "host/cli/options.h"
#include "host/opencl/compute.h"

typedef struct {
    DeviceList devices;
    Compute compute;
} OpenDevice;

extern WarningReceiver device_warnings; // prints them to stderr

// Chooses a device. Returns NULL with a message if there is none. The list must be closed either way.
const Device *device_find(DeviceList *devices, const char *selector);
// Chooses one of the devices that `selector` lists or, if it is NULL, of the devices of the default's type.
// The choice is the device at index `number` modulo their count, so that the processes of one machine use
// different devices. Returns NULL with a message if there is none.
const Device *device_choose_numbered(const DeviceList *devices, const char *selector, size_t number,
                                     MessageList *messages);
// Applies the options that concern drivers, such as --work-group and --build-options.
void devices_apply_options(DeviceList *devices, const CommonOptions *common);
// Returns whether the device allows its work-group, and prints an error if not.
bool work_group_is_allowed(const Device *device);
// Chooses a device, applies the options to it and opens it. Returns false with a message, and nothing to
// close, if no device matches or the device does not allow the work-group. device_close reports a device that
// fails, now or later.
bool device_open(OpenDevice *open, const CommonOptions *common);
// Opens the device that works in double for the Compute, if the user chose one or if the Compute's device has
// no 64-bit floating point, and prints its name. If there is none, returns false with a message if the user
// chose one, otherwise true, and compute_in_double then returns a Compute that has no 64-bit floating point.
bool reference_open(Compute *compute, const DeviceList *devices, const char *selector);
// Closes a Compute at the end of a command. Returns EXIT_MACHINE with a message if the device failed,
// otherwise `status`. Unless the command failed or was interrupted, the context lives until the process ends,
// since PoCL needs 80 ms to free its compiler.
int compute_end(Compute *compute, int status);
// Closes the device at the end of a command, as compute_end does.
int device_close(OpenDevice *open, int status);
