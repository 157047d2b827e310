// Reports the known passports of a device.
#pragma once

#include "host/base/json.h"
#include "host/opencl/passport.h"
#include <stdio.h>

void passports_json(Json *json, const Device *device);          // "passports"
void passports_refusals_json(Json *json, const Device *device); // "refused"
void passports_print(const Device *device);                     // a table, or nothing without a passport
void passports_remark(const Device *device, FILE *stream);      // a line for each property that is not sound
