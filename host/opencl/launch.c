// Launches and the times of their events.
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/opencl/compute.h"

LaunchTime launch_time_judge(cl_ulong queued, cl_ulong start, cl_ulong end, double host_seconds,
                             double resolution_seconds)
{
    LaunchTime time = {
        .queued_seconds = 1e-9 * (double)queued,
        .start_seconds = 1e-9 * (double)start,
        .end_seconds = 1e-9 * (double)end,
        .host_seconds = host_seconds,
    };
    if (start != 0 && end > start) {
        time.event_seconds = 1e-9 * (double)(end - start);
        // Moments of a single tick apart are a counter, not a clock: rusticl's (Mesa 22.3) are 1, 2, 3 …
        time.trusted = end - start > 1 && time.event_seconds <= 1.01 * host_seconds + resolution_seconds;
    }
    return time;
}

const char *launch_time_doubt(const LaunchTime *time)
{
    if (time->trusted) return NULL;
    if (time->start_seconds == 0 && time->end_seconds == 0) return "the runtime reports no times for events";
    if (time->end_seconds <= time->start_seconds) return "the event ends no later than it starts";
    if (time->event_seconds < 1.5e-9) return "the event's moments count events, not time";
    return "the event is longer than the host waited for it";
}

// Zero where the runtime cannot say.
static cl_ulong event_moment(cl_event event, cl_profiling_info what)
{
    cl_ulong nanoseconds = 0;
    if (clGetEventProfilingInfo(event, what, sizeof nanoseconds, &nanoseconds, NULL) != CL_SUCCESS) return 0;
    return nanoseconds;
}

static double event_resolution(cl_event event)
{
    cl_command_queue queue = NULL;
    cl_device_id device = NULL;
    size_t nanoseconds = 0;
    if (clGetEventInfo(event, CL_EVENT_COMMAND_QUEUE, sizeof queue, &queue, NULL) != CL_SUCCESS || !queue ||
        clGetCommandQueueInfo(queue, CL_QUEUE_DEVICE, sizeof device, &device, NULL) != CL_SUCCESS ||
        clGetDeviceInfo(device, CL_DEVICE_PROFILING_TIMER_RESOLUTION, sizeof nanoseconds, &nanoseconds,
                        NULL) != CL_SUCCESS)
        return 0;
    return 1e-9 * (double)nanoseconds;
}

LaunchTime event_time(cl_event event, double host_start)
{
    cl_int waited = clWaitForEvents(1, &event);
    double host_seconds = clock_seconds() - host_start;
    cl_int state = CL_COMPLETE;
    cl_must(clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof state, &state, NULL));
    if (state < 0) fault("a command failed on the device: %s (%d)", cl_status_name(state), state);
    cl_check(waited, "clWaitForEvents");

    LaunchTime time = launch_time_judge(
        event_moment(event, CL_PROFILING_COMMAND_QUEUED), event_moment(event, CL_PROFILING_COMMAND_START),
        event_moment(event, CL_PROFILING_COMMAND_END), host_seconds, event_resolution(event));
    time.host_start_seconds = host_start;
    cl_must(clReleaseEvent(event));
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

// Devices may take a single work-item in a group, and a kernel with many variables fewer than its device.
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

LaunchTime kernel_launch(Compute *compute, cl_kernel kernel, cl_uint dimensions, const size_t *items,
                         const size_t *group)
{
    size_t global[3], local[3];
    for (cl_uint i = 0; i < dimensions; i++) {
        global[i] = items[i];
        local[i] = group ? group[i] : 1;
    }
    if (group) work_group_fit_kernel(compute->device, kernel, dimensions, local);
    for (cl_uint i = 0; i < dimensions; i++)
        global[i] = (items[i] + local[i] - 1) / local[i] * local[i];
    double host_start = clock_seconds();
    cl_event event;
    cl_must(clEnqueueNDRangeKernel(compute->queue, kernel, dimensions, NULL, global, group ? local : NULL, 0,
                                   NULL, &event));
    return event_time(event, host_start);
}
