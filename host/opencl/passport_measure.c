#include "host/opencl/passport_probe.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include <float.h>
#include <math.h>
#include <string.h>

// Keeps only the rounding modes that yield the result.
static void roundings_narrow(bool is_double, bool *modes, Exact exact, double result)
{
    for (RoundingMode mode = 0; mode < ROUNDING_OTHER; mode++)
        modes[mode] = modes[mode] && result == exact_rounded(is_double, exact, mode);
}

// Returns whether a probe yields the nearest real of each result and the exact rest.
static bool is_exact_pair(Measurement *measurement, cl_uint probe, const Reals *reals,
                          const Operands *operands, Exact (*operation)(bool is_double, double a, double b))
{
    Results results[OPERANDS_MAX];
    bool is_exact = probe_run(measurement, probe, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const Exact exact = operation(measurement->is_double, reals[i].a, reals[i].b);
        is_exact &= value_of(measurement, results[i].first) == exact.nearest &&
                    value_of(measurement, results[i].second) == exact.rest;
    }
    return is_exact;
}

static void sums_measure(Measurement *measurement)
{
    Passport *passport = measurement->passport;
    const bool is_double = measurement->is_double;
    Reals reals[OPERANDS_MAX];
    Operands operands[OPERANDS_MAX];
    Results results[OPERANDS_MAX];
    reals_make(measurement, reals, operands);

    bool modes[ROUNDING_OTHER] = {true, true, true, true};
    probe_run(measurement, PROBE_SUM_PRODUCT, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        roundings_narrow(is_double, modes, exact_sum(is_double, reals[i].a, reals[i].b),
                         value_of(measurement, results[i].first));
        roundings_narrow(is_double, modes, exact_product(is_double, reals[i].a, reals[i].b),
                         value_of(measurement, results[i].second));
    }
    passport->rounding = 0;
    while (passport->rounding < ROUNDING_OTHER && !modes[passport->rounding])
        passport->rounding++;

    passport->two_sum_is_exact = is_exact_pair(measurement, PROBE_TWO_SUM, reals, operands, exact_sum);
    passport->two_product_is_exact =
        is_exact_pair(measurement, PROBE_TWO_PRODUCT, reals, operands, exact_product);
}

// Measures whether products and sums are contracted. The sum of a product and its rounded negative is then
// its rounding error.
static void contraction_measure(Measurement *measurement)
{
    Reals reals[OPERANDS_MAX];
    Operands operands[OPERANDS_MAX];
    Results results[OPERANDS_MAX];
    reals_make(measurement, reals, operands);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        reals[i].c = -exact_product(measurement->is_double, reals[i].a, reals[i].b).nearest;
        operands[i] = operands_of(measurement, reals[i]);
    }
    probe_run(measurement, PROBE_CONTRACTION, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const double rest = exact_product(measurement->is_double, reals[i].a, reals[i].b).rest;
        if (rest != 0 && (value_of(measurement, results[i].first) == rest ||
                          value_of(measurement, results[i].second) == -rest))
            measurement->passport->contracts = true;
    }
}

// Returns whether the current kernel's real_fma rounds once, even if the product nearly cancels, or the
// addend is half an ulp of it or far below.
static bool fma_is_exact(Measurement *measurement)
{
    const bool is_double = measurement->is_double;
    const int digits = is_double ? 53 : 24;
    Reals reals[OPERANDS_MAX];
    Operands operands[OPERANDS_MAX];
    Results results[OPERANDS_MAX];
    reals_make(measurement, reals, operands);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const double product = exact_product(is_double, reals[i].a, reals[i].b).nearest;
        const double far = probe_random_real(measurement, 12);
        const double addends[] = {-product, ldexp(far, -2 * digits), ldexp(far, digits),
                                  copysign(ldexp(1, ilogb(product) - digits), far), far};
        reals[i].c = addends[i % 5];
        operands[i] = operands_of(measurement, reals[i]);
    }
    bool is_exact = probe_run(measurement, PROBE_FMA, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const double exact = exact_fma(is_double, reals[i].a, reals[i].b, reals[i].c);
        is_exact = is_exact && value_of(measurement, results[i].first) == exact &&
                   value_of(measurement, results[i].second) == exact;
    }
    return is_exact;
}

static void fma_measure(Measurement *measurement)
{
    Passport *passport = measurement->passport;
    probe_kernel_open(measurement, true);
    measurement->start = clock_seconds();
    passport->fma_is_fused = passport->fma_is_exact = fma_is_exact(measurement);
    const double cost = fma_cost(measurement);
    if (passport->fma_is_fused) passport->fma_cost = cost;
    // doubles have no replacement, and OpenCL demands that their fma rounds once
    const double cost_max = measurement->compute->device->fma_in_hardware ? PASSPORT_FMA_COST_MAX
                                                                          : PASSPORT_UNCLAIMED_FMA_COST_MAX;
    passport->uses_fma = measurement->is_double || (passport->fma_is_fused && passport->fma_cost < cost_max);
    if (passport->uses_fma) return;
    probe_kernel_close(measurement);
    const double before = passport->build_seconds;
    probe_kernel_open(measurement, false);
    measurement->start += passport->build_seconds - before;
    passport->fma_is_exact = fma_is_exact(measurement);
}

