// Launches probes and judges their results on the host: nothing that the device computes is taken as exact.
#include "host/opencl/passport_measure.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "kernels/probes.h"
#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum {
    OPERANDS_MAX = 256,     // of a probe; a multiple of any LANES
    SWEEP_MAX = 1 << 19,    // mantissas of a launch
    SWEEP_MIN = 1 << 8,     // of the first: Oclgrind interprets some hundred thousand operations a second
    QUICK_SWEEP = 1 << 14,  // mantissas of a sweep that is not thorough
    SPARSE_SWEEP = 1 << 20, // of a thorough one that need not be exhaustive
    FLOAT_MANTISSAS = 1 << 23,
    TIMED_ITEMS = 64
};
static const double timed_seconds_wanted = 2e-3;

// Bits of reals or integers of the kernel's size.
typedef struct {
    uint64_t a, b, c;
} Operands;

typedef struct {
    uint64_t first, second;
} Results;

typedef struct {
    Passport *passport;
    Compute *compute;
    bool is_double, no_cache;
    ProgramRequest request;
    Text prelude;
    Program program;
    cl_kernel kernel;
    cl_mem operands, results;
    struct {
        LaunchTime *items;
        size_t count, capacity;
    } launches;
    cl_uint timed_rounds; // of chains that take timed_seconds_wanted
    double start;         // of the measurement, after the builds
    uint64_t random;
} Measurement;

ProgramRequest passport_request(const Device *device, PassportMode mode, uint32_t lanes, bool has_fma,
                                bool no_cache, Text *prelude)
{
    text_appendf(prelude,
                 "#define LANES %u\n#define IS_FAST 0\n#define IS_STRICT %d\n#define IS_DOUBLE %d\n"
                 "#define IS_CERTIFIED 0\n#define REPAIRS_DIVIDE %d\n#define HAS_FMA %d\n#define PERTURB 0\n"
                 "#define PERTURB_SEED 0u\n#define PERTURB_SCALE 1\n",
                 lanes, mode == PASSPORT_STRICT, mode == PASSPORT_DOUBLE, mode == PASSPORT_STRICT, has_fma);
    return (ProgramRequest){.root = "passport.cl",
                            .launch = "passport",
                            .prelude = text_c(prelude),
                            .options = passport_build_options(device, mode),
                            .no_cache = no_cache};
}

// The program is not stored: its passport is, and a driver that crashes when asked for a binary would spoil a
// render that has not begun.
static void kernel_close(Measurement *measurement)
{
    if (measurement->kernel) clReleaseKernel(measurement->kernel);
    program_close(&measurement->program);
    text_free(&measurement->prelude);
}

static size_t scalar_size(const Measurement *measurement)
{
    return measurement->is_double ? sizeof(double) : sizeof(float);
}

// A launch over `count` lanes.
static LaunchTime probe_launch(Measurement *measurement, cl_uint probe, cl_uint first, cl_uint round_count,
                               cl_uint operand_count, cl_uint count)
{
    Compute *compute = measurement->compute;
    const cl_uint numbers[] = {probe, first, round_count, operand_count};
    for (cl_uint i = 0; i < 4; i++)
        kernel_argument(compute, measurement->kernel, i, sizeof numbers[i], &numbers[i]);
    kernel_argument(compute, measurement->kernel, 4, sizeof(cl_mem), &measurement->operands);
    kernel_argument(compute, measurement->kernel, 5, sizeof count, &count);
    kernel_argument(compute, measurement->kernel, 6, sizeof(cl_mem), &measurement->results);
    const size_t items = count / measurement->passport->lanes;
    const LaunchTime time = kernel_launch(compute, measurement->kernel, 1, &items, NULL);
    if (compute_ok(compute)) array_push(measurement->launches, time);
    return time;
}

static void operands_write(Measurement *measurement, const Operands *operands, size_t count)
{
    const size_t size = scalar_size(measurement);
    char *bytes = memory_allocate(3 * count, size);
    for (size_t i = 0; i < count; i++) {
        const uint64_t bits[] = {operands[i].a, operands[i].b, operands[i].c};
        for (size_t k = 0; k < 3; k++) // the low bytes come first
            memcpy(bytes + (k * count + i) * size, &bits[k], size);
    }
    buffer_write(measurement->compute, measurement->operands, 3 * count * size, bytes);
    free(bytes);
}

// A driver may finish the build in the first launch.
static void kernel_open(Measurement *measurement, bool has_fma)
{
    Passport *passport = measurement->passport;
    const double start = clock_seconds();
    measurement->prelude = (Text){0};
    measurement->request = passport_request(measurement->compute->device, passport->mode, passport->lanes,
                                            has_fma, measurement->no_cache, &measurement->prelude);
    program_build(measurement->compute, &measurement->request, &measurement->program);
    measurement->kernel = program_kernel(measurement->compute, &measurement->program, "passport");
    const Operands zero = {0};
    operands_write(measurement, &zero, 1);
    probe_launch(measurement, PROBE_SUM_PRODUCT, 0, 0, 1, OPERANDS_MAX);
    measurement->launches.count = 0;
    passport->build_seconds += clock_seconds() - start;
}

