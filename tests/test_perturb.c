// Tests differences between devices. At `strict`, quotients and roots with the error that the specification
// permits must be repaired to the correctly rounded ones. The fma of devices without one in hardware must
// have fma's bits.
// run_tests: sanitize-long-only
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/probe.h"

enum { OPERAND_COUNT = 1 << 20, ARRAYS_MAX = 5 };

// The device's quotients overflow and underflow too early, as an NVIDIA H100's do.
static const char repair_text[] = "#include \"numerics/perturb.h\"\n"
                                  "static inline real early_divide(real a, real b)\n"
                                  "{\n"
                                  "    real quotient = device_divide(a, b), size = fabs(quotient);\n"
                                  "    if (size > 0x1.fffff0p+127f) return copysign(INFINITY, quotient);\n"
                                  "    return size < 0x1.000010p-126f ? 0 : quotient;\n"
                                  "}\n"
                                  "#define device_divide early_divide\n"
                                  "#include \"numerics.h\"\n"
                                  "kernel void repair(global const float *a, global const float *b,\n"
                                  "                   global float *quotients, global float *roots)\n"
                                  "{\n"
                                  "    size_t i = get_global_id(0);\n"
                                  "    quotients[i] = real_divide(a[i], b[i]);\n"
                                  "    roots[i] = real_sqrt(fabs(a[i]));\n"
                                  "}\n";

static const char fma_text[] =
    "#include \"numerics.h\"\n"
    "kernel void multiply_add(global const float *a, global const float *b,\n"
    "                         global const float *c, global float *sums,\n"
    "                         global float *errors)\n"
    "{\n"
    "    size_t i = get_global_id(0) * LANES;\n"
    "    RealLanes sum = {real_fma(real_load(a + i), real_load(b + i), real_load(c + i))};\n"
    "    RealLanes error = {two_product(real_load(a + i), real_load(b + i)).low};\n"
    "    for (uint lane = 0; lane < LANES; lane++) {\n"
    "        sums[i + lane] = sum.each[lane];\n"
    "        errors[i + lane] = error.each[lane];\n"
    "    }\n"
    "}\n";

// Runs a kernel, whose program it releases, on arrays of OPERAND_COUNT floats, of which the first are inputs.
static void kernel_run(cl_program program, const char *name, size_t work_items, float *const *numbers,
                       size_t input_count, size_t count)
{
    const size_t size = OPERAND_COUNT * sizeof **numbers;
    cl_kernel kernel = probe_kernel(program, name);
    cl_mem buffers[ARRAYS_MAX];
    for (size_t i = 0; i < count; i++) {
        const bool is_input = i < input_count;
        buffers[i] = buffer_create(&probe_compute, size, is_input ? numbers[i] : NULL,
                                   is_input ? CL_MEM_READ_ONLY : CL_MEM_WRITE_ONLY);
        kernel_argument(&probe_compute, kernel, (cl_uint)i, sizeof(cl_mem), &buffers[i]);
    }
    kernel_launch(&probe_compute, kernel, 1, NULL, &work_items, NULL);
    for (size_t i = 0; i < count; i++) {
        if (i >= input_count) buffer_read(&probe_compute, buffers[i], size, numbers[i]);
        buffer_release(buffers[i]);
    }
    clReleaseKernel(kernel);
    clReleaseProgram(program);
}

// Returns an integer of this many bits, which is odd if `odd` is set.
static double whole(Random *random, int bits, bool odd)
{
    double half = ldexp(1, bits - 2);
    return 2 * floor(random_between(random, half, 2 * half)) + odd;
}

// Makes pairs of either sign, from the smallest normal float to the largest. A quarter are any, in a quarter
// the quotient, and in a quarter the root, is near a float or near the middle between two, and a quarter is
// near a power of two.
static void operands_make(float *a, float *b)
{
    Random random = {38};
    for (size_t i = 0; i < OPERAND_COUNT; i++) {
        double divisor = whole(&random, 24, random_between(&random, 0, 1) < 0.5);
        if (i / 4 % 4 == 0) divisor = 0x1p24 - floor(random_between(&random, -8, 8));
        double dividend = whole(&random, 24, random_between(&random, 0, 1) < 0.5);
        if (i % 4 == 1) dividend = divisor * whole(&random, 25, i / 16 % 2);
        if (i % 4 == 2) dividend = pow(whole(&random, 25, i / 16 % 2), 2);
        if (i % 4 == 3) dividend = 0x1p24;
        float near = (float)dividend;
        near += (float)floor(random_between(&random, -2, 3)) * (nextafterf(near, INFINITY) - near);
        int a_scale = (int)floor(random_between(&random, -126, 127));
        int b_scale = (int)floor(random_between(&random, -126, 127));
        a[i] = copysignf(ldexpf(near, a_scale - ilogbf(near)), (float)random_between(&random, -1, 1));
        b[i] = copysignf(ldexpf((float)divisor, b_scale - 24), (float)random_between(&random, -1, 1));
    }
}

