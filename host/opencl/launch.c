// Launches kernels and times their events.
#include "host/base/clock.h"
#include "host/opencl/passport.h"
#include <string.h>

LaunchTime launch_time_classify(cl_ulong start, cl_ulong end, double host_seconds, double resolution_seconds)
{
    const double event_seconds = start != 0 && end > start ? 1e-9 * (double)(end - start) : 0;
    const char *fault = NULL;
    if (start == 0 && end == 0)
        fault = passport_timer_faults[TIMER_ABSENT];
    else if (end <= start)
        fault = "the event ends no later than it starts";
    else if (event_seconds < 1.5e-9) // rusticl's timestamps (Mesa 22.3) are 1, 2, 3 …
        fault = passport_timer_faults[TIMER_COUNTER];
    else if (event_seconds > 1.01 * host_seconds + resolution_seconds)
        fault = "the event is longer than the host waited for it";
    return (LaunchTime){.start_seconds = 1e-9 * (double)start,
                        .end_seconds = 1e-9 * (double)end,
                        .event_seconds = event_seconds,
                        .host_seconds = host_seconds,
                        .fault = fault};
}

static const LaunchTime failed_launch = {.fault = "the command failed"};

// Returns a timestamp of the event, or zero if the runtime has none.
static cl_ulong event_timestamp(cl_event event, cl_profiling_info what)
{
    cl_ulong nanoseconds = 0;
    if (clGetEventProfilingInfo(event, what, sizeof nanoseconds, &nanoseconds, NULL) != CL_SUCCESS) return 0;
    return nanoseconds;
}

LaunchTime event_time(Compute *compute, cl_event event, const char *command, double host_start)
{
    LaunchTime time = failed_launch;
    fault_record_call("clWaitForEvents");
    cl_int waited = clWaitForEvents(1, &event), state = CL_COMPLETE;
    fault_record_call(NULL);
    double host_seconds = clock_seconds() - host_start;
    compute_try(compute,
                clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof state, &state, NULL));
    if (state < 0) compute_fail(compute, command, state, "the command failed on the device");
    if (compute_check(compute, waited, "clWaitForEvents")) {
        time = launch_time_classify(event_timestamp(event, CL_PROFILING_COMMAND_START),
                                    event_timestamp(event, CL_PROFILING_COMMAND_END), host_seconds,
                                    compute->device->timer_resolution_seconds);
        time.device = compute->device;
        time.queued_seconds = 1e-9 * (double)event_timestamp(event, CL_PROFILING_COMMAND_QUEUED);
        time.submitted_seconds = 1e-9 * (double)event_timestamp(event, CL_PROFILING_COMMAND_SUBMIT);
        time.host_start_seconds = host_start;
        const char *timer_fault = passport_timer_fault(compute->device);
        if (timer_fault) time.fault = timer_fault;
    }
    clReleaseEvent(event);
    return time;
}

void work_group_fit(size_t *sides, cl_uint dimensions, size_t largest, const size_t *longest_sides)
{
    size_t items = 1;
    for (cl_uint i = 0; i < dimensions; i++) {
        while (sides[i] > 1 && sides[i] > longest_sides[i])
            sides[i] /= 2;
        items *= sides[i];
    }
    while (items > largest && items > 1) {
        cl_uint longest = 0;
        for (cl_uint i = 1; i < dimensions; i++)
            if (sides[i] >= sides[longest]) longest = i;
        items /= sides[longest];
        sides[longest] /= 2;
        items *= sides[longest];
    }
}

// Fits a work-group to the device and the kernel. A device may limit groups to a single work-item, and a
// kernel with many variables to fewer than its device.
static void work_group_fit_kernel(const Device *device, cl_kernel kernel, cl_uint dimensions, size_t *sides)
{
    size_t largest = 0;
    if (clGetKernelWorkGroupInfo(kernel, device->id, CL_KERNEL_WORK_GROUP_SIZE, sizeof largest, &largest,
                                 NULL) != CL_SUCCESS ||
        largest == 0)
        largest = SIZE_MAX;
    if (device->largest_work_group > 0 && device->largest_work_group < largest)
        largest = device->largest_work_group;
    size_t longest_sides[3];
    for (cl_uint i = 0; i < 3; i++)
        longest_sides[i] = device->longest_group_sides[i] > 0 ? device->longest_group_sides[i] : SIZE_MAX;
    work_group_fit(sides, dimensions, largest, longest_sides);
}

LaunchTime kernel_launch(Compute *compute, cl_kernel kernel, cl_uint dimensions, const size_t *first,
                         const size_t *items, const size_t *group)
{
    if (!compute_check(compute, compute->unmap_failure.status, compute->unmap_failure.call))
        return failed_launch;
    size_t global[3], local[3];
    for (cl_uint i = 0; i < dimensions; i++)
        local[i] = group ? group[i] : 1;
    if (group) work_group_fit_kernel(compute->device, kernel, dimensions, local);
    for (cl_uint i = 0; i < dimensions; i++)
        global[i] = (items[i] + local[i] - 1) / local[i] * local[i];
    double host_start = clock_seconds();
    cl_event event;
    if (!compute_try(compute, clEnqueueNDRangeKernel(compute->queue, kernel, dimensions, first, global,
                                                     group ? local : NULL, 0, NULL, &event)))
        return failed_launch;
    LaunchTime time = event_time(compute, event, "clEnqueueNDRangeKernel", host_start);
    time.dimensions = dimensions;
    memcpy(time.global, global, dimensions * sizeof *global);
    if (group) memcpy(time.local, local, dimensions * sizeof *local);
    return time;
}
