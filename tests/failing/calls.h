// What calls leave behind, and the disk that they find, in C tests whose calls fail by faults.h.
#pragma once

#include <stdatomic.h>
#include <stdbool.h>

extern bool disk_is_full;
extern atomic_long live_count; // OpenCL objects created and mapped, less those released
