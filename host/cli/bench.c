// glint bench: interleaved timings of scenes in every requested configuration.
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/cli/bench_report.h"
#include "host/cli/commands.h"
#include "host/cli/variants.h"
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OPTION_JSON = OPTION_BEYOND_VARIANTS, OPTION_COMPARE, OPTION_TOLERANCE, OPTION_LAUNCHES };

static const struct option long_options[] = {
    {"json", no_argument, NULL, OPTION_JSON},
    {"compare", required_argument, NULL, OPTION_COMPARE},
    {"tolerance", required_argument, NULL, OPTION_TOLERANCE},
    {"launches", no_argument, NULL, OPTION_LAUNCHES},
    VARIANT_LONG_OPTIONS,
    {"help", no_argument, NULL, 'h'},
    {0},
};

static const char help_text[] =
    "usage: glint bench SCENE... [OPTIONS]\n\n"
    "Benchmarks scenes in every requested configuration, interleaved.\n\n"
    "      --compare FILE    compare with an earlier report (--json); exit status 3 where "
    "one is slower\n"
    "      --tolerance R     largest accepted ratio of new to old time (default: 1.1)\n"
    "      --launches        list the kernel launches of each row's last run\n"
    "      --precision LIST  of fast, single, strict, double (default: single)\n" //
    HELP_VARIANTS HELP_JSON HELP_HELP;

typedef struct {
    VariantOptions variants;
    double tolerance;
    const char *baseline;
    bool as_json, launches;
} BenchOptions;

typedef struct {
    BenchOptions options;
    OpenDevice open;
    Peak peak;
    VariantSet set;
} Bench;

static bool option_take(BenchOptions *options, int option, const char *value)
{
    bool valid = true;
    if (variant_option(&options->variants, option, value, &valid)) return valid;
    switch (option) {
    case OPTION_TOLERANCE:
        return option_positive("tolerance", value, &options->tolerance);
    case OPTION_COMPARE:
        options->baseline = value;
        return true;
    case OPTION_JSON:
        options->as_json = true;
        return true;
    case OPTION_LAUNCHES:
        options->launches = true;
        return true;
    default:
        return false;
    }
}

static int bench_tell(const Bench *bench, const Baseline *baseline)
{
    const BenchOptions *options = &bench->options;
    const VariantSet *set = &bench->set;
    const RenderReport **reports = memory_allocate_zeroed(set->count, sizeof *reports);
    for (size_t i = 0; i < set->count; i++)
        if (set->variants[i].renderer) reports[i] = renderer_report(set->variants[i].renderer);
    BenchReport report = {bench->open.compute.device,
                          &bench->peak,
                          set->rows,
                          options->launches ? reports : NULL,
                          set->count,
                          baseline,
                          options->tolerance};
    if (options->as_json)
        bench_print_json(&report);
    else
        bench_print_text(&report, stdout);
    free(reports);
    if (!variant_set_any_measured(set)) {
        fputs("glint bench: no row could be measured\n", stderr);
        return EXIT_USER;
    }
    if (!baseline) return EXIT_DONE;
    if (strcmp(baseline_device(baseline), report.device->name) != 0)
        fprintf(stderr, "glint bench: the baseline was measured on another device, \"%s\"\n",
                baseline_device(baseline));
    bool any_common;
    size_t slower = bench_slower_count(&report, &any_common);
    if (!any_common) {
        fprintf(stderr, "glint bench: %s has none of these rows\n", options->baseline);
        return EXIT_USER;
    }
    if (slower == 0) return EXIT_DONE;
    fprintf(stderr, "glint bench: %zu of %zu rows took more than %g times as long as in %s\n", slower,
            set->count, options->tolerance, options->baseline);
    return EXIT_CHECK;
}

static int bench_run(Bench *bench, const Baseline *baseline)
{
    Compute *compute = &bench->open.compute;
    const VariantOptions *options = &bench->options.variants;
    bool with_double = (options->precisions >> PRECISION_DOUBLE & 1) && compute->device->fp64;
    Progress progress;
    progress_open(&progress, bench->options.as_json);
    peak_measure(&bench->peak, compute, with_double);
    bool whole = variant_set_measure(&bench->set, options, compute, true, &progress);
    progress_close(&progress);
    if (!whole) {
        if (compute_ok(compute)) fputs("glint: interrupted\n", stderr);
        return EXIT_INTERRUPTED;
    }
    return bench_tell(bench, baseline);
}

int command_bench(int argument_count, char **arguments)
{
    Bench bench = {
        .options = {.variants = variant_options_default, .tolerance = 1.1},
    };
    for (int option; (option = getopt_long(argument_count, arguments, "h", long_options, NULL)) != -1;) {
        if (option == 'h') return option_help(help_text);
        if (option == '?' || !option_take(&bench.options, option, optarg)) return EXIT_USER;
    }
    if (optind == argument_count) return option_usage_fault("bench", "no scene given");

    size_t scene_count = (size_t)(argument_count - optind);
    MessageList messages = {0};
    Baseline *baseline = NULL;
    if (bench.options.baseline) baseline = baseline_open(bench.options.baseline, &messages);
    messages_print(&messages, NULL);
    int status = EXIT_USER;
    if (!bench.options.baseline || baseline) {
        const VariantOptions *options = &bench.options.variants;
        if (variant_set_open(&bench.set, options, arguments + optind, scene_count) &&
            device_open(&bench.open, options->common.device)) {
            status = bench_run(&bench, baseline);
            variant_set_close(&bench.set);
            status = device_close(&bench.open, status);
        } else {
            variant_set_close(&bench.set);
        }
    }
    baseline_close(baseline);
    return status;
}
