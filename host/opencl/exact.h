// Exact results of one operation in float or double, whatever the host's own evaluation method. Every value
// is a double; `is_double` is the format to which it is rounded.
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    ROUNDING_NEAREST, // ties to even
    ROUNDING_TOWARD_ZERO,
    ROUNDING_UP,
    ROUNDING_DOWN,
    ROUNDING_OTHER
} RoundingMode;

// A value as nearest + rest without error; nearest is rounded to nearest.
typedef struct {
    double nearest, rest;
} Exact;

// In float the exponents differ by 28 at most; in neither format anything overflows or is subnormal.
Exact exact_sum(bool is_double, double a, double b);
Exact exact_product(bool is_double, double a, double b);
double exact_fma(bool is_double, double a, double b, double c); // rounded once, to nearest
// Returns the result of rounding in that mode, which is not ROUNDING_OTHER.
double exact_rounded(bool is_double, Exact exact, RoundingMode rounding);

// Returns the error in ulp of the result: 0.5 if it is correctly rounded, otherwise more. Operands are
// positive and normal. Returns infinity for a result that is not.
double quotient_error(bool is_double, double a, double b, double quotient);
double root_error(bool is_double, double a, double root);

uint64_t real_bits(bool is_double, double value);
double real_value(bool is_double, uint64_t bits);
