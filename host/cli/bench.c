// glint bench: how fast this device renders scenes, in each way of computing them.
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/cli/bench_report.h"
#include "host/cli/bench_variant.h"
#include "host/cli/commands.h"
#include "host/cli/options.h"
#include "host/cli/progress.h"
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    OPTION_SIZE = OPTION_OWN,
    OPTION_JSON,
    OPTION_COMPARE,
    OPTION_TOLERANCE,
    OPTION_SECONDS,
    OPTION_LAUNCHES
};

static const struct option long_options[] = {
    {"json", no_argument, NULL, OPTION_JSON},
    {"compare", required_argument, NULL, OPTION_COMPARE},
    {"tolerance", required_argument, NULL, OPTION_TOLERANCE},
    {"precision", required_argument, NULL, OPTION_PRECISION},
    {"lanes", required_argument, NULL, OPTION_LANES},
    {"bvh", required_argument, NULL, OPTION_BVH},
    {"size", required_argument, NULL, OPTION_SIZE},
    {"seconds", required_argument, NULL, OPTION_SECONDS},
    {"launches", no_argument, NULL, OPTION_LAUNCHES},
    {"device", required_argument, NULL, OPTION_DEVICE},
    {"lenient", no_argument, NULL, OPTION_LENIENT},
    {"help", no_argument, NULL, 'h'},
    {0},
};

static const char help_text[] =
    "usage: glint bench SCENE... [OPTIONS]\n\n"
    "Renders each scene in each way asked for, all in turn, and tells the times.\n\n"
    "      --precision LIST  of fast, single, strict, double (default: single)\n"
    "      --lanes LIST      of 1, 4, 8, 16 (default: the device's own)\n"
    "      --bvh LIST        of auto, on, off (default: auto)\n"
    "      --size WxH        of the pictures (default: as glint render has it)\n"
    "      --seconds MAX     stop measuring after so long, settled or not (default: 5 for each row)\n"
    "      --launches        list the launches of each row's last run\n"
    "      --json            for programs\n"
    "      --compare FILE    hold the times against those of an earlier report (--json); exit status 3 where "
    "one is slower\n"
    "      --tolerance R     new over old that still passes (default: 1.1)\n"
    "      --device D        an index, a part of the name, cpu or gpu (default: GLINT_DEVICE, else a GPU, "
    "else "
    "a CPU)\n"
    "      --lenient         skip what .rt files hold beyond the format, with a warning\n"
    "  -h, --help            this text\n";

// The lanes that are asked for: a bit for each of these.
static const char *const lanes_names[] = {"1", "4", "8", "16"};
static const uint32_t lanes_values[] = {1, 4, 8, 16};
enum { LANES_CHOICE_COUNT = 4, WARM_UP_RUNS = 3, ENOUGH_RUNS = 20 };

typedef struct {
    CommonOptions common;
    unsigned precisions, lanes, bvhs; // sets; no lanes: the device's own
    uint32_t width, height;           // 0: not given
    double seconds, tolerance;        // seconds 0: not given
    const char *baseline;
    bool as_json, launches;
} BenchOptions;

typedef struct {
    BenchOptions options;
    OpenDevice open;
    Peak peak;
    Scene *scenes;
    // side by side
    Variant *variants;
    BenchRow *rows;
    size_t count;
    Progress progress;
} Bench;

static bool option_positive(const char *option, const char *value, double *result)
{
    char *end;
    double number = strtod(value, &end);
    if (end == value || *end != '\0' || !(number > 0 && number < 1e9)) {
        fprintf(stderr, "glint: --%s: expected a number above 0, not \"%s\"\n", option, value);
        return false;
    }
    *result = number;
    return true;
}

static bool option_take(BenchOptions *options, int option, const char *value)
{
    bool valid;
    switch (option) {
    case OPTION_PRECISION:
        return option_set("precision", value, precision_names, PRECISION_COUNT, &options->precisions);
    case OPTION_LANES:
        return option_set("lanes", value, lanes_names, LANES_CHOICE_COUNT, &options->lanes);
    case OPTION_BVH:
        return option_set("bvh", value, bvh_choice_names, BVH_CHOICE_COUNT, &options->bvhs);
    case OPTION_SIZE:
        return option_size("size", value, &options->width, &options->height);
    case OPTION_SECONDS:
        return option_positive("seconds", value, &options->seconds);
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
        return option_common(&options->common, option, value, &valid) && valid;
    }
}

