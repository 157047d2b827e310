// Reports the known passports of a device.
#pragma once

#include "host/base/json.h"
#include "host/opencl/passport.h"
#include <stdio.h>

void passports_json(Json *json, const Device *device);          // adds the array "passports"
void passports_refusals_json(Json *json, const Device *device); // adds the array "refused"
// Prints every property of the device's arithmetic, or nothing if no passport is known.
void passports_print(const Device *device);
// Prints the properties that are not sound.
void passports_remark(const Device *device, FILE *stream);
// Prints the device, its platform and driver, and its properties that are not sound.
void device_heading_print(const Device *device, FILE *stream);
