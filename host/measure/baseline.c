#include "host/measure/baseline.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/measure/calibration.h"
#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const char *scene_hash, *precision, *bvh;
    const char *variant; // "" if the report has none
    uint32_t lanes, width, height, samples, bounces;
    Series frame, processor;
} BaselineRow;

enum { HASH_DIGITS = 16 };

struct Baseline {
    BaselineRow *items;
    size_t count, capacity;
    json_t *report; // owns the texts of the rows
    Calibration calibration;
};

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

static void rows_read(Baseline *baseline, const json_t *runs)
{
    size_t i;
    json_t *run;
    json_array_foreach(runs, i, run)
    {
        const json_t *size = json_object_get(run, "size");
        BaselineRow row = {
            .scene_hash = text_of(json_object_get(run, "scene_hash")),
            .precision = text_of(json_object_get(run, "precision")),
            .bvh = text_of(json_object_get(run, "bvh")),
            .variant = text_of(json_object_get(run, "variant")),
            .lanes = count_of(json_object_get(run, "lanes")),
            .width = count_of(json_array_get(size, 0)),
            .height = count_of(json_array_get(size, 1)),
            .samples = count_of(json_object_get(run, "samples")),
            .bounces = count_of(json_object_get(run, "bounces")),
            .frame = times_of(json_object_get(run, "frame_samples_ms")),
            .processor = times_of(json_object_get(run, "processor_samples_ms")),
        };
        array_push(*baseline, row);
    }
}

static void *json_allocate(size_t size)
{
    return memory_allocate(size, 1);
}

Baseline *baseline_open(const char *path, MessageList *messages)
{
    Text text = {0};
    if (!text_read_file(&text, path, messages)) {
        text_free(&text);
        return NULL;
    }
    // When an allocation fails, jansson 2.14 may lose bytes of a text; memory_allocate ends the process
    // instead.
    json_set_alloc_funcs(json_allocate, free);
    json_t *report = json_loadb(text_c(&text), text.count, JSON_REJECT_DUPLICATES, NULL);
    text_free(&text);
    const json_t *runs = json_object_get(report, "runs");
    if (!json_is_array(runs) || json_number_value(json_object_get(report, "schema")) != BENCH_SCHEMA) {
        message_error(messages, "'%s' is not a report of glint bench --json with schema %d", path,
                      BENCH_SCHEMA);
        json_decref(report);
        return NULL;
    }
    const json_t *calibration = json_object_get(report, "calibration");
    const double rounds = json_number_value(json_object_get(calibration, "rounds"));
    if (rounds != CALIBRATION_ROUNDS) {
        message_error(messages, "'%s' was calibrated by %.0f rounds instead of %d; re-measure it", path,
                      rounds, CALIBRATION_ROUNDS);
        json_decref(report);
        return NULL;
    }
    Baseline *baseline = memory_allocate_zeroed(1, sizeof *baseline);
    baseline->report = report;
    baseline->calibration = (Calibration){
        .wall = times_of(json_object_get(calibration, "samples_ms")),
        .processor = times_of(json_object_get(calibration, "processor_samples_ms")),
    };
    rows_read(baseline, runs);
    return baseline;
}

void baseline_close(Baseline *baseline)
{
    if (!baseline) return;
    for (size_t i = 0; i < baseline->count; i++) {
        series_free(&baseline->items[i].frame);
        series_free(&baseline->items[i].processor);
    }
    free(baseline->items);
    calibration_free(&baseline->calibration);
    json_decref(baseline->report);
    free(baseline);
}

const char *baseline_device(const Baseline *baseline)
{
    return text_of(json_object_get(json_object_get(baseline->report, "device"), "name"));
}

const char *baseline_board(const Baseline *baseline)
{
    return text_of(json_object_get(json_object_get(baseline->report, "device"), "board"));
}

const char *baseline_host(const Baseline *baseline)
{
    return text_of(json_object_get(json_object_get(baseline->report, "host"), "name"));
}

bool baseline_find(const Baseline *baseline, const BenchKey *key, ReportTimes *wall, ReportTimes *processor)
{
    char hash[HASH_DIGITS + 1];
    snprintf(hash, sizeof hash, "%016" PRIx64, key->scene_hash);
    for (size_t i = 0; i < baseline->count; i++) {
        const BaselineRow *row = &baseline->items[i];
        if (strcmp(row->scene_hash, hash) != 0 || strcmp(row->precision, key->precision) != 0 ||
            strcmp(row->bvh, key->bvh) != 0 || strcmp(row->variant, key->variant ? key->variant : "") != 0 ||
            row->lanes != key->lanes || row->width != key->width || row->height != key->height ||
            row->samples != key->samples || row->bounces != key->bounces || row->frame.count == 0)
            continue;
        *wall = (ReportTimes){&row->frame, &baseline->calibration.wall};
        *processor = (ReportTimes){&row->processor, &baseline->calibration.processor};
        return true;
    }
    return false;
}
