#include "host/measure/baseline.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const double baseline_tolerance = 1.1;

// The text that glint report writes instead of the host's name.
static const char scrubbed_host[] = "HOST";

// Returns a text, or "" if the value is not a text.
static const char *text_of(const json_t *value)
{
    const char *text = json_string_value(value);
    return text ? text : "";
}

// Returns a count, or 0 if the value is not a count.
static uint32_t count_of(const json_t *value)
{
    double number = json_number_value(value);
    return number >= 0 && number <= UINT32_MAX ? (uint32_t)number : 0;
}

// Returns times in milliseconds as seconds, or an empty series if an element is not a time.
static Series times_of(const json_t *values)
{
    Series times = {0};
    size_t i;
    json_t *value;
    json_array_foreach(values, i, value)
    {
        double seconds = 1e-3 * json_number_value(value);
        if (!(seconds > 0 && seconds < HUGE_VAL)) {
            series_free(&times);
            return times;
        }
        series_add(&times, seconds);
    }
    return times;
}

// Returns 16 hexadecimal digits as a number, or 0 if the value is not such a text.
static uint64_t hash_of(const json_t *value)
{
    enum { HASH_DIGITS = 16 };
    const char *text = text_of(value);
    return strspn(text, "0123456789abcdef") == HASH_DIGITS && text[HASH_DIGITS] == '\0'
               ? strtoull(text, NULL, 16)
               : 0;
}

static double seconds_of(const json_t *summary, const char *member)
{
    return 1e-3 * json_number_value(json_object_get(summary, member));
}

// Returns the summary of the times if there are any, else that of the report.
static Summary summary_of(const Series *times, const json_t *summary)
{
    if (times->count > 0) return series_summarize(times);
    const double median = seconds_of(summary, "median");
    if (!(median > 0 && median < HUGE_VAL)) return (Summary){0};
    return (Summary){.min = seconds_of(summary, "min"),
                     .median = median,
                     .max = seconds_of(summary, "max"),
                     .count = count_of(json_object_get(summary, "runs"))};
}

static BaselineRow row_of(const json_t *run)
{
    const json_t *size = json_object_get(run, "size");
    BaselineRow row = {
        .key =
            {
                .scene = text_of(json_object_get(run, "scene")),
                .scene_hash = hash_of(json_object_get(run, "scene_hash")),
                .precision = text_of(json_object_get(run, "precision")),
                .bvh = text_of(json_object_get(run, "bvh")),
                .variant = json_string_value(json_object_get(run, "variant")),
                .lanes = count_of(json_object_get(run, "lanes")),
                .width = count_of(json_array_get(size, 0)),
                .height = count_of(json_array_get(size, 1)),
                .samples = count_of(json_object_get(run, "samples")),
                .bounces = count_of(json_object_get(run, "bounces")),
            },
        .failure = text_of(json_object_get(run, "reason")),
        .rays_per_second = 1e6 * json_number_value(json_object_get(run, "mrays_per_s")),
        .frame_times = times_of(json_object_get(run, "frame_samples_ms")),
        .processor_times = times_of(json_object_get(run, "processor_samples_ms")),
    };
    row.frame = summary_of(&row.frame_times, json_object_get(run, "frame_ms"));
    Series kernel_times = times_of(json_object_get(run, "kernel_samples_ms"));
    row.kernel = summary_of(&kernel_times, json_object_get(run, "kernel_ms"));
    series_free(&kernel_times);
    return row;
}

static Baseline *baseline_of(json_t *report)
{
    const json_t *device = json_object_get(report, "device"),
                 *calibration = json_object_get(report, "calibration"), *run;
    Baseline *baseline = memory_allocate_zeroed(1, sizeof *baseline);
    *baseline = (Baseline){
        .json = report,
        .calibration =
            {
                .wall = times_of(json_object_get(calibration, "samples_ms")),
                .processor = times_of(json_object_get(calibration, "processor_samples_ms")),
            },
        .is_calibrated = json_number_value(json_object_get(calibration, "rounds")) == CALIBRATION_ROUNDS,
        .date = text_of(json_object_get(report, "date")),
        .version = text_of(json_object_get(report, "glint")),
        .commit = text_of(json_object_get(json_object_get(report, "build"), "commit")),
        .host = text_of(json_object_get(json_object_get(report, "host"), "name")),
        .device = text_of(json_object_get(device, "name")),
        .device_type = text_of(json_object_get(device, "type")),
        .board = text_of(json_object_get(device, "board")),
        .platform = text_of(json_object_get(device, "platform")),
        .driver = text_of(json_object_get(device, "driver")),
    };
    size_t i;
    json_array_foreach(json_object_get(report, "runs"), i, run)
    {
        const BaselineRow row = row_of(run);
        array_push(*baseline, row);
    }
    return baseline;
}

