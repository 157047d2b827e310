// Arrays of numbers converted between precisions.
#pragma once

#include <stdbool.h>
#include <stddef.h>

void numbers_narrow(float *target, const double *values, size_t count);
// `values` are doubles where `is_double`, else floats.
void numbers_widen(double *target, const void *values, size_t count, bool is_double);