// Runs a probe of at most OPERANDS_MAX operands. False: the device failed, and all results are 0.
static bool probe_run(Measurement *measurement, cl_uint probe, const Operands *operands, size_t count,
                      Results *results)
{
    const size_t size = scalar_size(measurement), padded = OPERANDS_MAX;
    Operands filled[OPERANDS_MAX] = {0};
    memcpy(filled, operands, count * sizeof *operands);
    operands_write(measurement, filled, padded);
    probe_launch(measurement, probe, 0, 0, (cl_uint)padded, (cl_uint)padded);
    char *bytes = memory_allocate(2 * padded, size);
    const bool is_read = buffer_read(measurement->compute, measurement->results, 2 * padded * size, bytes);
    memset(results, 0, count * sizeof *results);
    for (size_t i = 0; i < count && is_read; i++) {
        memcpy(&results[i].first, bytes + i * size, size);
        memcpy(&results[i].second, bytes + (padded + i) * size, size);
    }
    free(bytes);
    return is_read;
}

// Sebastiano Vigna's splitmix64.
static uint64_t random_next(Measurement *measurement)
{
    uint64_t bits = measurement->random += 0x9e3779b97f4a7c15U;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
    return bits ^ (bits >> 31);
}

// Of either sign, with an exponent of -span to span: a random mantissa, a short one, whose product with
// another may lie halfway between two reals, or one near 1 or 2.
static double random_real(Measurement *measurement, int span)
{
    const int digits = measurement->is_double ? 53 : 24;
    const uint64_t one = UINT64_C(1) << (digits - 1);
    const uint64_t bits = random_next(measurement), choice = random_next(measurement);
    uint64_t mantissa = bits % one;
    if (choice % 4 == 1) mantissa = mantissa >> (digits / 2) << (digits / 2);
    if (choice % 4 == 2) mantissa %= 8;
    if (choice % 4 == 3) mantissa = one - 1 - mantissa % 8;
    const int exponent = (int)(choice / 4 % (uint64_t)(2 * span + 1)) - span;
    const double value = ldexp((double)(one + mantissa), exponent - (digits - 1));
    return choice >> 63 ? -value : value;
}

static uint64_t bits_of(const Measurement *measurement, double value)
{
    return real_bits(measurement->is_double, value);
}

static double value_of(const Measurement *measurement, uint64_t bits)
{
    return real_value(measurement->is_double, bits);
}

typedef struct {
    double a, b, c;
} Reals;

static Operands operands_of(const Measurement *measurement, Reals reals)
{
    return (Operands){bits_of(measurement, reals.a), bits_of(measurement, reals.b),
                      bits_of(measurement, reals.c)};
}

// Pairs of random reals, for sums also such that cancel and such that end in half an ulp.
static void reals_make(Measurement *measurement, Reals *reals, Operands *operands)
{
    const double unit_roundoff = measurement->is_double ? 0x1p-53 : 0x1p-24;
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const double a = random_real(measurement, 12), b = random_real(measurement, 12);
        reals[i] = (Reals){a, b, 0};
        if (i % 4 == 1) reals[i].b = copysign(ldexp(unit_roundoff, ilogb(a)), b);
        if (i % 4 == 2) reals[i].b = -exact_product(measurement->is_double, a, 1 + 2 * unit_roundoff).nearest;
        operands[i] = operands_of(measurement, reals[i]);
    }
}

// Leaves the modes in which a result may have been rounded.
static void roundings_narrow(bool is_double, bool *modes, Exact exact, double result)
{
    for (RoundingMode mode = 0; mode < ROUNDING_OTHER; mode++)
        modes[mode] = modes[mode] && result == exact_rounded(is_double, exact, mode);
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

    passport->two_sum_is_exact = probe_run(measurement, PROBE_TWO_SUM, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const Exact exact = exact_sum(is_double, reals[i].a, reals[i].b);
        passport->two_sum_is_exact &= value_of(measurement, results[i].first) == exact.nearest &&
                                      value_of(measurement, results[i].second) == exact.rest;
    }
    passport->two_product_is_exact =
        probe_run(measurement, PROBE_TWO_PRODUCT, operands, OPERANDS_MAX, results);
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const Exact exact = exact_product(is_double, reals[i].a, reals[i].b);
        passport->two_product_is_exact &= value_of(measurement, results[i].first) == exact.nearest &&
                                          value_of(measurement, results[i].second) == exact.rest;
    }
}

