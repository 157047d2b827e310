// Lists the probes that passport.cl computes, by the number that the host passes. Each probe has two results
// per lane.
#ifndef PROBES_H
#define PROBES_H

enum {
    PROBE_SUM_PRODUCT, // a + b; a b
    PROBE_CONTRACTION, // a b + c; -c - a b
    PROBE_TWO_SUM,     // the sum; its rounding error
    PROBE_TWO_PRODUCT, // the product; its rounding error
    PROBE_FMA,         // real_fma(a, b, c), twice
    PROBE_DIVIDE,      // a / b as the device rounds it; as kernels use it
    PROBE_SQRT,        // the root of a as the device rounds it; as kernels use it
    PROBE_COMPARE,     // COMPARED_…; real_max(a, b)
    PROBE_INTEGERS,    // the integer a to real; b to an integer
    PROBE_FLOATS,      // in double: a to float; the float b to double
    // PROBE_DIVIDE and PROBE_SQRT for successive mantissas (MANTISSA_STRIDE), with a as the other operand.
    PROBE_SWEEP_RECIPROCAL, // a / mantissa
    PROBE_SWEEP_QUOTIENT,   // mantissa / a
    PROBE_SWEEP_SQRT,       // mantissa, in the binade that starts at a
    // Chains of operations that take time.
    PROBE_TIME_FMA,
    PROBE_TIME_SEPARATE // a product, then a sum
};

enum {
    COMPARED_LESS = 1,
    COMPARED_EQUAL = 2,
    COMPARED_GREATER = 4,
    COMPARED_UNEQUAL = 8,
    COMPARED_AT_MOST = 16
};

// The multiples of each stride, modulo the number of mantissas, visit every mantissa once, because the stride
// is odd. The first ones are spread evenly, because the stride is that number divided by the golden ratio.
#define MANTISSA_STRIDE_FLOAT  5184445
#define MANTISSA_STRIDE_DOUBLE 2783377641436327

#endif
