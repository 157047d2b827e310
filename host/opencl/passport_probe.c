#include "host/opencl/passport_probe.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/base/random.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

ProgramRequest passport_request(const Device *device, PassportMode mode, uint32_t lanes, bool has_fma,
                                bool no_cache, Text *prelude)
{
    text_appendf(prelude,
                 "#define LANES %u\n#define IS_FAST 0\n#define IS_STRICT %d\n#define IS_DOUBLE %d\n"
                 "#define IS_CERTIFIED 0\n#define REPAIRS_DIVIDE %d\n#define HAS_FMA %d\n#define PERTURB 0\n"
                 "#define PERTURB_SEED 0u\n#define PERTURB_SCALE 1\n",
                 lanes, mode == PASSPORT_STRICT, mode == PASSPORT_DOUBLE, mode == PASSPORT_STRICT, has_fma);
    return (ProgramRequest){.root = "passport.cl",
                            .kernel = "passport",
                            .launch = "passport",
                            .prelude = text_c(prelude),
                            .options = passport_build_options(device, mode),
                            .no_cache = no_cache};
}

// Releases the program without storing it. The passport is stored instead, and a driver that crashes when
// asked for a binary would prevent the render.
void probe_kernel_close(Measurement *measurement)
{
    program_close(&measurement->program);
    text_free(&measurement->prelude);
}

LaunchTime probe_launch(Measurement *measurement, cl_uint probe, cl_uint first, cl_uint round_count,
                        cl_uint operand_count, cl_uint count)
{
    Compute *compute = measurement->compute;
    cl_kernel kernel = measurement->program.kernel;
    const cl_uint numbers[] = {probe, first, round_count, operand_count};
    for (cl_uint i = 0; i < 4; i++)
        kernel_argument(compute, kernel, i, sizeof numbers[i], &numbers[i]);
    kernel_buffer(compute, kernel, 4, measurement->operands);
    kernel_argument(compute, kernel, 5, sizeof count, &count);
    kernel_buffer(compute, kernel, 6, measurement->results);
    const size_t items = count / measurement->passport->lanes;
    const LaunchTime time = kernel_launch(compute, kernel, 1, NULL, &items, NULL);
    if (compute_ok(compute)) array_push(measurement->launches, time);
    return time;
}

void operands_write(Measurement *measurement, const Operands *operands, size_t count)
{
    const size_t size = scalar_size(measurement);
    OWNED char *bytes = memory_allocate(3 * count, size);
    for (size_t i = 0; i < count; i++) {
        const uint64_t bits[] = {operands[i].a, operands[i].b, operands[i].c};
        for (size_t k = 0; k < 3; k++) // the low bytes come first
            memcpy(bytes + (k * count + i) * size, &bits[k], size);
    }
    buffer_write(measurement->compute, measurement->operands, 3 * count * size, bytes);
}

void probe_kernel_open(Measurement *measurement, bool has_fma)
{
    Passport *passport = measurement->passport;
    const double start = clock_seconds();
    measurement->prelude = (Text){0};
    measurement->request = passport_request(measurement->compute->device, passport->mode, passport->lanes,
                                            has_fma, measurement->no_cache, &measurement->prelude);
    program_build(measurement->compute, &measurement->request, &measurement->program);
    const Operands zero = {0};
    operands_write(measurement, &zero, 1);
    probe_launch(measurement, PROBE_SUM_PRODUCT, 0, 0, 1, OPERANDS_MAX);
    measurement->launches.count = 0;
    passport->build_seconds += clock_seconds() - start;
}

bool probe_run(Measurement *measurement, cl_uint probe, const Operands *operands, size_t count,
               Results *results)
{
    const size_t size = scalar_size(measurement), padded = OPERANDS_MAX;
    Operands filled[OPERANDS_MAX] = {0};
    memcpy(filled, operands, count * sizeof *operands);
    operands_write(measurement, filled, padded);
    probe_launch(measurement, probe, 0, 0, (cl_uint)padded, (cl_uint)padded);
    OWNED char *bytes = memory_allocate(2 * padded, size);
    const bool is_read = buffer_read(measurement->compute, measurement->results, 2 * padded * size, bytes);
    memset(results, 0, count * sizeof *results);
    for (size_t i = 0; i < count && is_read; i++) {
        memcpy(&results[i].first, bytes + i * size, size);
        memcpy(&results[i].second, bytes + (padded + i) * size, size);
    }
    return is_read;
}

uint64_t probe_random_bits(Measurement *measurement)
{
    return random_next(&measurement->random);
}

double probe_random_real(Measurement *measurement, int span)
{
    const int digits = measurement->is_double ? 53 : 24;
    const uint64_t one = UINT64_C(1) << (digits - 1);
    const uint64_t bits = probe_random_bits(measurement), choice = probe_random_bits(measurement);
    uint64_t mantissa = bits % one;
    if (choice % 4 == 1) mantissa = mantissa >> (digits / 2) << (digits / 2);
    if (choice % 4 == 2) mantissa %= 8;
    if (choice % 4 == 3) mantissa = one - 1 - mantissa % 8;
    const int exponent = (int)(choice / 4 % (uint64_t)(2 * span + 1)) - span;
    const double value = ldexp((double)(one + mantissa), exponent - (digits - 1));
    return choice >> 63 ? -value : value;
}

void reals_make(Measurement *measurement, Reals *reals, Operands *operands)
{
    const double unit_roundoff = measurement->is_double ? 0x1p-53 : 0x1p-24;
    for (size_t i = 0; i < OPERANDS_MAX; i++) {
        const double a = probe_random_real(measurement, 12), b = probe_random_real(measurement, 12);
        reals[i] = (Reals){a, b, 0};
        if (i % 4 == 1) reals[i].b = copysign(ldexp(unit_roundoff, ilogb(a)), b);
        if (i % 4 == 2) reals[i].b = -exact_product(measurement->is_double, a, 1 + 2 * unit_roundoff).nearest;
        operands[i] = operands_of(measurement, reals[i]);
    }
}

void probe_buffers_open(Measurement *measurement)
{
    const size_t size = scalar_size(measurement);
    measurement->operands =
        buffer_create(measurement->compute, 3 * OPERANDS_MAX * size, NULL, CL_MEM_READ_ONLY);
    measurement->results =
        buffer_create(measurement->compute, 2 * (size_t)RESULTS_MAX * size, NULL, CL_MEM_WRITE_ONLY);
}

void probe_buffers_close(Measurement *measurement)
{
    buffer_release(measurement->operands);
    buffer_release(measurement->results);
    free(measurement->launches.items);
}