// The sum of a product and its negative: its rounding error where contracted, which shows.
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

// Whether real_fma of the kernel in use rounds once, also where the product nearly cancels, or the addend is
// half an ulp of it, or far below.
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
        const double far = random_real(measurement, 12);
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

// The least time by the host's clock that a chain takes in so many launches.
static double chain_seconds(Measurement *measurement, cl_uint probe, cl_uint rounds, int launches)
{
    const cl_uint count = TIMED_ITEMS * measurement->passport->lanes;
    double least = INFINITY;
    for (int i = 0; i < launches; i++)
        least = fmin(least, probe_launch(measurement, probe, 0, rounds, 1, count).host_seconds);
    return least;
}

// The time of fma over that of a product and a sum, without the time of an empty launch: the least of
// launches that take turns, more of them where fma seems slow, which may be chance.
static double fma_cost(Measurement *measurement)
{
    enum { TURNS_MIN = 4, TURNS_MAX = 16 };
    const Operands chain = operands_of(measurement, (Reals){0.75, 0.5, 0.5});
    operands_write(measurement, &chain, 1);
    const double launch = chain_seconds(measurement, PROBE_TIME_SEPARATE, 0, TURNS_MIN);
    // at PASSPORT_FMA_COST_MAX the faster of the two then takes as long as an empty launch
    const double wanted = fmax(timed_seconds_wanted, PASSPORT_FMA_COST_MAX * launch);
    cl_uint rounds = 8;
    for (; compute_ok(measurement->compute) && rounds < 1u << 26; rounds *= 2) {
        const double slower = fmax(chain_seconds(measurement, PROBE_TIME_FMA, rounds, 2),
                                   chain_seconds(measurement, PROBE_TIME_SEPARATE, rounds, 2));
        if (slower - launch >= wanted) break;
    }
    measurement->timed_rounds = rounds;
    double fused = INFINITY, separate = INFINITY;
    for (int turn = 1; turn <= TURNS_MAX && compute_ok(measurement->compute); turn++) {
        fused = fmin(fused, chain_seconds(measurement, PROBE_TIME_FMA, rounds, 1));
        separate = fmin(separate, chain_seconds(measurement, PROBE_TIME_SEPARATE, rounds, 1));
        const bool seems_slow = fused - launch >= PASSPORT_FMA_COST_MAX * (separate - launch);
        if ((turn >= TURNS_MIN && !seems_slow) || fmax(fused, separate) > 50 * wanted) break;
    }
    const double separate_min = 0.01 * wanted; // what is less is the launches' noise
    return (fused - launch) / fmax(separate - launch, separate_min);
}

static void fma_measure(Measurement *measurement)
{
    Passport *passport = measurement->passport;
    kernel_open(measurement, true);
    measurement->start = clock_seconds();
    passport->fma_is_fused = passport->fma_is_exact = fma_is_exact(measurement);
    const double cost = fma_cost(measurement);
    if (passport->fma_is_fused) passport->fma_cost = cost;
    // doubles have no replacement, and OpenCL demands that their fma rounds once
    passport->uses_fma =
        measurement->is_double || (measurement->compute->device->fma_in_hardware && passport->fma_is_fused &&
                                   passport->fma_cost < PASSPORT_FMA_COST_MAX);
    if (passport->uses_fma) return;
    kernel_close(measurement);
    const double before = passport->build_seconds;
    kernel_open(measurement, false);
    measurement->start += passport->build_seconds - before;
    passport->fma_is_exact = fma_is_exact(measurement);
}

// Quotients or roots to judge in several threads.
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

static void sweep_judge(void *context, size_t begin, size_t end)
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

// Sweeps the first `count` mantissas in turn, as many as fit before `deadline`, but QUICK_SWEEP even on a
// busy machine. Returns whether all did.
static bool sweep_run(Measurement *measurement, RoundedResults *results, cl_uint probe, double operand,
                      uint32_t count, double deadline)
{
    const size_t size = scalar_size(measurement);
    Compute *compute = measurement->compute;
    const Operands operands = operands_of(measurement, (Reals){operand, 0, 0});
    operands_write(measurement, &operands, 1);
    char *bytes = memory_allocate(2 * (size_t)SWEEP_MAX, size);
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
        parallel_run(part, 1 << 14, sweep_judge, &sweep);
        done += part;
        last_seconds = clock_seconds() - start;
        if (part < SWEEP_MAX && last_seconds < 0.01) part *= 2;
    }
    pthread_mutex_destroy(&sweep.mutex);
    free(bytes);
    return done == count;
}

// Random operands, whose exponents differ.
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

