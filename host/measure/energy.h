// Reads the energy that a device has used. NVIDIA's boards report it by NVML, the driver's library, and CPUs
// by the counters of RAPL that Linux shows below /sys/class/powercap, on many systems only to root.
#pragma once

#include "host/opencl/device.h"

typedef struct EnergyMeter EnergyMeter;

// Opens the meter of a device. Returns NULL if there is none and sets *why_not to the reason, a constant.
EnergyMeter *energy_open(const Device *device, const char **why_not);
void energy_close(EnergyMeter *meter); // accepts NULL
// Returns the source of the figures: "NVML" for a board, "RAPL" for all processors without their memory.
const char *energy_source(const EnergyMeter *meter);
// Returns the joules since the meter was opened. A counter that wraps must be read before it wraps again,
// which takes minutes. Returns NAN once a counter could not be read or was set back.
double energy_joules(EnergyMeter *meter);
