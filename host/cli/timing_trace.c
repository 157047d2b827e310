// The format is that of "Trace Event Format" (Google, 2016): complete events, with times in microseconds.
#include "host/cli/timing_trace.h"

#include "host/api/version.h"
#include "host/cli/report_json.h"
#include <math.h>
#include <stdlib.h>

// Perfetto treats the thread with its process's number, and thread 0, as the main thread.
enum { PROCESS = 1, HOST_THREAD = PROCESS, THREADS_OF_DEVICE = 4 };

static void event_begin(Json *json, const char *phase, const char *name, size_t thread)
{
    json_begin_object(json, NULL);
    json_addf(json, "ph %s name %s pid %u tid %zu", phase, name, (unsigned)PROCESS, thread);
}

static void thread_name(Json *json, size_t thread, const char *name)
{
    event_begin(json, "M", "thread_name", thread);
    json_addf(json, "args {name %s}", name);
    json_end(json);
}

// Begins a complete event. The caller adds its "args" and ends it.
static void span_begin(Json *json, const char *name, size_t thread, double start_seconds, double seconds)
{
    event_begin(json, "X", name, thread);
    json_addf(json, "ts %g dur %g", 1e6 * start_seconds, 1e6 * seconds);
}

static double host_end(const LaunchTime *time)
{
    return time->host_start_seconds + time->host_seconds;
}

// The commands of a device, from both lists of its report.
typedef struct {
    const NamedLaunch *lists[2];
    size_t counts[2];
    const Device *device;
    // Added to the device's clock, this gives the host's. The host never observes a command's end before it
    // happens, so the smallest difference is the best estimate.
    double device_to_host;
} Commands;

static Commands commands_of(const RenderReport *report, const Device *device)
{
    Commands commands = {.lists = {report->launches.items, report->reads.items},
                         .counts = {report->launches.count, report->reads.count},
                         .device = device,
                         .device_to_host = INFINITY};
    for (size_t list = 0; list < 2; list++)
        for (size_t i = 0; i < commands.counts[list]; i++) {
            const LaunchTime *time = &commands.lists[list][i].time;
            if (time->device == device && !time->fault)
                commands.device_to_host = fmin(commands.device_to_host, host_end(time) - time->end_seconds);
        }
    return commands;
}

// Adds a command, timed by the device's clock if it is trusted, else from the call to the end of the wait.
static void command_add(Json *json, const Commands *commands, const NamedLaunch *command, size_t thread,
                        double origin)
{
    const LaunchTime *time = &command->time;
    const double to_origin = commands->device_to_host - origin;
    const double start =
        time->fault ? time->host_start_seconds : time->start_seconds + commands->device_to_host;
    span_begin(json, command->name, thread, start - origin,
               time->fault ? time->host_seconds : time->event_seconds);
    json_begin_object(json, "args");
    json_addf(json, "clock %s called_us %g", time->fault ? "host" : "event",
              1e6 * (time->host_start_seconds - origin));
    if (!time->fault)
        json_addf(json, "queued_us %g submitted_us %g", 1e6 * (time->queued_seconds + to_origin),
                  1e6 * (time->submitted_seconds + to_origin));
    if (time->dimensions > 0) counts_json(json, "work_items", time->global, time->dimensions);
    json_end(json);
    json_end(json);
}

static void spans_add(Json *json, const char *verb, const HostSpan *spans, size_t count, size_t thread,
                      double origin)
{
    for (size_t i = 0; i < count; i++) {
        OWNED char *name = text_format("%s%s", verb, spans[i].name);
        span_begin(json, name, thread, spans[i].start_seconds - origin,
                   spans[i].end_seconds - spans[i].start_seconds);
        json_end(json);
    }
}

static void device_add(Json *json, const RenderReport *report, size_t thread, double origin)
{
    const Device *devices[] = {report->device, report->reference_device};
    OWNED char *name = text_format("bands of %s", report->device->name);
    thread_name(json, thread, name);
    spans_add(json, "", report->bands.items, report->bands.count, thread, origin);
    thread_name(json, thread + 1, "builds");
    spans_add(json, "building ", report->builds.items, report->builds.count, thread + 1, origin);
    for (size_t k = 0; k < 2 && devices[k]; k++) {
        const Commands commands = commands_of(report, devices[k]);
        thread_name(json, thread + 2 + k, devices[k]->name);
        for (size_t list = 0; list < 2; list++)
            for (size_t i = 0; i < commands.counts[list]; i++)
                if (commands.lists[list][i].time.device == devices[k])
                    command_add(json, &commands, &commands.lists[list][i], thread + 2 + k, origin);
    }
}

void timing_trace_print(Renderer *const *renderers, size_t count, const Stage *stage)
{
    size_t span_count;
    const HostSpan *spans = stage_spans(stage, &span_count);
    const double origin = span_count > 0 ? spans[0].start_seconds : 0;
    bool is_from_cache = true;
    for (size_t i = 0; i < count; i++)
        is_from_cache &= renderer_report(renderers[i])->build_from_cache;
    Json *json = json_open();
    json_addf(json, "displayTimeUnit %s otherData {schema %u glint %s kernels_from_cache %d}", "ms", 1U,
              glint_version(), is_from_cache);
    json_begin_array(json, "traceEvents");
    thread_name(json, HOST_THREAD, "host");
    spans_add(json, "", spans, span_count, HOST_THREAD, origin);
    for (size_t i = 0; i < count; i++)
        device_add(json, renderer_report(renderers[i]), HOST_THREAD + 1 + THREADS_OF_DEVICE * i, origin);
    json_end(json);
    json_print(json, stdout);
}
