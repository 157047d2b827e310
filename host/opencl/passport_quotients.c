// Measures how exactly a device divides and takes square roots.
#include "host/opencl/passport_probe.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include <math.h>
#include <pthread.h>
#include <stdlib.h>

// Counts of mantissas.
enum {
    SWEEP_MIN = 1 << 8, // of the first launch: Oclgrind interprets some hundred thousand operations a second
    QUICK_SWEEP = 1 << 14,  // of a sweep that is not thorough
    SPARSE_SWEEP = 1 << 20, // of a thorough one that need not be exhaustive
    FLOAT_MANTISSAS = 1 << 23
};

// Quotients or roots that several threads check.
typedef struct {
    const Measurement *measurement;
    RoundedResults *results;
    const void *first, *second;
    cl_uint probe;
    uint32_t first_turn;
    double operand;
    pthread_mutex_t mutex;
} Sweep;

static double mantissa_in_turn(bool is_double, uint32_t turn)
{
    const uint64_t one = UINT64_C(1) << (is_double ? 52 : 23);
    const uint64_t stride = is_double ? MANTISSA_STRIDE_DOUBLE : MANTISSA_STRIDE_FLOAT;
    return (double)(one + (turn * stride & (one - 1))) * (is_double ? 0x1p-52 : 0x1p-23);
}

static double result_error(bool is_double, cl_uint probe, double a, double b, double result)
{
    return probe == PROBE_SQRT ? root_error(is_double, a, result) : quotient_error(is_double, a, b, result);
}

static void result_add(RoundedResults *results, double error, bool is_repaired)
{
    results->count++;
    results->wrong_count += error > 0.5;
    if (error > results->largest_ulp) results->largest_ulp = error;
    results->is_repaired &= is_repaired;
}

static void sweep_classify(void *context, size_t begin, size_t end)
{
    Sweep *sweep = context;
    const bool is_double = sweep->measurement->is_double;
    RoundedResults found = {.is_repaired = true};
    for (size_t i = begin; i < end; i++) {
        const double mantissa = mantissa_in_turn(is_double, sweep->first_turn + (uint32_t)i);
        const bool is_reciprocal = sweep->probe == PROBE_SWEEP_RECIPROCAL,
                   is_root = sweep->probe == PROBE_SWEEP_SQRT;
        const double a = is_reciprocal ? sweep->operand : is_root ? mantissa * sweep->operand : mantissa;
        const double b = is_reciprocal ? mantissa : sweep->operand;
        const double first = is_double ? ((const double *)sweep->first)[i] : ((const float *)sweep->first)[i];
        const double second =
            is_double ? ((const double *)sweep->second)[i] : ((const float *)sweep->second)[i];
        const cl_uint probe = is_root ? PROBE_SQRT : PROBE_DIVIDE;
        const double error = result_error(is_double, probe, a, b, first);
        result_add(&found, error,
                   first == second ? error <= 0.5 : result_error(is_double, probe, a, b, second) <= 0.5);
    }
    pthread_mutex_lock(&sweep->mutex);
    RoundedResults *results = sweep->results;
    results->count += found.count;
    results->wrong_count += found.wrong_count;
    results->is_repaired &= found.is_repaired;
    if (found.largest_ulp > results->largest_ulp) results->largest_ulp = found.largest_ulp;
    pthread_mutex_unlock(&sweep->mutex);
}

// Sweeps the first `count` mantissas in order until `deadline`, or until PASSPORT_SECONDS_MAX later if it has
// not yet swept QUICK_SWEEP of them. Returns whether it swept all.
static bool sweep_run(Measurement *measurement, RoundedResults *results, cl_uint probe, double operand,
                      uint32_t count, double deadline)
{
    const size_t size = scalar_size(measurement);
    Compute *compute = measurement->compute;
    const Operands operands = operands_of(measurement, (Reals){operand, 0, 0});
    operands_write(measurement, &operands, 1);
    OWNED char *bytes = memory_allocate(2 * (size_t)RESULTS_MAX, size);
    Sweep sweep = {.measurement = measurement, .results = results, .probe = probe, .operand = operand};
    pthread_mutex_init(&sweep.mutex, NULL);
    uint32_t done = 0;
    double last_seconds = 0;
    for (uint32_t part = SWEEP_MIN; done < count && compute_ok(compute);) {
        const double start = clock_seconds();
        const double latest = done < QUICK_SWEEP ? deadline + PASSPORT_SECONDS_MAX : deadline;
        if (done > 0 && start + 2 * last_seconds > latest) break;
        if (part > count - done) part = count - done;
        probe_launch(measurement, probe, done, 0, 1, part);
        if (!buffer_read(compute, measurement->results, 2 * (size_t)part * size, bytes)) break;
        sweep.first = bytes;
        sweep.second = bytes + part * size;
        sweep.first_turn = done;
        parallel_run(part, 1 << 14, sweep_classify, &sweep);
        done += part;
        last_seconds = clock_seconds() - start;
        if (part < RESULTS_MAX && last_seconds < 0.01) part *= 2;
    }
    pthread_mutex_destroy(&sweep.mutex);
    return done == count;
}

