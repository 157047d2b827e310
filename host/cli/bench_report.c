#include "host/cli/bench_report.h"

#include "host/api/version.h"
#include "host/cli/passport_report.h"
#include "host/cli/report_json.h"
#include "host/measure/baseline.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

const ResultTable bench_table = {
    .command = "bench",
    .rows = "runs",
    .names = {"scene", "size", "precision", "lanes", "BVH=bvh", "samples", "bounces", "variant"},
    .values = {"frame ms=frame_ms.median", "min=frame_ms.min", "max=frame_ms.max",
               "kernel ms=kernel_ms.median", "kernel min=kernel_ms.min", "kernel max=kernel_ms.max",
               "old frame ms=against_frame_ms.median", "processor ms=processor_ms", "runs=frame_ms.runs",
               "Mrays/s=mrays_per_s", "cold build ms=build_ms.cold", "cached build ms=build_ms.cached",
               "mJ=energy.frame_mj", "ratio to first=to_first"},
    .extras = {"clock", "drift=drift.verdict", "verdict=comparison.verdict", "new over old=comparison",
               "kernel=kernel_hash", "reason"},
    .verdicts = {"comparison.verdict"},
    .failed = "slower",
    .times = "frame_samples_ms",
    .processor_times = "processor_samples_ms",
};

static void launches_append(Text *notes, const RenderReport *report)
{
    for (size_t i = 0; i < report->launches.count; i++) {
        const LaunchTime *time = &report->launches.items[i].time;
        text_appendf(notes, "    %-9s %9.3f ms on the device, %9.3f ms by the host's clock%s%s\n",
                     report->launches.items[i].name, 1e3 * time->event_seconds, 1e3 * time->host_seconds,
                     time->fault ? "; " : "", time->fault ? time->fault : "");
    }
}

// Returns the report of a row's last run, or NULL if the row was not measured.
static const RenderReport *run_report(const BenchReport *report, size_t i)
{
    const Renderer *renderer = report->set->variants[i].renderer;
    return renderer ? renderer_report(renderer) : NULL;
}

// Returns whether a measured row is compared with one of the first --variant, if that was measured.
static bool has_first(const BenchReport *report, size_t i)
{
    return report->set->variants[i].choice > 0 && !report->set->rows[i].failure;
}

static const char first_unavailable[] = "the first variant's row is not available";

// Compares a row with that of the first variant. Returns false if that is not available.
static bool first_compare(const BenchReport *report, size_t i, Comparison *comparison)
{
    const BenchRow *row = &report->set->rows[i],
                   *first = &report->set->rows[variant_set_first(report->set, i)];
    const double tolerance = 1; // for a verdict, which is not reported
    if (!first->failure)
        *comparison =
            comparison_of_rounds(&row->times.frame, &first->times.frame, report->set->count, tolerance);
    return !first->failure;
}

static Comparison row_drift(const BenchReport *report, const BenchRow *row)
{
    return bench_drift(&row->times, report->device->type & CL_DEVICE_TYPE_CPU, report->set->count);
}

// Warns if the device's speed changed while it was measured.
static void drift_append(Text *notes, const Comparison *drift)
{
    if (drift->verdict != VERDICT_SLOWER && drift->verdict != VERDICT_FASTER) return;
    text_appendf(
        notes,
        "    the last fifth of the runs took %.3f (%.3f to %.3f) times as long as the first: the device %s\n",
        drift->ratio, drift->low, drift->high,
        drift->verdict == VERDICT_SLOWER ? "may be throttled or shared"
                                         : "may have been cold or shared at first");
}

static void rays_append(Text *notes, const uint64_t *rays)
{
    text_appendf(notes, "    rays:");
    for (int type = 0; type < RAYS_COUNT; type++)
        text_appendf(notes, "%s %" PRIu64 " %s", type ? "," : "", rays[type],
                     type == RAYS_CAMERA_HITS ? "of them hit" : bench_ray_names[type]);
    text_appendf(notes, "\n");
}

// Returns whether a row's ray counts differ from those of the preceding measured row of its scene.
static bool has_other_rays(const VariantSet *set, size_t row)
{
    const BenchRow *rows = set->rows;
    for (size_t i = row; i-- > 0 && strcmp(rows[i].key.scene, rows[row].key.scene) == 0;)
        if (!rows[i].failure) return memcmp(rows[i].rays, rows[row].rays, sizeof rows[row].rays) != 0;
    return true;
}

static void bench_notes(const void *context, size_t i, Text *notes)
{
    const BenchReport *report = context;
    const BenchRow *row = &report->set->rows[i];
    if (row->failure) return;
    const char *clock_fault = row->times.clock_fault;
    if (has_other_rays(report->set, i)) rays_append(notes, row->rays);
    if (clock_fault) text_appendf(notes, "    using the host's clock: %s\n", clock_fault);
    if (row->energy.source)
        text_appendf(notes, "    %.3g W, by %s\n", row->energy.joules / row->energy.seconds,
                     row->energy.source);
    const Comparison drift = row_drift(report, row);
    drift_append(notes, &drift);
    if (report->comparisons) comparison_append(notes, &report->comparisons[i]);
    if (has_first(report, i) && report->set->rows[variant_set_first(report->set, i)].failure)
        text_appendf(notes, "    not compared, because %s\n", first_unavailable);
    const RenderReport *last = run_report(report, i);
    OwnedText abnormal = {0};
    if (last->device->passports != report->device->passports) passports_abnormal(last->device, &abnormal);
    for (const char *line = text_c(&abnormal); *line; line += strspn(line, "\n")) {
        const int length = (int)strcspn(line, "\n");
        text_appendf(notes, "    %.*s\n", length, line);
        line += length;
    }
    if (report->lists_launches) launches_append(notes, last);
}

