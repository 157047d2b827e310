#include "host/cli/report_json.h"

#include "host/api/version.h"
#include "host/base/array.h"
#include "host/cli/passport_report.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

void text_json(Json *json, const char *key, Text text)
{
    json_text(json, key, text_c(&text));
    text_free(&text);
}

void summary_json(Json *json, const char *key, Summary seconds)
{
    json_begin_object(json, key);
    json_addf(json, "min %g median %g max %g quartile_range %g runs %zu", 1e3 * seconds.min,
              1e3 * seconds.median, 1e3 * seconds.max,
              1e3 * (seconds.upper_quartile - seconds.lower_quartile), seconds.count);
    json_end(json);
}

void unavailable_json(Json *json, const char *reason)
{
    json_addf(json, "status %s reason %s", "unavailable", reason);
}

void missing_json(Json *json, const char *key, const char *reason)
{
    json_begin_object(json, key);
    unavailable_json(json, reason);
    json_end(json);
}

void figure_json(Json *json, const char *key, double scale, Figure figure)
{
    if (figure.why_not)
        missing_json(json, key, figure.why_not);
    else
        json_number(json, key, scale * figure.value);
}

static const char *null_if_empty(const char *text)
{
    return text[0] != '\0' ? text : NULL;
}

// Returns when the device's first command of a list was queued, by the device's clock, or `first` if that is
// earlier. Returns infinity if no time is known.
static double first_queued(double first, const NamedLaunch *commands, size_t count, const Device *device)
{
    for (size_t i = 0; i < count; i++) {
        const LaunchTime *time = &commands[i].time;
        if (time->device == device && time->queued_seconds > 0) first = fmin(first, time->queued_seconds);
    }
    return first;
}

// Returns the origin of a device's times in a report.
static double report_origin(const RenderReport *report, const Device *device)
{
    return first_queued(first_queued(INFINITY, report->launches.items, report->launches.count, device),
                        report->reads.items, report->reads.count, device);
}

void counts_json(Json *json, const char *key, const size_t *counts, size_t count)
{
    json_begin_array(json, key);
    for (size_t i = 0; i < count; i++)
        json_count(json, NULL, counts[i]);
    json_end(json);
}

void numbers_json(Json *json, const char *key, double scale, const double *numbers, size_t count)
{
    json_begin_array(json, key);
    for (size_t i = 0; i < count; i++)
        json_number(json, NULL, scale * numbers[i]);
    json_end(json);
}

void ratio_json(Json *json, const Comparison *comparison)
{
    json_addf(json, "ratio %g low %g high %g", comparison->ratio, comparison->low, comparison->high);
}

void command_json(Json *json, const RenderReport *report, const LaunchTime *time)
{
    const struct {
        const char *key;
        double seconds;
    } moments[] = {{"queued_ms", time->queued_seconds},
                   {"submitted_ms", time->submitted_seconds},
                   {"start_ms", time->start_seconds},
                   {"end_ms", time->end_seconds}};
    const double origin = report_origin(report, time->device);
    for (size_t i = 0; i < COUNT_OF(moments); i++) {
        if (!time->fault && isfinite(origin) && moments[i].seconds > 0)
            json_number(json, moments[i].key, 1e3 * (moments[i].seconds - origin));
        else
            json_none(json, moments[i].key);
    }
    if (time->dimensions == 0) return;
    counts_json(json, "global", time->global, time->dimensions);
    counts_json(json, "local", time->local, time->dimensions);
}

void build_options_json(Json *json, const RenderReport *report)
{
    Text options = {0};
    program_options_append(&options, report->device, report->build_options);
    text_json(json, "build_options", options);
}

void device_identity_json(Json *json, const Device *device)
{
    json_text(json, "board", null_if_empty(device->board));
    json_text(json, "pci", null_if_empty(device->pci));
    json_text(json, "uuid", null_if_empty(device->uuid));
}

static void device_json(Json *json, const Device *device)
{
    json_begin_object(json, "device");
    json_text(json, "name", device->name);
    device_identity_json(json, device);
    json_addf(json, "platform %s platform_version %s driver %s type %s units %u clock_mhz %u",
              device->platform_name, device->platform_version, device->driver, device_type_name(device->type),
              device->compute_units, device->clock_mhz);
    passports_json(json, device);
    json_end(json);
}

Json *report_json_open(unsigned schema, const Device *device)
{
    Json *json = json_open();
    json_addf(json, "schema %u glint %s", schema, glint_version());
    if (device) device_json(json, device);
    return json;
}

void perturb_json(Json *json, uint32_t seed, uint32_t scale)
{
    if (seed > 0) json_addf(json, "perturb {seed %u scale %u}", seed, scale);
}

void times_json(Json *json, const BenchRow *row)
{
    const char *clock_fault = row->times.clock_fault;
    summary_json(json, "frame_ms", series_summarize(&row->times.frame));
    summary_json(json, "kernel_ms", bench_kernel(&row->times));
    json_text(json, "clock", clock_fault ? "host" : "event");
    if (clock_fault) json_text(json, "clock_fault", clock_fault);
}

void rays_json(Json *json, const BenchRow *row)
{
    json_begin_object(json, "rays");
    for (int type = 0; type < RAYS_COUNT; type++)
        json_count(json, bench_ray_names[type], row->rays[type]);
    json_end(json);
    json_number(json, "mrays_per_s", bench_rays_per_second(row) / 1e6);
}