// Measures quotients and roots of random operands with different exponents.
static void quotients_probe(Measurement *measurement)
{
    Passport *passport = measurement->passport;
    Reals reals[OPERANDS_MAX];
    Operands operands[OPERANDS_MAX];
    Results results[OPERANDS_MAX];
    reals_make(measurement, reals, operands);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        reals[i].a = fabs(reals[i].a);
        reals[i].b = fabs(reals[i].b);
        operands[i] = operands_of(measurement, reals[i]);
    }
    static const cl_uint probes[] = {PROBE_DIVIDE, PROBE_SQRT};
    for (size_t k = 0; k < 2; k++) {
        if (!probe_run(measurement, probes[k], operands, OPERANDS_MAX, results)) return;
        for (size_t i = 0; i < OPERANDS_MAX; i++) {
            const double error = result_error(measurement->is_double, probes[k], reals[i].a, reals[i].b,
                                              value_of(measurement, results[i].first));
            const double repaired = result_error(measurement->is_double, probes[k], reals[i].a, reals[i].b,
                                                 value_of(measurement, results[i].second));
            result_add(k == 0 ? &passport->quotients : &passport->roots, error, repaired <= 0.5);
        }
    }
}

// Measures quotients and roots. In float, reciprocals and the roots of both binades are exhaustive.
// Quotients with an operand next to 1 or 2 lie near the midpoints of two floats.
void quotients_measure(Measurement *measurement)
{
    Passport *passport = measurement->passport;
    const double ulp = measurement->is_double ? 0x1p-52 : 0x1p-23;
    RoundedResults *quotients = &passport->quotients, *roots = &passport->roots;
    *quotients = *roots = (RoundedResults){.is_repaired = true};
    quotients_probe(measurement);
    const struct {
        RoundedResults *results;
        double operand;
        cl_uint probe;
        bool is_exhaustive;
    } sweeps[] = {
        {quotients, 1, PROBE_SWEEP_RECIPROCAL, true},
        {roots, 1, PROBE_SWEEP_SQRT, true},
        {roots, 2, PROBE_SWEEP_SQRT, true},
        {quotients, 1.5, PROBE_SWEEP_QUOTIENT, false},
        {quotients, 2 - ulp, PROBE_SWEEP_QUOTIENT, false},
        {quotients, 2 - ulp, PROBE_SWEEP_RECIPROCAL, false},
        {quotients, 1 + ulp, PROBE_SWEEP_QUOTIENT, false},
    };
    enum { SWEEPS = COUNT_OF(sweeps) };
    const bool may_be_exhaustive = passport->is_thorough && !measurement->is_double;
    quotients->is_exhaustive = roots->is_exhaustive = may_be_exhaustive;
    for (size_t i = 0; i < SWEEPS && compute_ok(measurement->compute); i++) {
        const uint32_t count = !passport->is_thorough    ? QUICK_SWEEP
                               : measurement->is_double  ? SPARSE_SWEEP / 4
                               : sweeps[i].is_exhaustive ? FLOAT_MANTISSAS
                                                         : SPARSE_SWEEP;
        const double now = clock_seconds(), end = measurement->start + PASSPORT_SECONDS_MAX;
        const double share = fmax(end - now, 0) / (double)(SWEEPS - i);
        const bool is_whole = sweep_run(measurement, sweeps[i].results, sweeps[i].probe, sweeps[i].operand,
                                        count, now + (passport->is_thorough ? share : fmin(share, 0.02)));
        if (sweeps[i].is_exhaustive) sweeps[i].results->is_exhaustive &= is_whole;
    }
}
