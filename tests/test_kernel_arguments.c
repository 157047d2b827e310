// Checks that every kernel's arguments fit small devices. They may have at most 8 buffers, which is V3D's
// limit, and 256 bytes in total, which is the least CL_DEVICE_MAX_PARAMETER_SIZE that OpenCL's embedded
// profile permits.
#include "host/compile/compiled_scene.h"
#include "tests/check.h"
#include "tests/probe.h"

enum { BUFFERS_MAX = 8, BYTES_MAX = 256, POINTER_BYTES = 8, KERNELS_MIN = 5 };

typedef struct {
    size_t buffer_count, byte_count;
} Arguments;

// The types that kernels take by value, by the names that the device's compiler reports.
static const struct {
    const char *name;
    size_t size, alignment;
} value_types[] = {
    {"uint", 4, 4},
    {"float", 4, 4},
    {"scalar", 8, 8}, // at `double`
    {"uint4", 16, 16},
    {"ArenaOffsets", sizeof(ArenaOffsets), 4},
    {"LayerOffsets", sizeof(LayerOffsets), 4},
};

static void bytes_add(Arguments *arguments, size_t size, size_t alignment)
{
    arguments->byte_count = (arguments->byte_count + alignment - 1) / alignment * alignment + size;
}

static void value_add(Arguments *arguments, const char *type, const char *kernel)
{
    for (size_t i = 0; i < COUNT_OF(value_types); i++) {
        if (strcmp(type, value_types[i].name) != 0) continue;
        bytes_add(arguments, value_types[i].size, value_types[i].alignment);
        return;
    }
    fail_msg("%s has an argument of type %s, whose size is not listed here", kernel, type);
}

// Returns the size of a kernel's arguments. Skips the test where the device does not report them.
static Arguments arguments_of(cl_kernel kernel, const char *name)
{
    Arguments arguments = {0};
    cl_uint count = 0;
    assert_int_equal(clGetKernelInfo(kernel, CL_KERNEL_NUM_ARGS, sizeof count, &count, NULL), CL_SUCCESS);
    for (cl_uint i = 0; i < count; i++) {
        cl_kernel_arg_address_qualifier space;
        char type[64] = "";
        cl_int status =
            clGetKernelArgInfo(kernel, i, CL_KERNEL_ARG_ADDRESS_QUALIFIER, sizeof space, &space, NULL);
        if (status == CL_KERNEL_ARG_INFO_NOT_AVAILABLE) skip();
        assert_int_equal(status, CL_SUCCESS);
        status = clGetKernelArgInfo(kernel, i, CL_KERNEL_ARG_TYPE_NAME, sizeof type, type, NULL);
        assert_int_equal(status, CL_SUCCESS);
        if (space == CL_KERNEL_ARG_ADDRESS_PRIVATE) {
            value_add(&arguments, type, name);
        } else {
            arguments.buffer_count++;
            bytes_add(&arguments, POINTER_BYTES, POINTER_BYTES);
        }
    }
    return arguments;
}

static cl_program program_with_arguments(const char *text)
{
    return probe_program(text, 1, PRECISION_SINGLE, true, 0, "-cl-std=CL1.2 -cl-kernel-arg-info");
}

// The kernel of this test has arguments of known sizes.
TEST(arguments_are_counted)
{
    cl_program program = program_with_arguments(
        "kernel void many(global int *a, global float *b, constant float *c, uint d, uint4 e, "
        "global const int *f, uint g)\n{\n    if (d + e.x + g > 0) *a = *f + (int)*b + (int)*c;\n}\n");
    cl_kernel kernel = probe_kernel(program, "many");
    const Arguments arguments = arguments_of(kernel, "many");
    assert_int_equal(arguments.buffer_count, 4);
    assert_int_equal(arguments.byte_count, 3 * 8 + 4 + 4 + 16 + 8 + 4); // 4 of padding before the uint4
    clReleaseKernel(kernel);
    clReleaseProgram(program);
}

static size_t file_check(const char *file)
{
    cl_program program = program_with_arguments(formatted("#include \"%s\"\n", file));
    cl_kernel kernels[8];
    cl_uint count = 0;
    compute_try(&probe_compute, clCreateKernelsInProgram(program, 8, kernels, &count));
    assert_true(count > 0);
    for (cl_uint i = 0; i < count; i++) {
        char name[64] = "";
        clGetKernelInfo(kernels[i], CL_KERNEL_FUNCTION_NAME, sizeof name, name, NULL);
        const Arguments arguments = arguments_of(kernels[i], name);
        printf("%s: %zu buffers, %zu bytes of arguments\n", name, arguments.buffer_count,
               arguments.byte_count);
        if (arguments.buffer_count > BUFFERS_MAX)
            fail_msg("%s takes %zu buffers", name, arguments.buffer_count);
        if (arguments.byte_count > BYTES_MAX) fail_msg("%s takes %zu bytes", name, arguments.byte_count);
        clReleaseKernel(kernels[i]);
    }
    clReleaseProgram(program);
    return count;
}

TEST(every_kernel_has_few)
{
    size_t count = 0;
    for (const EmbeddedFile *file = kernel_files; file->name; file++)
        if (strcmp(file->name + strlen(file->name) - 3, ".cl") == 0) count += file_check(file->name);
    assert_true(count >= KERNELS_MIN);
}

TEST_MAIN(probe_open, probe_close)
