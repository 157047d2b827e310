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
    .values = {"frame ms=frame_ms.median", "least=frame_ms.min", "most=frame_ms.max",
               "kernel ms=kernel_ms.median", "clock", "processor ms=processor_ms", "runs=frame_ms.runs",
               "Mrays/s=mrays_per_s", "build ms=build_ms.cold", "mJ=energy.frame_mj", "drift=drift.verdict",
               "to first=to_first.ratio", "verdict=comparison.verdict", "new over old=comparison.ratio"},
    .verdicts = {"comparison.verdict"},
    .failed = "slower",
    .times = "frame_samples_ms",
    .processor_times = "processor_samples_ms",
};

static void summary_print(FILE *stream, Summary seconds)
{
    fprintf(stream, " %8.2f %8.2f %8.2f", 1e3 * seconds.min, 1e3 * seconds.median, 1e3 * seconds.max);
}

static void milliseconds_print(FILE *stream, int width, Figure seconds)
{
    if (seconds.why_not)
        fprintf(stream, " %*s", width, "-");
    else
        fprintf(stream, " %*.0f", width, 1e3 * seconds.value);
}

static void launches_print(FILE *stream, const RenderReport *report)
{
    for (size_t i = 0; i < report->launches.count; i++) {
        const LaunchTime *time = &report->launches.items[i].time;
        fprintf(stream, "    %-9s %9.3f ms, by the host %9.3f ms%s%s\n", report->launches.items[i].name,
                1e3 * time->event_seconds, 1e3 * time->host_seconds, time->fault ? "; " : "",
                time->fault ? time->fault : "");
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

static void variant_print(const BenchReport *report, size_t i, FILE *stream)
{
    const char *variant = report->set->rows[i].key.variant;
    Comparison comparison;
    if (!variant) return;
    fprintf(stream, "    %s", variant[0] ? variant : "(no options)");
    if (has_first(report, i)) {
        if (first_compare(report, i, &comparison)) {
            fprintf(stream, ": %.3f", comparison.ratio);
            if (isfinite(comparison.high))
                fprintf(stream, " (%.3f to %.3f)", comparison.low, comparison.high);
            fputs(" times the first variant's frame time", stream);
        } else {
            fprintf(stream, ": not compared, because %s", first_unavailable);
        }
    }
    fputc('\n', stream);
}

static Comparison row_drift(const BenchReport *report, const BenchRow *row)
{
    return bench_drift(&row->times, report->device->type & CL_DEVICE_TYPE_CPU, report->set->count);
}

// Warns if the device's speed changed while it was measured.
static void drift_print(const BenchReport *report, const BenchRow *row, FILE *stream)
{
    const Comparison drift = row_drift(report, row);
    if (drift.verdict != VERDICT_SLOWER && drift.verdict != VERDICT_FASTER) return;
    fprintf(
        stream,
        "    the last fifth of the runs took %.3f (%.3f to %.3f) times as long as the first: the device %s\n",
        drift.ratio, drift.low, drift.high,
        drift.verdict == VERDICT_SLOWER ? "may be throttled or shared"
                                        : "may have been cold or shared at first");
}

static void row_print(const BenchReport *report, size_t i, FILE *stream)
{
    const BenchRow *row = &report->set->rows[i];
    fprintf(stream, "  %-9s %5u  %-4s", row->key.precision, row->key.lanes, row->key.bvh);
    if (row->failure) {
        fprintf(stream, "  not available: %s\n", row->failure);
        variant_print(report, i, stream);
        return;
    }
    const char *clock_fault = row->times.clock_fault;
    summary_print(stream, series_summarize(&row->times.frame));
    summary_print(stream, bench_kernel(&row->times));
    fprintf(stream, "  %-5s %4zu", clock_fault ? "host" : "event", row->times.frame.count);
    milliseconds_print(stream, 6, row->build_cold);
    milliseconds_print(stream, 5, row->build_cached);
    fprintf(stream, " %7.1f  %016" PRIx64 "\n", bench_rays_per_second(row) / 1e6, row->kernel_hash);
    variant_print(report, i, stream);
    if (clock_fault) fprintf(stream, "    using the host's clock: %s\n", clock_fault);
    if (row->energy.source)
        fprintf(stream, "    %.3g mJ per frame, %.3g W, by %s\n", 1e3 * row->energy.joules,
                row->energy.joules / row->energy.seconds, row->energy.source);
    drift_print(report, row, stream);
    if (report->comparisons) comparison_print(&report->comparisons[i], stream);
    const RenderReport *last = run_report(report, i);
    if (last->device->passports != report->device->passports) passports_remark(last->device, stream);
    if (report->lists_launches) launches_print(stream, last);
}

// Prints the reasons for missing figures, each once.
static void reasons_print(const BenchReport *report, FILE *stream)
{
    const char *printed[2] = {NULL};
    for (size_t i = 0; i < report->set->count; i++) {
        const BenchRow *row = &report->set->rows[i];
        if (row->failure) continue;
        const char *reasons[2] = {row->build_cold.why_not, row->build_cached.why_not};
        for (size_t k = 0; k < 2; k++) {
            if (reasons[k] && !printed[k] && reasons[k] != printed[0]) fprintf(stream, "-: %s\n", reasons[k]);
            if (reasons[k]) printed[k] = reasons[k];
        }
    }
}

static void rays_print(const uint64_t *rays, const char *indent, FILE *stream)
{
    fprintf(stream, "%srays:", indent);
    for (int type = 0; type < RAYS_COUNT; type++)
        fprintf(stream, "%s %" PRIu64 " %s", type ? "," : "", rays[type],
                type == RAYS_CAMERA_HITS ? "of them hit" : bench_ray_names[type]);
    fputc('\n', stream);
}

static const char table_head[] =
    "                                 frame ms                  kernel ms                          build ms\n"
    "  precision lanes  bvh       min   median      max      min   median      max  clock runs   cold  kept"
    " Mrays/s  kernel\n";

void bench_print_text(const BenchReport *report, FILE *stream)
{
    device_heading_print(report->device, stream);
    const char *scene = "";
    const uint64_t *rays = NULL; // those last printed of the scene
    for (size_t i = 0; i < report->set->count; i++) {
        const BenchRow *row = &report->set->rows[i];
        if (strcmp(scene, row->key.scene) != 0) {
            scene = row->key.scene;
            fprintf(stream, "\n%s, %ux%u\n", scene, row->key.width, row->key.height);
            rays = row->failure ? NULL : row->rays;
            if (rays) rays_print(rays, "  ", stream);
            fputs(table_head, stream);
        }
        row_print(report, i, stream);
        if (row->failure || (rays && memcmp(rays, row->rays, sizeof row->rays) == 0)) continue;
        rays = row->rays;
        rays_print(rays, "    ", stream);
    }
    reasons_print(report, stream);
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

Json *bench_json(const BenchReport *report)
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