// In float the reciprocals and the roots of both binades are exhaustive. Quotients by what is next to 1 and
// 2, and of it, lie near the midpoints of two floats.
static void quotients_measure(Measurement *measurement)
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
    enum { SWEEPS = sizeof sweeps / sizeof *sweeps };
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

// Runs the cases; returns for each what the probe returned, an integer for the first result of PROBE_COMPARE.
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
    enum { COUNT = sizeof cases / sizeof *cases };
    double values[COUNT];
    cases_run(measurement, cases, COUNT, values);
    measurement->passport->has_infinities_and_nans = true;
    for (size_t i = 0; i < COUNT; i++)
        measurement->passport->has_infinities_and_nans &= same_value(values[i], cases[i].expected);
}

// As results and as operands.
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
    enum { COUNT = sizeof cases / sizeof *cases };
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
        // of any length, so that some are beyond the mantissa
        const uint64_t bits = random_next(measurement) >> (64 - sign) >> (i % sign);
        integers[i] = i % 2 == 0 ? (int64_t)bits : -(int64_t)bits - 1;
        reals[i] = value_of(
            measurement, bits_of(measurement, ldexp(random_real(measurement, 0), (int)(i % (sign - 1)) - 1)));
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

static uint64_t greatest_divisor(uint64_t a, uint64_t b)
{
    while (b != 0) {
        const uint64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

// The largest share of the host's seconds that an event has, among launches that are long enough for that.
static double timer_ratio(const Measurement *measurement)
{
    double ratio = 0;
    for (size_t i = 0; i < measurement->launches.count; i++) {
        const LaunchTime *time = &measurement->launches.items[i];
        if (time->host_seconds >= 0.5 * timed_seconds_wanted)
            ratio = fmax(ratio, (time->end_seconds - time->start_seconds) / time->host_seconds);
    }
    return ratio;
}

static void timer_measure(Measurement *measurement)
{
    const double sure = 1e-6; // more than what a double loses of the nanoseconds since 1970
    TimerFindings *timer = &measurement->passport->timer;
    // on a busy machine the host may wait much longer than an event lasts, but hardly each time or for long
    // ones
    enum { TRIES = 16 };
    cl_uint rounds = measurement->timed_rounds;
    for (int i = 0; i < TRIES && timer_ratio(measurement) < 0.5 && rounds > 0; i++) {
        const double seconds = chain_seconds(measurement, PROBE_TIME_SEPARATE, rounds, 1);
        if (seconds < 20 * timed_seconds_wanted && rounds < 1u << 26) rounds *= 2;
    }
    bool is_absent = true, is_counter = true, goes_back = false;
    for (size_t i = 0; i < measurement->launches.count; i++) {
        const LaunchTime *time = &measurement->launches.items[i], *before = i > 0 ? time - 1 : time;
        const double seconds = time->end_seconds - time->start_seconds;
        if (time->start_seconds == 0 && time->end_seconds == 0) continue;
        is_absent = false;
        is_counter = is_counter && seconds < 1.5e-9;
        goes_back = goes_back || seconds < 0 || (i > 0 && time->start_seconds < before->end_seconds - sure);
        timer->step_nanoseconds =
            greatest_divisor(timer->step_nanoseconds, (uint64_t)llround(1e9 * time->event_seconds));
    }
    // known devices tick in 10 nanoseconds or more; on a busy machine the host may be late after every launch
    const double ratio = timer_ratio(measurement);
    timer->tick_nanoseconds = ratio > 0 ? 1 / ratio : 0;
    timer->fault = is_absent                                    ? TIMER_ABSENT
                   : goes_back                                  ? TIMER_BACKWARD
                   : is_counter                                 ? TIMER_COUNTER
                   : ratio > 0 && (ratio < 0.15 || ratio > 1.1) ? TIMER_UNIT
                                                                : TIMER_SOUND;
}

static void buffers_open(Measurement *measurement)
{
    const size_t size = scalar_size(measurement);
    measurement->operands =
        buffer_create(measurement->compute, 3 * OPERANDS_MAX * size, NULL, CL_MEM_READ_ONLY);
    measurement->results =
        buffer_create(measurement->compute, 2 * (size_t)SWEEP_MAX * size, NULL, CL_MEM_WRITE_ONLY);
}

static void measurement_close(Measurement *measurement)
{
    kernel_close(measurement);
    buffer_release(measurement->operands);
    buffer_release(measurement->results);
    free(measurement->launches.items);
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
    buffers_open(&measurement);
    fma_measure(&measurement);
    sums_measure(&measurement);
    contraction_measure(&measurement);
    specials_measure(&measurement);
    subnormals_measure(&measurement);
    conversions_measure(&measurement);
    quotients_measure(&measurement);
    timer_measure(&measurement);
    passport->seconds = clock_seconds() - measurement.start;
    measurement_close(&measurement);
    return compute_ok(compute);
}
