// Decimal numbers as scene files write them, independent of the locale, and the ranges they must keep to.
#pragma once

#include "host/import/report.h"
#include <stddef.h>

// Larger magnitudes are refused and smaller ones read as 0, so that no later product of a few numbers
// overflows a double or vanishes in it.
#define NUMBER_LARGEST  1e30
#define NUMBER_SMALLEST 1e-30

typedef enum { NUMBER_READ, NUMBER_MALFORMED, NUMBER_TOO_LARGE } NumberStatus;

// Reads exactly `length` bytes: sign, digits with an optional point, exponent; nothing else (no hex, inf,
// nan). `value` is set on NUMBER_READ only.
NumberStatus number_read(const char *text, size_t length, double *value);

typedef struct {
    double low, high;
    bool open;        // the limits themselves are outside
    const char *must; // what a number outside is told
} Range;

extern const Range range_positive, range_not_negative, range_unit, range_byte, range_field_of_view,
    range_pixels;

// Reads the number called `name`, or reports what is wrong with it. `range` NULL: any.
bool number_read_field(Report *report, size_t offset, const char *name, const char *text, size_t length,
                       const Range *range, double *value);
