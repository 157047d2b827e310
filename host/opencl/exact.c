// Floats are computed in double, which holds their sums and products without error, and quotients and roots
// closely enough that double rounding is innocuous (Figueroa, When is double rounding innocuous?, SIGNUM
// Newsletter 30(3), 1995). Doubles are computed by fma, which the C library rounds once.
#include "host/opencl/exact.h"

#include <math.h>
#include <string.h>

uint64_t real_bits(bool is_double, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    if (is_double) return bits;
    const float narrow = (float)value;
    uint32_t narrow_bits;
    memcpy(&narrow_bits, &narrow, sizeof narrow_bits);
    return narrow_bits;
}

double real_value(bool is_double, uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    if (is_double) return value;
    const uint32_t narrow_bits = (uint32_t)bits;
    float narrow;
    memcpy(&narrow, &narrow_bits, sizeof narrow);
    return narrow;
}

Exact exact_sum(bool is_double, double a, double b)
{
    if (!is_double) {
        const double sum = a + b, nearest = (float)sum;
        return (Exact){nearest, sum - nearest};
    }
    const double larger = fabs(a) >= fabs(b) ? a : b, smaller = fabs(a) >= fabs(b) ? b : a;
    const double nearest = fma(a, 1, b);
    return (Exact){nearest, smaller - (nearest - larger)};
}

Exact exact_product(bool is_double, double a, double b)
{
    if (!is_double) {
        const double product = a * b, nearest = (float)product;
        return (Exact){nearest, product - nearest};
    }
    const double nearest = fma(a, b, 0);
    return (Exact){nearest, fma(a, b, -nearest)};
}

double exact_fma(bool is_double, double a, double b, double c)
{
    return is_double ? fma(a, b, c) : (double)fmaf((float)a, (float)b, (float)c);
}

static double next_toward(bool is_double, double value, double limit)
{
    return is_double ? nextafter(value, limit) : (double)nextafterf((float)value, (float)limit);
}

double exact_rounded(bool is_double, Exact exact, RoundingMode rounding)
{
    const bool is_above = exact.rest > 0, is_below = exact.rest < 0; // the exact value, of the nearest
    if (rounding == ROUNDING_TOWARD_ZERO) rounding = exact.nearest > 0 ? ROUNDING_DOWN : ROUNDING_UP;
    if (rounding == ROUNDING_UP && is_above) return next_toward(is_double, exact.nearest, INFINITY);
    if (rounding == ROUNDING_DOWN && is_below) return next_toward(is_double, exact.nearest, -INFINITY);
    return exact.nearest;
}

// Returns the ulp of a normal double.
static double normal_ulp(bool is_double, double value)
{
    const uint64_t exponent_bits = UINT64_C(0x7ff0000000000000);
    return real_value(true, real_bits(true, value) & exponent_bits) * (is_double ? 0x1p-52 : 0x1p-23);
}

// Returns 0.5 for the nearest real, otherwise more. Quotients and roots never lie halfway between reals.
static double error_of(double error, bool is_nearest)
{
    return is_nearest ? 0.5 : fmax(error, nextafter(0.5, 1));
}

double quotient_error(bool is_double, double a, double b, double quotient)
{
    const double exact = a / b;
    if (!is_double && (float)exact == (float)quotient) return 0.5;
    if (!(quotient > 0) || isinf(quotient)) return INFINITY;
    const double ulp = normal_ulp(is_double, quotient);
    if (!is_double) return error_of(fabs(exact - quotient) / ulp, false);
    // exact for a quotient within an ulp; so is b times a power of two
    const double residual = fabs(fma(-quotient, b, a)), half = 0.5 * ulp * b;
    return error_of(0.5 * residual / half, residual <= half);
}

double root_error(bool is_double, double a, double root)
{
    const double exact = sqrt(a);
    if (!is_double && (float)exact == (float)root) return 0.5;
    if (!(root > 0) || isinf(root)) return INFINITY;
    const double ulp = normal_ulp(is_double, root);
    if (!is_double) return error_of(fabs(exact - root) / ulp, false);
    // (root - ulp / 2)^2 < a < (root + ulp / 2)^2: a - root^2 is a multiple of ulp^2, so that ulp^2 / 4
    // counts only in the first
    const double residual = fma(-root, root, a), limit = root * ulp;
    return error_of(0.5 * fabs(residual) / limit, residual > -limit && residual <= limit);
}
