#include "host/cli/bench_report.h"

#include "host/cli/report_json.h"
#include "host/cli/version.h"
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static bool ratio_is_slower(Ratio ratio, double tolerance)
{
    return ratio.found && (ratio.frame > tolerance || ratio.kernel > tolerance);
}

static Ratio row_ratio(const BenchReport *report, const BenchRow *row)
{
    return report->baseline ? baseline_ratio(report->baseline, row) : (Ratio){0};
}

size_t bench_slower_count(const BenchReport *report, bool *any_common)
{
    size_t count = 0;
    *any_common = false;
    for (size_t i = 0; i < report->count; i++) {
        Ratio ratio = row_ratio(report, &report->rows[i]);
        *any_common |= ratio.found;
        count += ratio_is_slower(ratio, report->tolerance);
    }
    return count;
}

static void peak_print(const BenchReport *report, FILE *stream)
{
    const Peak *peak = report->peak;
    fprintf(stream, "%s, %s %s\n", report->device->name, report->device->platform_name,
            report->device->driver);
    fprintf(stream, "measured peak: %.1f GFLOP/s in float", peak->flops_per_second[0] / 1e9);
    if (peak->flops_per_second[1] > 0) fprintf(stream, ", %.1f in double", peak->flops_per_second[1] / 1e9);
    fprintf(stream, ", %.1f GB/s; by the %s clock\n", peak->bytes_per_second / 1e9,
            peak->by_events ? "device's" : "host's");
}

static void summary_print(FILE *stream, Summary seconds)
{
    fprintf(stream, " %8.2f %8.2f %8.2f", 1e3 * seconds.min, 1e3 * seconds.median, 1e3 * seconds.max);
}

static void figure_print(FILE *stream, int width, int decimals, double scale, Figure figure)
{
    if (figure.why_not)
        fprintf(stream, " %*s", width, "-");
    else
        fprintf(stream, " %*.*f", width, decimals, scale * figure.value);
}

static void launches_print(FILE *stream, const RenderReport *report)
{
    for (size_t i = 0; i < report->launches.count; i++) {
        const LaunchTime *time = &report->launches.items[i].time;
        fprintf(stream, "    %-9s %9.3f ms, by the host %9.3f ms%s%s\n", report->launches.items[i].name,
                1e3 * time->event_seconds, 1e3 * time->host_seconds, time->trusted ? "" : "; ",
                time->trusted ? "" : launch_time_doubt(time));
    }
}

static void row_print(const BenchReport *report, size_t i, FILE *stream)
{
    const BenchRow *row = &report->rows[i];
    fprintf(stream, "  %-6s %5u  %-4s", row->key.precision, row->key.lanes, row->key.bvh);
    if (row->failure) {
        fprintf(stream, "  not available: %s\n", row->failure);
        return;
    }
    const char *doubt = bench_doubt(&row->times);
    summary_print(stream, series_summarize(&row->times.frame));
    summary_print(stream, bench_kernel(&row->times));
    fprintf(stream, "  %-5s %4zu", doubt ? "host" : "event", row->times.frame.count);
    figure_print(stream, 6, 0, 1e3, row->build_cold);
    figure_print(stream, 5, 0, 1e3, row->build_cached);
    fprintf(stream, " %7.1f", bench_rays_per_second(row) / 1e6);
    figure_print(stream, 6, 1, 100, bench_peak_fraction(row, report->peak));
    fprintf(stream, " %6.1f  %016" PRIx64 "\n", 100 * bench_bandwidth_fraction(row, report->peak),
            row->kernel_hash);
    if (doubt) fprintf(stream, "    using the host's clock: %s\n", doubt);
    Ratio ratio = row_ratio(report, row);
    if (ratio.found)
        fprintf(stream, "    ratio to baseline: frame %.3f, kernel %.3f%s\n", ratio.frame, ratio.kernel,
                ratio_is_slower(ratio, report->tolerance) ? "  SLOWER" : "");
    else if (report->baseline)
        fprintf(stream, "    not in the baseline\n");
    if (report->reports && report->reports[i]) launches_print(stream, report->reports[i]);
}

// Reasons for missing figures, each once.
static void reasons_print(const BenchReport *report, FILE *stream)
{
    const char *printed[3] = {NULL};
    for (size_t i = 0; i < report->count; i++) {
        const BenchRow *row = &report->rows[i];
        if (row->failure) continue;
        const char *reasons[3] = {row->build_cold.why_not, row->build_cached.why_not,
                                  bench_peak_fraction(row, report->peak).why_not};
        for (size_t k = 0; k < 3; k++) {
            if (reasons[k] && !printed[k]) fprintf(stream, "-: %s\n", reasons[k]);
            if (reasons[k]) printed[k] = reasons[k];
        }
    }
}