typedef struct {
    Reals reals;
    double expected, flushed;
    cl_uint probe;
    bool is_second; // of the results
} Case;

static bool same_value(double a, double b)
{
    return a == b || (isnan(a) && isnan(b));
}

// Runs the cases and sets `values` to the results. PROBE_COMPARE's first result is an integer.
static void cases_run(Measurement *measurement, const Case *cases, size_t count, double *values)
{
    for (size_t begin = 0, end; begin < count; begin = end) {
        Operands operands[OPERANDS_MAX] = {0};
        Results results[OPERANDS_MAX];
        for (end = begin; end < count && cases[end].probe == cases[begin].probe; end++)
            operands[end - begin] = operands_of(measurement, cases[end].reals);
        probe_run(measurement, cases[begin].probe, operands, end - begin, results);
        for (size_t i = begin; i < end; i++) {
            const uint64_t bits = cases[i].is_second ? results[i - begin].second : results[i - begin].first;
            const bool is_integer = cases[i].probe == PROBE_COMPARE && !cases[i].is_second;
            values[i] = is_integer ? (double)bits : value_of(measurement, bits);
        }
    }
}

static void specials_measure(Measurement *measurement)
{
    const double most = measurement->is_double ? DBL_MAX : FLT_MAX, inf = INFINITY, nan = NAN;
    const Case cases[] = {
        {{most, most, 0}, inf, 0, PROBE_SUM_PRODUCT, false},
        {{inf, -inf, 0}, nan, 0, PROBE_SUM_PRODUCT, false},
        {{inf, -most, 0}, inf, 0, PROBE_SUM_PRODUCT, false},
        {{nan, 1, 0}, nan, 0, PROBE_SUM_PRODUCT, false},
        {{most, 2, 0}, inf, 0, PROBE_SUM_PRODUCT, true},
        {{-most, 2, 0}, -inf, 0, PROBE_SUM_PRODUCT, true},
        {{0, inf, 0}, nan, 0, PROBE_SUM_PRODUCT, true},
        {{0, inf, 1}, nan, 0, PROBE_FMA, false},
        {{most, 2, most}, inf, 0, PROBE_FMA, false},
        {{1, nan, 1}, nan, 0, PROBE_FMA, false},
        {{1, 0, 0}, inf, 0, PROBE_DIVIDE, true},
        {{-1, 0, 0}, -inf, 0, PROBE_DIVIDE, true},
        {{0, 0, 0}, nan, 0, PROBE_DIVIDE, true},
        {{1, inf, 0}, 0, 0, PROBE_DIVIDE, true},
        {{inf, inf, 0}, nan, 0, PROBE_DIVIDE, true},
        {{most, 0.5, 0}, inf, 0, PROBE_DIVIDE, true},
        {{-1, 0, 0}, nan, 0, PROBE_SQRT, false},
        {{inf, 0, 0}, inf, 0, PROBE_SQRT, true},
        {{0, 0, 0}, 0, 0, PROBE_SQRT, true},
        {{nan, 1, 0}, COMPARED_UNEQUAL, 0, PROBE_COMPARE, false},
        {{nan, nan, 0}, COMPARED_UNEQUAL, 0, PROBE_COMPARE, false},
        {{inf, most, 0}, COMPARED_GREATER | COMPARED_UNEQUAL, 0, PROBE_COMPARE, false},
        {{-inf, -most, 0}, COMPARED_LESS | COMPARED_UNEQUAL | COMPARED_AT_MOST, 0, PROBE_COMPARE, false},
        {{inf, inf, 0}, COMPARED_EQUAL | COMPARED_AT_MOST, 0, PROBE_COMPARE, false},
        {{-0.0, 0, 0}, COMPARED_EQUAL | COMPARED_AT_MOST, 0, PROBE_COMPARE, false},
        {{nan, 1, 0}, 1, 0, PROBE_COMPARE, true},
        {{1, nan, 0}, nan, 0, PROBE_COMPARE, true},
        {{inf, most, 0}, inf, 0, PROBE_COMPARE, true},
    };
    enum { COUNT = COUNT_OF(cases) };
    double values[COUNT];
    cases_run(measurement, cases, COUNT, values);
    measurement->passport->has_infinities_and_nans = true;
    for (size_t i = 0; i < COUNT; i++)
        measurement->passport->has_infinities_and_nans &= same_value(values[i], cases[i].expected);
}