static bool all_settled(const Bench *bench)
{
    for (size_t i = 0; i < bench->count; i++)
        if (bench->variants[i].renderer && !bench_settled(&bench->rows[i].times, ENOUGH_RUNS)) return false;
    return true;
}

// Every variant once. False if the user stopped it.
static bool round_run(Bench *bench, bool warm_up)
{
    for (size_t i = 0; i < bench->count; i++)
        if (bench->variants[i].renderer &&
            !variant_run(&bench->variants[i], warm_up ? NULL : &bench->rows[i].times))
            return false;
    return true;
}

// In turn (A B C A B C …), so that a machine that slows down does so for all.
static bool runs_measure(Bench *bench)
{
    double bound = bench->options.seconds > 0 ? bench->options.seconds : 5 * (double)bench->count;
    double start = clock_seconds();
    for (int i = 0; i < WARM_UP_RUNS && (i == 0 || clock_seconds() - start < bound / 4); i++)
        if (!round_run(bench, true)) return false;
    start = clock_seconds();
    double spent = 0;
    while (spent < bound && !all_settled(bench)) {
        if (!round_run(bench, false)) return false;
        spent = clock_seconds() - start;
        progress_show(&bench->progress, spent / bound);
    }
    return true;
}

static void variant_add(Bench *bench, const char *path, const Scene *scene, const RenderSettings *settings)
{
    bench->variants[bench->count] = (Variant){.scene = scene, .settings = *settings};
    bench->rows[bench->count++] =
        (BenchRow){.key = {path, precision_names[settings->precision], bvh_choice_names[settings->bvh],
                           settings->lanes, settings->width, settings->height}};
}

static void scene_add_variants(Bench *bench, const char *path, const Scene *scene)
{
    const BenchOptions *options = &bench->options;
    uint32_t width = options->width, height = options->height;
    picture_size_choose(scene, &width, &height);
    RenderSettings settings = {
        .width = width,
        .height = height,
        .region_width = width,
        .region_height = height,
        .sample_count = 1,
        .bounce_count = 5,
        .shift_to_eye = true,
    };
    for (unsigned precision = 0; precision < PRECISION_COUNT; precision++)
        for (unsigned lanes = 0; lanes < LANES_CHOICE_COUNT; lanes++)
            for (unsigned bvh = 0; bvh < BVH_CHOICE_COUNT; bvh++) {
                if (!(options->precisions >> precision & 1) || !(options->bvhs >> bvh & 1)) continue;
                // where no lanes are asked for, once with the device's own
                if (options->lanes ? !(options->lanes >> lanes & 1) : lanes > 0) continue;
                settings.precision = (Precision)precision;
                settings.lanes = options->lanes ? lanes_values[lanes] : 0;
                settings.bvh = (BvhChoice)bvh;
                variant_add(bench, path, scene, &settings);
            }
}

static bool scenes_open(Bench *bench, char *const *paths, size_t count)
{
    enum { VARIANTS_LARGEST = PRECISION_COUNT * LANES_CHOICE_COUNT * BVH_CHOICE_COUNT };
    bench->scenes = memory_allocate_zeroed(count, sizeof *bench->scenes);
    bench->variants = memory_allocate_zeroed(count, VARIANTS_LARGEST * sizeof *bench->variants);
    bench->rows = memory_allocate_zeroed(count, VARIANTS_LARGEST * sizeof *bench->rows);
    for (size_t i = 0; i < count; i++) {
        if (!scene_open(&bench->scenes[i], paths[i], &bench->options.common)) return false;
        scene_add_variants(bench, paths[i], &bench->scenes[i]);
    }
    return true;
}

