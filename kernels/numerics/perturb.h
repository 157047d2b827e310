// Contains the operations whose results differ between devices, and simulates their errors. Division and
// square root are called only here. PERTURB adds to each result the error that the OpenCL C specification
// permits (3.0, Relative Error as ULPs), times PERTURB_SCALE.
//
// The error is a hash of PERTURB_SEED, the operation and its operands alone, so that equal operations err
// equally in all work-items. Only the mantissas of the operands of division and root count, since devices
// start from tables of mantissas. Signs and powers of two change only those of the result.
#ifndef PERTURB_H
#define PERTURB_H

#include "numerics/pair.h"

#if IS_DOUBLE
#define MANTISSA        ((integer)(0xfffffffffffffL))
#define HALF_WORD       32
#define HASH_MULTIPLIER ((unsigned_integer)(0x9e3779b97f4a7c15UL))
#else
#define MANTISSA        ((integer)(0x7fffff))
#define HALF_WORD       16
#define HASH_MULTIPLIER ((unsigned_integer)(0x9e3779b1U))
#endif

enum { PERTURBED_DIVIDE, PERTURBED_SQRT, PERTURBED_POWER, PERTURBED_COUNT };

// The largest simulated errors in ulp. The device's own half ulp is added, so that roots and powers exceed
// the specification's 3 and 16 ulp by as much.
enum { DIVIDE_ERROR = 2, SQRT_ERROR = 3, POWER_ERROR = 16 };

static inline unsigned_integer perturb_hash(uint operation, integer a, integer b)
{
    unsigned_integer hash = (unsigned_integer)(PERTURB_SEED * PERTURBED_COUNT + operation) * HASH_MULTIPLIER;
    hash = (hash ^ (hash >> HALF_WORD) ^ unsigned_from_integer(a)) * HASH_MULTIPLIER;
    hash = (hash ^ (hash >> HALF_WORD) ^ unsigned_from_integer(b)) * HASH_MULTIPLIER;
    return (hash ^ (hash >> HALF_WORD)) * HASH_MULTIPLIER;
}

// Moves the value by a hashed number of ulp, up to `largest`. Leaves 0 and values near underflow or overflow
// unchanged.
static inline real perturb(real value, unsigned_integer hash, uint largest)
{
    largest *= PERTURB_SCALE;
    const unsigned_integer steps = mul_hi(hash, (unsigned_integer)(2 * largest + 1)); // 0 to 2 largest
    mask ordinary = (fabs(value) > SMALLEST_RATIO) & (fabs(value) < 1 / SMALLEST_RATIO);
    const integer moved = bits_from_real(value) + integer_from_unsigned(steps) - integer_of(largest);
    return lanes_select(ordinary, real_from_bits(moved), value);
}

static inline real device_divide(real a, real b)
{
    real quotient = a / b;
    if (!PERTURB || IS_DOUBLE) return quotient;
    unsigned_integer hash =
        perturb_hash(PERTURBED_DIVIDE, bits_from_real(a) & MANTISSA, bits_from_real(b) & MANTISSA);
    return perturb(quotient, hash, DIVIDE_ERROR);
}

static inline real device_sqrt(real a)
{
    real root = sqrt(a);
    if (!PERTURB || IS_DOUBLE) return root;
    // mantissa and lowest bit of the exponent
    integer operand = bits_from_real(a) & (MANTISSA + MANTISSA + (integer)(1));
    return perturb(root, perturb_hash(PERTURBED_SQRT, operand, (integer)(0)), SQRT_ERROR);
}

// Divides numbers that are the same in all lanes. At `strict` the quotient is not repaired, so it may only
// enter bounds.
static inline scalar uniform_divide(scalar a, scalar b)
{
    if (!PERTURB) return a / b;
    RealLanes quotient = {device_divide((real)(a), (real)(b))};
    return quotient.each[0];
}

// Adds to (1 - complement)^exponent, which kernels compute themselves, the error of a device's power
// function. Not called at `strict`, whose bits are the same on every device.
static inline real perturbed_power(real power, real complement, real exponent)
{
    if (!PERTURB || IS_STRICT) return power;
    return perturb(power, perturb_hash(PERTURBED_POWER, bits_from_real(complement), bits_from_real(exponent)),
                   POWER_ERROR);
}

#endif