static void rays_print(const BenchRow *row, FILE *stream)
{
    fprintf(stream, "  rays:");
    for (int kind = 0; kind < BENCH_RAY_KINDS; kind++)
        fprintf(stream, "%s %" PRIu64 " %s", kind ? "," : "", row->rays[kind],
                kind == BENCH_CAMERA_HITS ? "of them hit" : bench_ray_names[kind]);
    fputc('\n', stream);
}

static const char table_head[] =
    "                      frame ms                   kernel ms                           build ms\n"
    "                       min   median      max      min   median      max  clock runs   cold  kept"
    " Mrays/s flops% bytes%  kernel\n";

void bench_print_text(const BenchReport *report, FILE *stream)
{
    peak_print(report, stream);
    const char *scene = "";
    for (size_t i = 0; i < report->count; i++) {
        const BenchKey *key = &report->rows[i].key;
        if (strcmp(scene, key->scene) != 0) {
            scene = key->scene;
            fprintf(stream, "\n%s, %ux%u\n", scene, key->width, key->height);
            if (!report->rows[i].failure) rays_print(&report->rows[i], stream);
            fputs(table_head, stream);
        }
        row_print(report, i, stream);
    }
    reasons_print(report, stream);
}

static void report_device_json(Json *json, const BenchReport *report)
{
    const Peak *peak = report->peak;
    json_begin_object(json, "device");
    device_json(json, report->device);
    json_begin_object(json, "peak");
    json_number(json, "gflops_float", peak->flops_per_second[0] / 1e9);
    figure_json(json, "gflops_double", 1e-9,
                (Figure){peak->flops_per_second[1],
                         peak->flops_per_second[1] > 0 ? NULL : "no row computes in double"});
    json_number(json, "gigabytes_per_s", peak->bytes_per_second / 1e9);
    json_text(json, "clock", peak->by_events ? "event" : "host");
    json_end(json);
    json_end(json);
}

static void launches_json(Json *json, const RenderReport *report)
{
    json_begin_array(json, "launches");
    for (size_t i = 0; i < report->launches.count; i++) {
        const LaunchTime *time = &report->launches.items[i].time;
        json_begin_object(json, NULL);
        json_text(json, "name", report->launches.items[i].name);
        figure_json(json, "event_ms", 1e3, (Figure){time->event_seconds, launch_time_doubt(time)});
        json_number(json, "host_ms", 1e3 * time->host_seconds);
        json_end(json);
    }
    json_end(json);
}

static void ratio_json(Json *json, Ratio ratio, double tolerance)
{
    json_begin_object(json, "ratio");
    if (ratio.found) {
        json_number(json, "frame", ratio.frame);
        json_number(json, "kernel", ratio.kernel);
        json_boolean(json, "slower", ratio_is_slower(ratio, tolerance));
    } else {
        unavailable_json(json, "the baseline has no such row");
    }
    json_end(json);
}

static void results_json(Json *json, const BenchReport *report, const BenchRow *row)
{
    hash_json(json, "kernel_hash", row->kernel_hash);
    times_json(json, row);
    json_begin_object(json, "build_ms");
    figure_json(json, "cold", 1e3, row->build_cold);
    figure_json(json, "cached", 1e3, row->build_cached);
    json_end(json);
    rays_json(json, row);
    json_boolean(json, "traverses_bvh", row->traverses_bvh);
    figure_json(json, "peak_fraction", 1, bench_peak_fraction(row, report->peak));
    json_number(json, "bandwidth_fraction", bench_bandwidth_fraction(row, report->peak));
    if (report->baseline) ratio_json(json, row_ratio(report, row), report->tolerance);
}

void bench_print_json(const BenchReport *report)
{
    Json *json = json_open();
    json_integer(json, "schema", 3);
    json_text(json, "glint", glint_version());
    report_device_json(json, report);
    json_begin_array(json, "runs");
    for (size_t i = 0; i < report->count; i++) {
        const BenchRow *row = &report->rows[i];
        json_begin_object(json, NULL);
        json_text(json, "scene", row->key.scene);
        json_text(json, "precision", row->key.precision);
        json_integer(json, "lanes", row->key.lanes);
        json_text(json, "bvh", row->key.bvh);
        size_json(json, row->key.width, row->key.height);
        if (row->failure)
            unavailable_json(json, row->failure);
        else
            results_json(json, report, row);
        if (report->reports && report->reports[i]) launches_json(json, report->reports[i]);
        json_end(json);
    }
    json_print(json, stdout);
}
