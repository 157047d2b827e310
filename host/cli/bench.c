// glint bench times scenes in every requested configuration, interleaved.
#include "host/base/exit_status.h"
#include "host/base/memory.h"
#include "host/cli/bench_against.h"
#include "host/cli/bench_report.h"
#include "host/cli/commands.h"
#include "host/cli/open_device.h"
#include "host/cli/variants.h"
#include "host/measure/baseline.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>

typedef struct {
    VariantOptions variants;
    CommandOperands scenes;
    double tolerance; // 0 if not given
    const char *baseline, *against;
    bool launches, is_worker;
    OptionTexts variant_texts;
    // The memory of each --variant's words, and the options that they set.
    char *variant_words[OPTION_TEXTS_MAX];
    VariantOptions variant_options[OPTION_TEXTS_MAX];
} BenchOptions;

static const Option precisions_option[] = {PRECISIONS_OPTION("single")};

typedef struct {
    VariantOptions options;
    CommandOperands operands; // there must be none
} VariantLine;

// The options that --variant accepts.
static const CommandLine variant_line = {
    .groups = {OPTIONS(precisions_option), OPTIONS(variant_choice_options), OPTION(ray_options[RAY_BOUNCES]),
               OPTIONS(driver_options)},
    OPERANDS(ANY, VariantLine, operands)};

// Splits a text in place at blanks outside of quotes and removes the quotes, ' or ". Adds each word to
// `words`. Returns false if a quote is not closed.
static bool words_split(char *text, char **words, int *count)
{
    char quote = '\0', *end = text; // `end` is the end of the words so far
    bool is_within = false;
    for (const char *at = text; *at != '\0'; at++) {
        const bool is_blank = !quote && isspace((unsigned char)*at);
        if (!is_blank && !is_within) words[(*count)++] = end;
        if (is_blank && is_within) *end++ = '\0';
        is_within = !is_blank;
        if (is_blank) continue;
        if (*at == quote)
            quote = '\0';
        else if (!quote && (*at == '\'' || *at == '"'))
            quote = *at;
        else
            *end++ = *at;
    }
    *end = '\0';
    return !quote;
}

// Reads a variant's options from its words. The first word is the prefix of getopt's messages.
static bool words_read(VariantOptions *variant, char **words, int count)
{
    VariantLine line = {.options = *variant};
    if (command_line_read(&variant_line, &line, count, words) != OPTIONS_READ) return false;
    *variant = line.options;
    if (line.operands.count == 0) return true;
    return stderr_print("--variant: expected options, not \"%s\"", line.operands.items[0]);
}

static bool variant_read(BenchOptions *options, size_t index)
{
    static char name[] = "glint bench --variant";
    const char *text = options->variant_texts.items[index];
    VariantOptions *variant = &options->variant_options[index];
    *variant = options->variants;
    variant->name = text;
    options->variant_words[index] = memory_copy_text(text);
    OWNED char **words = memory_allocate_zeroed(strlen(text) / 2 + 3, sizeof *words);
    words[0] = name;
    int count = 1;
    const bool is_split = words_split(options->variant_words[index], words, &count);
    if (!is_split) stderr_print("--variant: a quote is not closed");
    const bool is_valid = is_split && words_read(variant, words, count);
    if (!is_valid) stderr_print("the error is in --variant \"%s\"", text);
    return is_valid;
}

// Reads the variants, which start from the options of all rows.
static bool variants_read(const Option *option, void *bench_options)
{
    BenchOptions *options = bench_options;
    (void)option;
    for (size_t i = 0; i < options->variant_texts.count; i++) {
        for (size_t k = 0; k < i; k++)
            if (strcmp(options->variant_texts.items[i], options->variant_texts.items[k]) == 0)
                return stderr_print("--variant \"%s\" is given twice", options->variant_texts.items[i]);
        if (!variant_read(options, i)) return false;
    }
    return true;
}

