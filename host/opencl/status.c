// Names OpenCL's status codes.
#include "host/base/array.h"
#include "host/opencl/device.h"
#include <CL/cl_ext.h>
#include <string.h>

#define STATUS(name)                                                                                         \
    case name:                                                                                               \
        return #name

const char *cl_status_name(cl_int status)
{
    switch (status) {
        STATUS(CL_SUCCESS);
        STATUS(CL_DEVICE_NOT_FOUND);
        STATUS(CL_DEVICE_NOT_AVAILABLE);
        STATUS(CL_COMPILER_NOT_AVAILABLE);
        STATUS(CL_MEM_OBJECT_ALLOCATION_FAILURE);
        STATUS(CL_OUT_OF_RESOURCES);
        STATUS(CL_OUT_OF_HOST_MEMORY);
        STATUS(CL_PROFILING_INFO_NOT_AVAILABLE);
        STATUS(CL_MEM_COPY_OVERLAP);
        STATUS(CL_IMAGE_FORMAT_MISMATCH);
        STATUS(CL_IMAGE_FORMAT_NOT_SUPPORTED);
        STATUS(CL_BUILD_PROGRAM_FAILURE);
        STATUS(CL_MAP_FAILURE);
        STATUS(CL_MISALIGNED_SUB_BUFFER_OFFSET);
        STATUS(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST);
        STATUS(CL_COMPILE_PROGRAM_FAILURE);
        STATUS(CL_LINKER_NOT_AVAILABLE);
        STATUS(CL_LINK_PROGRAM_FAILURE);
        STATUS(CL_DEVICE_PARTITION_FAILED);
        STATUS(CL_KERNEL_ARG_INFO_NOT_AVAILABLE);
        STATUS(CL_INVALID_VALUE);
        STATUS(CL_INVALID_DEVICE_TYPE);
        STATUS(CL_INVALID_PLATFORM);
        STATUS(CL_INVALID_DEVICE);
        STATUS(CL_INVALID_CONTEXT);
        STATUS(CL_INVALID_QUEUE_PROPERTIES);
        STATUS(CL_INVALID_COMMAND_QUEUE);
        STATUS(CL_INVALID_HOST_PTR);
        STATUS(CL_INVALID_MEM_OBJECT);
        STATUS(CL_INVALID_IMAGE_FORMAT_DESCRIPTOR);
        STATUS(CL_INVALID_IMAGE_SIZE);
        STATUS(CL_INVALID_SAMPLER);
        STATUS(CL_INVALID_BINARY);
        STATUS(CL_INVALID_BUILD_OPTIONS);
        STATUS(CL_INVALID_PROGRAM);
        STATUS(CL_INVALID_PROGRAM_EXECUTABLE);
        STATUS(CL_INVALID_KERNEL_NAME);
        STATUS(CL_INVALID_KERNEL_DEFINITION);
        STATUS(CL_INVALID_KERNEL);
        STATUS(CL_INVALID_ARG_INDEX);
        STATUS(CL_INVALID_ARG_VALUE);
        STATUS(CL_INVALID_ARG_SIZE);
        STATUS(CL_INVALID_KERNEL_ARGS);
        STATUS(CL_INVALID_WORK_DIMENSION);
        STATUS(CL_INVALID_WORK_GROUP_SIZE);
        STATUS(CL_INVALID_WORK_ITEM_SIZE);
        STATUS(CL_INVALID_GLOBAL_OFFSET);
        STATUS(CL_INVALID_EVENT_WAIT_LIST);
        STATUS(CL_INVALID_EVENT);
        STATUS(CL_INVALID_OPERATION);
        STATUS(CL_INVALID_GL_OBJECT);
        STATUS(CL_INVALID_BUFFER_SIZE);
        STATUS(CL_INVALID_MIP_LEVEL);
        STATUS(CL_INVALID_GLOBAL_WORK_SIZE);
        STATUS(CL_INVALID_PROPERTY);
        STATUS(CL_INVALID_IMAGE_DESCRIPTOR);
        STATUS(CL_INVALID_COMPILER_OPTIONS);
        STATUS(CL_INVALID_LINKER_OPTIONS);
        STATUS(CL_INVALID_DEVICE_PARTITION_COUNT);
        STATUS(CL_PLATFORM_NOT_FOUND_KHR);
    default:
        return "a status unknown to OpenCL 1.2";
    }
}

static const struct {
    const char *function;
    cl_int status;
    const char *meaning;
} meanings[] = {
    {"clBuildProgram", CL_OUT_OF_HOST_MEMORY, "the driver's compiler ran out of memory"},
    {"clBuildProgram", CL_OUT_OF_RESOURCES,
     "the driver's compiler ran out of memory or time, or the kernel needs more than the device has"},
    {"clBuildProgram", CL_BUILD_PROGRAM_FAILURE, "the driver's compiler does not accept the kernel"},
    {"clBuildProgram", CL_COMPILER_NOT_AVAILABLE, "the driver has no compiler"},
    {"clBuildProgram", CL_INVALID_BUILD_OPTIONS, "the driver's compiler does not know an option"},
    {"clCreateKernel", CL_OUT_OF_HOST_MEMORY, "the driver ran out of memory when it finished the kernel"},
    {"clCreateKernel", CL_OUT_OF_RESOURCES,
     "the kernel needs more registers, private memory or arguments than the device has"},
    {"clCreateKernel", CL_INVALID_KERNEL_NAME, "the driver's build left the kernel out"},
    {"clCreateKernel", CL_INVALID_KERNEL_DEFINITION, "the driver built the kernel with other arguments"},
    {"clCreateKernel", CL_INVALID_PROGRAM_EXECUTABLE, "the driver reported a build that it did not finish"},
    {"clEnqueueNDRangeKernel", CL_OUT_OF_RESOURCES,
     "the kernel needs more than the device has, or its watchdog stopped it"},
    {"clEnqueueNDRangeKernel", CL_MEM_OBJECT_ALLOCATION_FAILURE,
     "the buffers do not fit the device's memory"},
    {"clWaitForEvents", CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST,
     "the device failed, or its watchdog stopped it"},
};

const char *cl_status_meaning(const char *function, cl_int status)
{
    for (size_t i = 0; i < COUNT_OF(meanings); i++)
        if (meanings[i].status == status && strcmp(meanings[i].function, function) == 0)
            return meanings[i].meaning;
    return NULL;
}