TEST(wrong_quotients_and_roots_are_repaired)
{
    float *numbers[4];
    for (size_t i = 0; i < 4; i++)
        numbers[i] = memory_allocate(OPERAND_COUNT, sizeof(float));
    float *a = numbers[0], *b = numbers[1], *quotients = numbers[2], *roots = numbers[3];
    operands_make(a, b);
    for (uint32_t seed = 1; seed <= 4; seed++) {
        kernel_run(probe_program(repair_text, 1, PRECISION_STRICT, true, seed, "-cl-std=CL1.2"), "repair",
                   OPERAND_COUNT, numbers, 2, 4);
        for (size_t i = 0; i < OPERAND_COUNT; i++) {
            float quotient = a[i] / b[i], root = sqrtf(fabsf(a[i]));
            bool normal = fabsf(b[i]) >= FLT_MIN && fabsf(quotient) >= FLT_MIN && isfinite(quotient);
            if (normal && quotients[i] != quotient)
                fail_msg("seed %u: %a / %a is %a, not %a", seed, (double)a[i], (double)b[i], (double)quotient,
                         (double)quotients[i]);
            if (roots[i] != root)
                fail_msg("seed %u: the root of %a is %a, not %a", seed, fabs((double)a[i]), (double)root,
                         (double)roots[i]);
        }
    }
    for (size_t i = 0; i < 4; i++)
        free(numbers[i]);
}

// Makes a, b and c. In a quarter c is any, in a quarter it is within a few ulp of the product, in a quarter
// it is about 24 bits larger or smaller than the product, where it decides how the other is rounded, and in
// a quarter one of them is a power of two, 0 or infinite. Factors have few bits as often as many, so that
// sums lie in the middle between floats.
static void terms_make(float *a, float *b, float *c)
{
    static const float special[] = {0.0F, -0.0F, 1.0F, -1.0F, FLT_MAX, -FLT_MAX, INFINITY, -INFINITY};
    enum { SPECIAL_COUNT = COUNT_OF(special) };
    Random random = {39};
    for (size_t i = 0; i < OPERAND_COUNT; i++) {
        float *factors[] = {&a[i], &b[i]};
        for (size_t k = 0; k < 2; k++) {
            double mantissa =
                whole(&random, i / 4 % 2 ? 24 : 5 + (int)(i / 8 % 16), random_between(&random, 0, 1) < 0.5);
            const double largest = i / 16 % 2 ? 127 : 64;
            int scale = (int)floor(random_between(&random, -largest, largest));
            *factors[k] =
                (float)copysign(ldexp(mantissa, scale - ilogb(mantissa)), random_between(&random, -1, 1));
        }
        float product = a[i] * b[i], ulp = fabsf(nextafterf(product, INFINITY) - product);
        float mantissa = (float)ldexp(whole(&random, 24, random_between(&random, 0, 1) < 0.5), -23);
        float sign = random_between(&random, 0, 1) < 0.5 ? -1.0F : 1.0F;
        if (i % 4 == 0) c[i] = sign * ldexpf(mantissa, (int)floor(random_between(&random, -126, 127)));
        if (i % 4 == 1) c[i] = -product + ulp * (float)floor(random_between(&random, -4, 5));
        if (i % 4 == 2)
            c[i] = sign * ldexpf(mantissa, ilogbf(product) + (int)floor(random_between(&random, -28, 29)));
        if (i % 4 == 3)
            c[i] = sign * ldexpf(1, ilogbf(product) + (int)floor(random_between(&random, -28, 29)));
        if (i % 64 == 63) {
            *factors[i / 64 % 2] = special[i / 128 % SPECIAL_COUNT];
            if (i / 2048 % 2) c[i] = special[i / 4096 % SPECIAL_COUNT];
        }
    }
}

static bool same(float a, float b)
{
    return isnan(a) ? isnan(b) : a == b && signbit(a) == signbit(b);
}

TEST(fma_in_software_is_exact)
{
    if (!probe_has(PRECISION_STRICT)) skip();
    float *numbers[5];
    for (size_t i = 0; i < 5; i++)
        numbers[i] = memory_allocate(OPERAND_COUNT, sizeof(float));
    float *a = numbers[0], *b = numbers[1], *c = numbers[2], *sums = numbers[3], *errors = numbers[4];
    terms_make(a, b, c);
    for (unsigned lanes = 1; lanes <= 16; lanes *= 4) {
        kernel_run(probe_program(fma_text, lanes, PRECISION_STRICT, false, 0, "-cl-std=CL1.2"),
                   "multiply_add", OPERAND_COUNT / lanes, numbers, 3, 5);
        for (size_t i = 0; i < OPERAND_COUNT; i++) {
            float product = a[i] * b[i], sum = fmaf(a[i], b[i], c[i]);
            if (isinf(product) && isinf(c[i])) continue; // may be NaN
            if (ilogbf(a[i]) + ilogbf(b[i]) >= -166 && !same(sums[i], sum))
                fail_msg("%u lanes: %a * %a + %a is %a, not %a", lanes, (double)a[i], (double)b[i],
                         (double)c[i], (double)sum, (double)sums[i]);
            if (isfinite(product) && errors[i] != fmaf(a[i], b[i], -product))
                fail_msg("%u lanes: %a * %a leaves %a out, not %a", lanes, (double)a[i], (double)b[i],
                         (double)fmaf(a[i], b[i], -product), (double)errors[i]);
        }
    }
    for (size_t i = 0; i < 5; i++)
        free(numbers[i]);
}

TEST_MAIN(probe_open, probe_close)