static void *json_allocate(size_t size)
{
    return memory_allocate(size, 1);
}

// Reads a file as JSON. Returns NULL with a message if it is not JSON or cannot be read.
static json_t *json_read(const char *path, MessageList *messages)
{
    Text text = {0};
    json_t *json = NULL;
    json_error_t error;
    // When an allocation fails, jansson 2.14 may lose bytes of a text; memory_allocate ends the process
    // instead.
    json_set_alloc_funcs(json_allocate, free);
    if (text_read_file(&text, path, messages)) {
        json = json_loadb(text_c(&text), text.count, JSON_REJECT_DUPLICATES, &error);
        const Source source = {.file = path, .bytes = text_c(&text), .length = text.count};
        // the position is past the faulty word
        if (!json)
            message_add_at(messages, MESSAGE_ERROR, &source,
                           error.position > 0 ? (size_t)error.position - 1 : 0,
                           "not a report of glint bench --json: %s", error.text);
    }
    text_free(&text);
    return json;
}

static bool schema_check(const char *path, const json_t *report, MessageList *messages)
{
    const json_t *schema = json_object_get(report, "schema");
    if (!json_is_array(json_object_get(report, "runs")) || !json_is_number(schema))
        return message_error(messages, "'%s' is not a report of glint bench --json", path);
    const double version = json_number_value(schema);
    return (version >= BENCH_SCHEMA_OLDEST && version <= BENCH_SCHEMA) ||
           message_error(messages, "'%s' has schema %g, but glint reads %d to %d; re-measure it", path,
                         version, BENCH_SCHEMA_OLDEST, BENCH_SCHEMA);
}

static bool calibration_check(const char *path, const Baseline *baseline, MessageList *messages)
{
    const json_t *rounds = json_object_get(json_object_get(baseline->json, "calibration"), "rounds");
    if (!rounds) return message_error(messages, "'%s' was not calibrated; re-measure it", path);
    return baseline->is_calibrated ||
           message_error(messages, "'%s' was calibrated by %.0f rounds instead of %d; re-measure it", path,
                         json_number_value(rounds), CALIBRATION_ROUNDS);
}

Baseline *baseline_open(const char *path, bool needs_calibration, MessageList *messages)
{
    json_t *report = json_read(path, messages);
    if (!report || !schema_check(path, report, messages)) {
        json_decref(report);
        return NULL;
    }
    Baseline *baseline = baseline_of(report);
    if (!needs_calibration || calibration_check(path, baseline, messages)) return baseline;
    baseline_close(baseline);
    return NULL;
}

void baseline_close(Baseline *baseline)
{
    if (!baseline) return;
    for (size_t i = 0; i < baseline->count; i++) {
        series_free(&baseline->items[i].frame_times);
        series_free(&baseline->items[i].processor_times);
    }
    free(baseline->items);
    calibration_free(&baseline->calibration);
    json_decref(baseline->json);
    free(baseline);
}

bool bench_key_equal(const BenchKey *a, const BenchKey *b)
{
    return a->scene_hash == b->scene_hash && strcmp(a->precision, b->precision) == 0 &&
           strcmp(a->bvh, b->bvh) == 0 &&
           strcmp(a->variant ? a->variant : "", b->variant ? b->variant : "") == 0 && a->lanes == b->lanes &&
           a->width == b->width && a->height == b->height && a->samples == b->samples &&
           a->bounces == b->bounces;
}

bool baseline_find(const Baseline *baseline, const BenchKey *key, ReportTimes *wall, ReportTimes *processor)
{
    for (size_t i = 0; i < baseline->count; i++) {
        const BaselineRow *row = &baseline->items[i];
        if (!bench_key_equal(&row->key, key) || row->frame_times.count == 0) continue;
        *wall = (ReportTimes){&row->frame_times, &baseline->calibration.wall};
        *processor = (ReportTimes){&row->processor_times, &baseline->calibration.processor};
        return true;
    }
    return false;
}

static bool host_is_known(const Baseline *baseline)
{
    return baseline->host[0] != '\0' && strcmp(baseline->host, scrubbed_host) != 0;
}

const char *baselines_why_not_compared(const Baseline *newer, const Baseline *older)
{
    if (strcmp(newer->device, older->device) != 0) return "it was measured on another device";
    if (strcmp(newer->board, older->board) != 0) return "it was measured on another board";
    if (!host_is_known(newer) || !host_is_known(older)) return "the host of one of the reports is unknown";
    if (strcmp(newer->host, older->host) != 0) return "it was measured on another host";
    if (!newer->is_calibrated) return "it has another calibration or none";
    if (!older->is_calibrated) return "the first report has another calibration or none";
    return NULL;
}
