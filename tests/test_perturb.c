// At `strict` a device's own quotients and roots, wrong by what the specification allows, are repaired to the
// correctly rounded ones.
#include "host/base/array.h"
#include "tests/probe.h"
#include "tests/specimen.h"
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { OPERAND_COUNT = 1 << 20 };

static const char kernel_text[] = "#include \"numerics.h\"\n"
                                  "kernel void repair(global const float *a, global const float *b,\n"
                                  "                   global float *quotients, global float *roots)\n"
                                  "{\n"
                                  "    size_t i = get_global_id(0);\n"
                                  "    quotients[i] = real_divide(a[i], b[i]);\n"
                                  "    roots[i] = real_sqrt(fabs(a[i]));\n"
                                  "}\n";

static cl_program program_make(uint32_t seed)
{
    char prelude[256];
    snprintf(prelude, sizeof prelude,
             "#define LANES 1\n#define IS_FAST 0\n#define IS_STRICT 1\n#define IS_DOUBLE 0\n"
             "#define REPAIRS_DIVIDE 1\n#define PERTURB 1\n#define PERTURB_SCALE 1\n"
             "#define PERTURB_SEED %uu\n",
             seed);
    return probe_program(kernel_text, prelude);
}

// Runs the kernel on a and b; what comes back belongs to the caller.
static void repair(uint32_t seed, const float *a, const float *b, float *quotients, float *roots)
{
    const size_t size = OPERAND_COUNT * sizeof *a, count = OPERAND_COUNT;
    cl_program program = program_make(seed);
    cl_int status;
    cl_kernel kernel = clCreateKernel(program, "repair", &status);
    cl_check(status, "clCreateKernel");
    cl_mem buffers[] = {buffer_create(&probe_compute, size, a, CL_MEM_READ_ONLY),
                        buffer_create(&probe_compute, size, b, CL_MEM_READ_ONLY),
                        buffer_create(&probe_compute, size, NULL, CL_MEM_WRITE_ONLY),
                        buffer_create(&probe_compute, size, NULL, CL_MEM_WRITE_ONLY)};
    for (cl_uint i = 0; i < 4; i++)
        kernel_argument(kernel, i, sizeof(cl_mem), &buffers[i]);
    kernel_launch(&probe_compute, kernel, 1, &count, NULL);
    cl_must(clEnqueueReadBuffer(probe_compute.queue, buffers[2], CL_TRUE, 0, size, quotients, 0, NULL, NULL));
    cl_must(clEnqueueReadBuffer(probe_compute.queue, buffers[3], CL_TRUE, 0, size, roots, 0, NULL, NULL));
    for (size_t i = 0; i < 4; i++)
        cl_must(clReleaseMemObject(buffers[i]));
    cl_must(clReleaseKernel(kernel));
    cl_must(clReleaseProgram(program));
}

// A whole number of so many bits, odd if asked for.
static double whole(Random *random, int bits, bool odd)
{
    double half = ldexp(1, bits - 2);
    return 2 * floor(random_between(random, half, 2 * half)) + odd;
}

// A quarter of the pairs are any; of a quarter the quotient is near a float or near the middle between two,
// of a quarter the root; a quarter is near a power of two. Of either sign, from the smallest normal float to
// the largest.
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

static void wrong_quotients_and_roots_are_repaired(void **state)
{
    (void)state;
    float *numbers[4];
    for (size_t i = 0; i < 4; i++)
        numbers[i] = memory_allocate(OPERAND_COUNT, sizeof(float));
    float *a = numbers[0], *b = numbers[1], *quotients = numbers[2], *roots = numbers[3];
    operands_make(a, b);
    for (uint32_t seed = 1; seed <= 4; seed++) {
        repair(seed, a, b, quotients, roots);
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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(wrong_quotients_and_roots_are_repaired)};
    return cmocka_run_group_tests(tests, probe_open, probe_close);
}
