// Computes exact results of one operation in float or double, regardless of the host's evaluation method.
// Every value is a double, which is rounded to double if `is_double` is set and to float otherwise.
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

// An exact value, the sum of its nearest real and the rest.
typedef struct {
    double nearest, rest;
} Exact;

// Return the exact sum and product. The exponents of floats may differ by 28 at most. No value may overflow
// or be subnormal.
Exact exact_sum(bool is_double, double a, double b);
Exact exact_product(bool is_double, double a, double b);
double exact_fma(bool is_double, double a, double b, double c); // rounded once, to nearest
// Returns the value rounded in the given mode, which must not be ROUNDING_OTHER.
double exact_rounded(bool is_double, Exact exact, RoundingMode rounding);

// Return the error of a result in ulp, which is 0.5 if it is correctly rounded and otherwise more. Operands
// must be positive and normal. The error is infinite if the result is not positive and finite.
double quotient_error(bool is_double, double a, double b, double quotient);
double root_error(bool is_double, double a, double root);

uint64_t real_bits(bool is_double, double value);
double real_value(bool is_double, uint64_t bits);