static void bench_close(Bench *bench, size_t scene_count)
{
    for (size_t i = 0; i < bench->count; i++) {
        variant_close(&bench->variants[i]);
        bench_row_free(&bench->rows[i]);
    }
    for (size_t i = 0; bench->scenes && i < scene_count; i++)
        scene_free(&bench->scenes[i]);
    free(bench->scenes);
    free(bench->variants);
    free(bench->rows);
}

static bool any_opened(const Bench *bench)
{
    for (size_t i = 0; i < bench->count; i++)
        if (bench->variants[i].renderer) return true;
    return false;
}

static int bench_tell(const Bench *bench, const Baseline *baseline)
{
    const BenchOptions *options = &bench->options;
    const RenderReport **reports = memory_allocate_zeroed(bench->count, sizeof *reports);
    for (size_t i = 0; i < bench->count; i++)
        if (bench->variants[i].renderer) reports[i] = renderer_report(bench->variants[i].renderer);
    BenchReport report = {bench->open.compute.device,
                          &bench->peak,
                          bench->rows,
                          options->launches ? reports : NULL,
                          bench->count,
                          baseline,
                          options->tolerance};
    if (options->as_json)
        bench_print_json(&report);
    else
        bench_print_text(&report, stdout);
    free(reports);
    if (!any_opened(bench)) {
        fputs("glint bench: no row could be measured\n", stderr);
        return EXIT_USER;
    }
    if (!baseline) return EXIT_DONE;
    if (strcmp(baseline_device(baseline), report.device->name) != 0)
        fprintf(stderr, "glint bench: the baseline is of another device, \"%s\"\n",
                baseline_device(baseline));
    bool any_common;
    size_t slower = bench_slower_count(&report, &any_common);
    if (!any_common) {
        fprintf(stderr, "glint bench: %s has none of these rows\n", options->baseline);
        return EXIT_USER;
    }
    if (slower == 0) return EXIT_DONE;
    fprintf(stderr, "glint bench: %zu of %zu rows took more than %g times as long as in %s\n", slower,
            bench->count, options->tolerance, options->baseline);
    return EXIT_CHECK;
}

static int bench_run(Bench *bench, const Baseline *baseline)
{
    Compute *compute = &bench->open.compute;
    bool wide = (bench->options.precisions >> PRECISION_DOUBLE & 1) && compute->device->fp64;
    progress_open(&bench->progress, bench->options.as_json);
    peak_measure(&bench->peak, compute, wide);
    for (size_t i = 0; i < bench->count && !progress_interrupted(); i++)
        variant_open(compute, &bench->variants[i], &bench->rows[i]);
    bool whole = !progress_interrupted() && runs_measure(bench);
    progress_close(&bench->progress);
    if (!whole) {
        fputs("glint: interrupted\n", stderr);
        return EXIT_INTERRUPTED;
    }
    return bench_tell(bench, baseline);
}

int command_bench(int argument_count, char **arguments)
{
    Bench bench = {
        .options = {.precisions = 1u << PRECISION_SINGLE, .bvhs = 1u << BVH_AUTO, .tolerance = 1.1},
    };
    for (int option; (option = getopt_long(argument_count, arguments, "h", long_options, NULL)) != -1;) {
        if (option == 'h') {
            fputs(help_text, stdout);
            return EXIT_DONE;
        }
        if (option == '?' || !option_take(&bench.options, option, optarg)) return EXIT_USER;
    }
    if (optind == argument_count) return option_usage_fault("bench", "which scenes?");

    size_t scene_count = (size_t)(argument_count - optind);
    MessageList messages = {0};
    Baseline *baseline = NULL;
    if (bench.options.baseline) baseline = baseline_open(bench.options.baseline, &messages);
    messages_tell(&messages, NULL);
    int status = EXIT_USER;
    if (!bench.options.baseline || baseline) {
        if (scenes_open(&bench, arguments + optind, scene_count) &&
            device_open(&bench.open, bench.options.common.device)) {
            status = bench_run(&bench, baseline);
            bench_close(&bench, scene_count);
            device_close(&bench.open);
        } else {
            bench_close(&bench, scene_count);
        }
    }
    baseline_close(baseline);
    return status;
}