static void launches_json(Json *json, const RenderReport *report)
{
    json_begin_array(json, "launches");
    for (size_t i = 0; i < report->launches.count; i++) {
        const LaunchTime *time = &report->launches.items[i].time;
        json_begin_object(json, NULL);
        json_text(json, "name", report->launches.items[i].name);
        figure_json(json, "event_ms", 1e3, (Figure){time->event_seconds, time->fault});
        json_number(json, "host_ms", 1e3 * time->host_seconds);
        command_json(json, report, time);
        json_end(json);
    }
    json_end(json);
}

void samples_json(Json *json, const char *key, const Series *seconds)
{
    numbers_json(json, key, 1e3, seconds->items, seconds->count);
}

Json *bench_json_open(const Device *device)
{
    Json *json = report_json_open(BENCH_SCHEMA, device);
    time_t now = time(NULL);
    struct tm utc;
    struct utsname host = {0};
    char date[32] = "";
    if (gmtime_r(&now, &utc)) strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", &utc);
    uname(&host);
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    json_addf(
        json,
        "date %s host {name %s system %s release %s machine %s processors %zu} build {commit %s compiler %s}",
        date, host.nodename, host.sysname, host.release, host.machine,
        (size_t)(processors > 0 ? processors : 0), glint_commit(), glint_compiler());
    return json;
}

void key_json(Json *json, const BenchKey *key)
{
    json_addf(json,
              "scene %s scene_hash %016" PRIx64
              " precision %s lanes %u bvh %s size [%u %u] samples %u bounces %u",
              key->scene, key->scene_hash, key->precision, key->lanes, key->bvh, key->width, key->height,
              key->samples, key->bounces);
    if (key->variant) json_text(json, "variant", key->variant);
}

static void first_json(Json *json, const BenchReport *report, size_t i)
{
    Comparison to_first;
    json_begin_object(json, "to_first");
    if (first_compare(report, i, &to_first))
        ratio_json(json, &to_first);
    else
        unavailable_json(json, first_unavailable);
    json_end(json);
}

static void energy_json(Json *json, const BenchEnergy *energy)
{
    json_begin_object(json, "energy");
    if (energy->source)
        json_addf(json, "source %s frame_mj %g watts %g", energy->source, 1e3 * energy->joules,
                  energy->joules / energy->seconds);
    else
        unavailable_json(json, energy->why_not);
    json_end(json);
}

static void results_json(Json *json, const BenchReport *report, size_t i)
{
    const BenchRow *row = &report->set->rows[i];
    json_addf(json, "kernel_hash %016" PRIx64, row->kernel_hash);
    build_options_json(json, run_report(report, i));
    times_json(json, row);
    json_number(json, "processor_ms", 1e3 * series_summarize(&row->times.processor).median);
    samples_json(json, "frame_samples_ms", &row->times.frame);
    samples_json(json, "kernel_samples_ms", row->times.clock_fault ? &row->times.host : &row->times.event);
    samples_json(json, "processor_samples_ms", &row->times.processor);
    json_begin_object(json, "drift");
    const Comparison drift = row_drift(report, row);
    verdict_json(json, &drift, drift.verdict);
    json_end(json);
    energy_json(json, &row->energy);
    json_begin_object(json, "build_ms");
    figure_json(json, "cold", 1e3, row->build_cold);
    figure_json(json, "cached", 1e3, row->build_cached);
    json_end(json);
    rays_json(json, row);
    json_bool(json, "traverses_bvh", row->traverses_bvh);
    if (has_first(report, i)) first_json(json, report, i);
    const Device *device = run_report(report, i)->device;
    if (device->passports != report->device->passports) passports_json(json, device);
    if (report->comparisons) comparison_json(json, &report->comparisons[i]);
}

static Json *bench_json(const BenchReport *report)
{
    Json *json = bench_json_open(report->device);
    json_begin_object(json, "calibration");
    json_count(json, "rounds", CALIBRATION_ROUNDS);
    samples_json(json, "samples_ms", &report->set->calibration.wall);
    samples_json(json, "processor_samples_ms", &report->set->calibration.processor);
    json_end(json);
    json_begin_array(json, "runs");
    for (size_t i = 0; i < report->set->count; i++) {
        const BenchRow *row = &report->set->rows[i];
        json_begin_object(json, NULL);
        key_json(json, &row->key);
        if (row->failure)
            unavailable_json(json, row->failure);
        else
            results_json(json, report, i);
        if (report->lists_launches && run_report(report, i)) launches_json(json, run_report(report, i));
        json_end(json);
    }
    json_end(json);
    return json;
}

bool bench_print(const BenchReport *report, const ReportOptions *options)
{
    if (report_has_text(options)) device_heading_print(report->device, stdout);
    return report_output(bench_json(report), options, bench_notes, report);
}
