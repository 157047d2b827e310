#include "host/measure/baseline.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <inttypes.h>
#include <libfyaml.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    char *scene_hash, *precision, *bvh;
    uint32_t lanes, width, height, samples, bounces;
    Series frame;
} BaselineRow;

enum { HASH_DIGITS = 16 };

struct Baseline {
    BaselineRow *items;
    size_t count, capacity;
    char *device, *host;
    Series calibration;
};

static struct fy_node *member(struct fy_node *node, const char *key)
{
    return node && fy_node_is_mapping(node) ? fy_node_mapping_lookup_by_string(node, key, FY_NT) : NULL;
}

// The scalar's text, or "" where there is none. Caller frees.
static char *text_of(struct fy_node *node)
{
    size_t length = 0;
    const char *text = node && fy_node_is_scalar(node) ? fy_node_get_scalar(node, &length) : NULL;
    return memory_copy_part(text ? text : "", length);
}

// 0 where there is no number.
static double number_of(struct fy_node *node)
{
    char *text = text_of(node);
    double number = strtod(text, NULL);
    free(text);
    return number;
}

static uint32_t count_of(struct fy_node *node)
{
    double number = number_of(node);
    return number >= 0 && number <= UINT32_MAX ? (uint32_t)number : 0;
}

static struct fy_node *element(struct fy_node *node, int index)
{
    return node && fy_node_is_sequence(node) ? fy_node_sequence_get_by_index(node, index) : NULL;
}

// Milliseconds become seconds. Empty where an element is no time.
static Series times_of(struct fy_node *node)
{
    Series times = {0};
    void *place = NULL;
    if (!node || !fy_node_is_sequence(node)) return times;
    for (struct fy_node *item; (item = fy_node_sequence_iterate(node, &place));) {
        double seconds = 1e-3 * number_of(item);
        if (!(seconds > 0 && seconds < HUGE_VAL)) {
            series_free(&times);
            return times;
        }
        series_add(&times, seconds);
    }
    return times;
}

static void rows_read(Baseline *baseline, struct fy_node *runs)
{
    void *place = NULL;
    for (struct fy_node *run; (run = fy_node_sequence_iterate(runs, &place));) {
        BaselineRow row = {
            .scene_hash = text_of(member(run, "scene_hash")),
            .precision = text_of(member(run, "precision")),
            .bvh = text_of(member(run, "bvh")),
            .lanes = count_of(member(run, "lanes")),
            .width = count_of(element(member(run, "size"), 0)),
            .height = count_of(element(member(run, "size"), 1)),
            .samples = count_of(member(run, "samples")),
            .bounces = count_of(member(run, "bounces")),
            .frame = times_of(member(run, "frame_samples_ms")),
        };
        array_push(*baseline, row);
    }
}

static Baseline *baseline_read(struct fy_document *document, const char *path, MessageList *messages)
{
    struct fy_node *root = document ? fy_document_root(document) : NULL;
    struct fy_node *runs = member(root, "runs");
    if (!runs || !fy_node_is_sequence(runs) || number_of(member(root, "schema")) != BENCH_SCHEMA) {
        message_error(messages, "'%s' is no report of glint bench --json with schema %d", path, BENCH_SCHEMA);
        return NULL;
    }
    Baseline *baseline = memory_allocate_zeroed(1, sizeof *baseline);
    baseline->device = text_of(member(member(root, "device"), "name"));
    baseline->host = text_of(member(member(root, "host"), "name"));
    baseline->calibration = times_of(member(root, "calibration_ms"));
    rows_read(baseline, runs);
    return baseline;
}

static void diagnostic_ignore(struct fy_diag *diag, void *user, const char *text, size_t length)
{
    (void)diag, (void)user, (void)text, (void)length;
}

Baseline *baseline_open(const char *path, MessageList *messages)
{
    Text text = {0};
    Baseline *baseline = NULL;
    if (text_read_file(&text, path, messages)) {
        struct fy_diag_cfg quiet;
        fy_diag_cfg_default(&quiet);
        quiet.fp = NULL;
        quiet.output_fn = diagnostic_ignore;
        struct fy_diag *diagnostics = fy_diag_create(&quiet);
        struct fy_parse_cfg settings = {.flags = FYPCF_JSON_FORCE, .diag = diagnostics};
        struct fy_document *document = fy_document_build_from_string(&settings, text_c(&text), text.count);
        baseline = baseline_read(document, path, messages);
        if (document) fy_document_destroy(document);
        fy_diag_destroy(diagnostics);
    }
    text_free(&text);
    return baseline;
}

void baseline_close(Baseline *baseline)
{
    if (!baseline) return;
    for (size_t i = 0; i < baseline->count; i++) {
        free(baseline->items[i].scene_hash);
        free(baseline->items[i].precision);
        free(baseline->items[i].bvh);
        series_free(&baseline->items[i].frame);
    }
    free(baseline->items);
    free(baseline->device);
    free(baseline->host);
    series_free(&baseline->calibration);
    free(baseline);
}

const char *baseline_device(const Baseline *baseline)
{
    return baseline->device;
}

const char *baseline_host(const Baseline *baseline)
{
    return baseline->host;
}

bool baseline_find(const Baseline *baseline, const BenchKey *key, ReportTimes *times)
{
    char hash[HASH_DIGITS + 1];
    snprintf(hash, sizeof hash, "%016" PRIx64, key->scene_hash);
    for (size_t i = 0; i < baseline->count; i++) {
        const BaselineRow *row = &baseline->items[i];
        if (strcmp(row->scene_hash, hash) != 0 || strcmp(row->precision, key->precision) != 0 ||
            strcmp(row->bvh, key->bvh) != 0 || row->lanes != key->lanes || row->width != key->width ||
            row->height != key->height || row->samples != key->samples || row->bounces != key->bounces ||
            row->frame.count == 0)
            continue;
        *times = (ReportTimes){&row->frame, &baseline->calibration};
        return true;
    }
    return false;
}