static const Option command_options[] = {
    {"against", "GLINT", "compare with another build, run alternately (default of --seconds: 30 per row)",
     option_text, offsetof(BenchOptions, against)},
    {"compare", "FILE", "compare with an earlier report (--json); less conclusive than --against",
     option_text, offsetof(BenchOptions, baseline)},
    {"tolerance", "R",
     "ratio of times up to which rows are the same (default: 1.02 with --against, 1.1 with --compare)",
     option_number, offsetof(BenchOptions, tolerance), NUMBERS(1, INFINITY)},
    {"worker", NULL, "serve another glint's --against", option_flag, offsetof(BenchOptions, is_worker)},
    {"launches", NULL, "list the kernel launches of each row's last run", option_flag,
     offsetof(BenchOptions, launches)},
    {"no-build-times", NULL, "take kernels from the cache instead of timing their builds", option_flag,
     offsetof(BenchOptions, variants.no_build_times)},
    {"variant", "OPTIONS",
     "add rows with these options, such as \"--lanes 8 --work-group 8x8\"; any of --precision, --lanes, "
     "--bvh, "
     "--samples, --bounces, --work-group and --build-options; may be repeated. A row is compared with the "
     "first variant's row of the same precision, lanes, BVH and samples, unless the variants differ in these",
     option_texts, offsetof(BenchOptions, variant_texts), .effect = variants_read}};

static const char *options_check(void *bench_options)
{
    const BenchOptions *options = bench_options;
    if (options->against && options->baseline) return "--against cannot be combined with --compare";
    for (size_t i = 0; options->against && i < options->scenes.count; i++)
        if (strcmp(options->scenes.items[i], "-") == 0)
            return "--against reads each scene several times, so it cannot be '-'";
    return NULL;
}

static const CommandLine command_line = {
    .command = "bench",
    .usage =
        "usage: glint bench SCENE... [OPTIONS]\n\n"
        "Benchmarks scenes in every requested configuration, interleaved. Exit status of a comparison: 0 "
        "same or faster,\n3 slower, 4 too noisy to decide.\n",
    .groups = {OPTIONS(command_options), OPTIONS(precisions_option), VARIANT_OPTIONS, OPTIONS(driver_options),
               OPTIONS(keep_kernels_option), TIMED_REPORT_OPTIONS},
    OPERANDS(SCENES, BenchOptions, scenes),
    .check = options_check};

typedef struct {
    BenchOptions options;
    OpenDevice open;
    VariantSet set;
} Bench;

// Returns whether the device allows the work-groups of all variants, and prints an error if not.
static bool work_groups_are_allowed(const Bench *bench)
{
    for (size_t i = 0; i < bench->set.count; i++) {
        const Device device = variant_device(bench->open.compute.device, &bench->set.variants[i]);
        if (bench->set.variants[i].work_group[0] > 0 && !work_group_is_allowed(&device)) return false;
    }
    return true;
}

static bool is_any_certified(const VariantSet *set)
{
    for (size_t i = 0; i < set->count; i++)
        if (set->variants[i].settings.precision == PRECISION_CERTIFIED) return true;
    return false;
}

static const double against_tolerance = 1.02, against_seconds = 30;

// Compares every row with the baseline's. The caller frees the result.
static RowComparison *rows_compare(const Bench *bench, const Baseline *baseline)
{
    const VariantSet *set = &bench->set;
    const double tolerance = bench->options.tolerance > 0 ? bench->options.tolerance : baseline_tolerance;
    RowComparison *comparisons = memory_allocate_zeroed(set->count, sizeof *comparisons);
    for (size_t i = 0; i < set->count; i++) {
        const BenchRow *row = &set->rows[i];
        RowTimes older, newer = {{&row->times.frame, &set->calibration.wall},
                                 {&row->times.processor, &set->calibration.processor}};
        if (!row->failure && baseline_find(baseline, &row->key, &older.wall, &older.processor))
            comparisons[i] = row_compare(
                &newer, &older, bench->open.compute.device->type & CL_DEVICE_TYPE_CPU, set->count, tolerance);
        else
            comparisons[i].why_not = "the baseline has no such row";
    }
    return comparisons;
}

// Warns if the baseline was measured elsewhere.
static void baseline_warn(const Baseline *baseline, const Device *device)
{
    const char *board = baseline->board;
    struct utsname host = {0};
    uname(&host);
    if (strcmp(baseline->device, device->name) != 0)
        stderr_print("the baseline was measured on another device, \"%s\"", baseline->device);
    else if (board[0] != '\0' && strcmp(board, device->board) != 0)
        stderr_print("the baseline was measured on another board, \"%s\"", board);
    if (strcmp(baseline->host, host.nodename) != 0)
        stderr_print("the baseline was measured on another host, \"%s\"", baseline->host);
}