// Measures subnormals as results and as operands.
static void subnormals_measure(Measurement *measurement)
{
    const double least = measurement->is_double ? DBL_MIN : FLT_MIN; // the smallest normal real
    const Case cases[] = {
        {{1.5 * least, -least, 0}, 0.5 * least, 0, PROBE_SUM_PRODUCT, false},
        {{0.25 * least, 0.25 * least, 0}, 0.5 * least, 0, PROBE_SUM_PRODUCT, false},
        {{0.5 * least, 0.5 * least, 0}, least, 0, PROBE_SUM_PRODUCT, false},
        {{least, 0.5, 0}, 0.5 * least, 0, PROBE_SUM_PRODUCT, true},
        {{0.5 * least, 4, 0}, 2 * least, 0, PROBE_SUM_PRODUCT, true},
        {{least, 0.5, 0}, 0.5 * least, 0, PROBE_FMA, false},
        {{0.5 * least, 4, 0}, 2 * least, 0, PROBE_FMA, false},
        {{least, 2, 0}, 0.5 * least, 0, PROBE_DIVIDE, false},
        {{0.5 * least, 0.25, 0}, 2 * least, 0, PROBE_DIVIDE, false},
        {{0.25 * least, 0, 0}, 0.5 * sqrt(least), 0, PROBE_SQRT, false},
        {{0.5 * least, 0, 0},
         COMPARED_GREATER | COMPARED_UNEQUAL,
         COMPARED_EQUAL | COMPARED_AT_MOST,
         PROBE_COMPARE,
         false},
    };
    enum { COUNT = COUNT_OF(cases) };
    double values[COUNT];
    cases_run(measurement, cases, COUNT, values);
    size_t kept = 0, flushed = 0;
    for (size_t i = 0; i < COUNT; i++) {
        kept += values[i] == cases[i].expected;
        flushed += values[i] == cases[i].flushed;
    }
    measurement->passport->subnormals = kept == COUNT      ? SUBNORMALS_KEPT
                                        : flushed == COUNT ? SUBNORMALS_FLUSHED
                                                           : SUBNORMALS_MIXED;
}

static void conversions_measure(Measurement *measurement)
{
    const bool is_double = measurement->is_double;
    const unsigned sign = is_double ? 63 : 31;
    Operands operands[OPERANDS_MAX];
    Results results[OPERANDS_MAX];
    double reals[OPERANDS_MAX];
    int64_t integers[OPERANDS_MAX];
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        // of any length, so that some exceed the mantissa
        const uint64_t bits = probe_random_bits(measurement) >> (64 - sign) >> (i % sign);
        integers[i] = i % 2 == 0 ? (int64_t)bits : -(int64_t)bits - 1;
        reals[i] = value_of(measurement, bits_of(measurement, ldexp(probe_random_real(measurement, 0),
                                                                    (int)(i % (sign - 1)) - 1)));
        operands[i] = (Operands){(uint64_t)integers[i], bits_of(measurement, reals[i]), 0};
    }
    bool is_exact = probe_run(measurement, PROBE_INTEGERS, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const double nearest = is_double ? (double)integers[i] : (double)(float)integers[i];
        const int64_t truncated = is_double ? (int64_t)results[i].second : (int32_t)results[i].second;
        is_exact =
            is_exact && value_of(measurement, results[i].first) == nearest && truncated == (int64_t)reals[i];
    }
    for (size_t i = 0; i < OPERANDS_MAX && is_double; i++) {
        // half of them lie halfway between two floats
        if (i % 2 == 0) reals[i] = (float)reals[i] + ldexp(1, ilogb((float)reals[i]) - 24);
        const int32_t bits_of_float = (int32_t)(uint32_t)real_bits(false, (float)integers[i]);
        operands[i] = (Operands){bits_of(measurement, reals[i]), (uint64_t)(int64_t)bits_of_float, 0};
    }
    if (is_double) is_exact &= probe_run(measurement, PROBE_FLOATS, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX && is_double; i++)
        is_exact = is_exact && (uint32_t)results[i].first == real_bits(false, reals[i]) &&
                   value_of(measurement, results[i].second) == (double)(float)integers[i];
    measurement->passport->converts_exactly = is_exact;
}

bool passport_measure(Passport *passport, Compute *compute, PassportMode mode, uint32_t lanes,
                      bool is_thorough, bool no_cache)
{
    const Device *device = compute->device;
    const bool is_double = mode == PASSPORT_DOUBLE;
    memset(passport, 0, sizeof *passport); // no indeterminate padding reaches the cache
    passport->mode = mode;
    passport->lanes = lanes;
    passport->is_thorough = is_thorough;
    passport->has_promised_rounding = mode == PASSPORT_STRICT && device->correctly_rounded;
    passport->has_promised_subnormals = is_double || device->denormals;
    Measurement measurement = {
        .passport = passport, .compute = compute, .is_double = is_double, .no_cache = no_cache};
    probe_buffers_open(&measurement);
    fma_measure(&measurement);
    sums_measure(&measurement);
    contraction_measure(&measurement);
    specials_measure(&measurement);
    subnormals_measure(&measurement);
    conversions_measure(&measurement);
    quotients_measure(&measurement);
    timer_measure(&measurement);
    passport->seconds = clock_seconds() - measurement.start;
    probe_kernel_close(&measurement);
    probe_buffers_close(&measurement);
    return compute_ok(compute);
}
