#include "host/measure/baseline.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <libfyaml.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    char *scene, *precision, *bvh;
    uint32_t lanes, width, height;
    double frame_ms, kernel_ms; // medians
} BaselineRow;

struct Baseline {
    BaselineRow *items;
    size_t count, capacity;
    char *device;
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
    Text copy = {0};
    text_append(&copy, text ? text : "", length);
    char *result = memory_copy_text(text_c(&copy));
    text_free(&copy);
    return result;
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

static void rows_read(Baseline *baseline, struct fy_node *runs)
{
    void *place = NULL;
    for (struct fy_node *run; (run = fy_node_sequence_iterate(runs, &place));) {
        BaselineRow row = {
            .scene = text_of(member(run, "scene")),
            .precision = text_of(member(run, "precision")),
            .bvh = text_of(member(run, "bvh")),
            .lanes = count_of(member(run, "lanes")),
            .width = count_of(element(member(run, "size"), 0)),
            .height = count_of(element(member(run, "size"), 1)),
            .frame_ms = number_of(member(member(run, "frame_ms"), "median")),
            .kernel_ms = number_of(member(member(run, "kernel_ms"), "median")),
        };
        array_push(*baseline, row);
    }
}

static Baseline *baseline_read(struct fy_document *document, const char *path, MessageList *messages)
{
    struct fy_node *root = document ? fy_document_root(document) : NULL;
    struct fy_node *runs = member(root, "runs");
    if (!runs || !fy_node_is_sequence(runs) || number_of(member(root, "schema")) != 3) {
        message_add(messages, MESSAGE_ERROR, "'%s' is no report of glint bench --json with schema 3", path);
        return NULL;
    }
    Baseline *baseline = memory_allocate_zeroed(1, sizeof *baseline);
    baseline->device = text_of(member(member(root, "device"), "name"));
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
        free(baseline->items[i].scene);
        free(baseline->items[i].precision);
        free(baseline->items[i].bvh);
    }
    free(baseline->items);
    free(baseline->device);
    free(baseline);
}

const char *baseline_device(const Baseline *baseline)
{
    return baseline->device;
}

static bool row_matches(const BaselineRow *row, const BenchKey *key)
{
    return strcmp(row->scene, key->scene) == 0 && strcmp(row->precision, key->precision) == 0 &&
           strcmp(row->bvh, key->bvh) == 0 && row->lanes == key->lanes && row->width == key->width &&
           row->height == key->height;
}

Ratio baseline_ratio(const Baseline *baseline, const BenchRow *row)
{
    for (size_t i = 0; i < baseline->count && !row->failure; i++) {
        const BaselineRow *old = &baseline->items[i];
        if (!row_matches(old, &row->key) || !(old->frame_ms > 0) || !(old->kernel_ms > 0)) continue;
        return (Ratio){true, 1e3 * series_summarize(&row->times.frame).median / old->frame_ms,
                       1e3 * bench_kernel(&row->times).median / old->kernel_ms};
    }
    return (Ratio){0};
}