static int bench_report(const Bench *bench, const Baseline *baseline)
{
    const BenchOptions *options = &bench->options;
    const VariantSet *set = &bench->set;
    OWNED RowComparison *comparisons = baseline ? rows_compare(bench, baseline) : NULL;
    const Device *device = bench->open.compute.device;
    BenchReport report = {
        .device = device,
        .set = set,
        .lists_launches = options->launches,
        .comparisons = comparisons,
    };
    const ReportOptions *format = &options->variants.common.report;
    const bool is_written = bench_print(&report, format);
    if (!variant_set_any_measured(set)) {
        stderr_print("no row could be measured");
        return EXIT_USER;
    }
    if (!is_written) return EXIT_USER;
    if (!baseline) return EXIT_DONE;
    baseline_warn(baseline, device);
    return comparisons_status(comparisons, set->count, options->baseline);
}

static int bench_run(Bench *bench, const Baseline *baseline)
{
    Compute *compute = &bench->open.compute;
    if (bench->options.is_worker) return bench_work(&bench->set, compute);
    const VariantOptions *options = &bench->options.variants;
    Progress progress;
    progress_open(&progress, !report_has_text(&bench->options.variants.common.report));
    bool whole = variant_set_measure(&bench->set, options, compute, true, &progress);
    progress_close(&progress);
    return whole ? bench_report(bench, baseline) : EXIT_INTERRUPTED;
}

static int against_run(Bench *bench, int argument_count, char **arguments)
{
    const BenchOptions *options = &bench->options;
    double seconds = options->variants.seconds;
    AgainstOptions against = {
        .other = options->against,
        .tolerance = options->tolerance > 0 ? options->tolerance : against_tolerance,
        .seconds = seconds > 0 ? seconds : against_seconds * (double)bench->set.count,
        .report = options->variants.common.report,
        .argument_count = argument_count,
        .arguments = arguments,
    };
    DeviceList devices;
    const Device *device = device_find(&devices, options->variants.common.device);
    int status = device ? bench_against(&against, &bench->set, device) : EXIT_USER;
    device_list_close(&devices);
    return status;
}

// Runs the command once the scenes are read.
static int scenes_bench(Bench *bench, int argument_count, char **arguments)
{
    const BenchOptions *options = &bench->options;
    const CommonOptions *common = &options->variants.common;
    if (options->against && !options->is_worker) return against_run(bench, argument_count, arguments);
    MessageList messages = {0};
    Baseline *baseline = options->baseline ? baseline_open(options->baseline, true, &messages) : NULL;
    messages_print(&messages, NULL);
    int status = EXIT_USER;
    if ((!options->baseline || baseline) && device_open(&bench->open, common)) {
        if (work_groups_are_allowed(bench) &&
            (!is_any_certified(&bench->set) ||
             reference_open(&bench->open.compute, &bench->open.devices, common->reference_device)))
            status = bench_run(bench, baseline);
        variant_set_close(&bench->set);
        status = device_close(&bench->open, status);
    }
    baseline_close(baseline);
    return status;
}

int command_bench(int argument_count, char **arguments)
{
    Bench bench = {.options = {.variants = variant_options_default}};
    const BenchOptions *options = &bench.options;
    bench.options.variants.common.report.table = &bench_table;
    int status = command_line_read(&command_line, &bench.options, argument_count, arguments);
    if (status == OPTIONS_READ) {
        const size_t count = options->variant_texts.count;
        const VariantOptions *choices = count > 0 ? options->variant_options : &options->variants;
        const bool is_open = variant_set_open(&bench.set, choices, count > 0 ? count : 1,
                                              options->scenes.items, options->scenes.count);
        status = is_open ? scenes_bench(&bench, argument_count, arguments) : EXIT_USER;
        variant_set_close(&bench.set);
    }
    for (size_t i = 0; i < options->variant_texts.count; i++)
        free(options->variant_words[i]);
    return status;
}
