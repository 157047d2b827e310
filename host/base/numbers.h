// Converts arrays of numbers between precisions.
#pragma once

#include <stdbool.h>
#include <stddef.h>

void numbers_narrow(float *target, const double *values, size_t count);
// Copies `values` to doubles. They are doubles if `is_double` is set, else floats.
void numbers_widen(double *target, const void *values, size_t count, bool is_double);
