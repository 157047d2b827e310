// glint verify: the hard cases on a device, one line each.
#include "host/measure/verify.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/json.h"
#include "host/cli/commands.h"
#include "host/cli/options.h"
#include "host/render/camera_basis.h"
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { OPTION_JSON = OPTION_OWN };

static const struct option long_options[] = {
    {"device", required_argument, NULL, OPTION_DEVICE},
    {"precision", required_argument, NULL, OPTION_PRECISION},
    {"lanes", required_argument, NULL, OPTION_LANES},
    {"no-cache", no_argument, NULL, OPTION_NO_CACHE},
    {"json", no_argument, NULL, OPTION_JSON},
    PERTURB_LONG_OPTION,
    {"help", no_argument, NULL, 'h'},
    {0},
};

static const char help_text[] =
    "usage: glint verify [OPTIONS]\n\n"
    "Runs the hard cases on a device and holds each to its bound; exit status 3 if any fails.\n\n"
    "      --device D        an index, a part of the name, cpu or gpu (default: GLINT_DEVICE, else a GPU, "
    "else a "
    "CPU)\n"
    "      --precision P     fast, single, strict or double (default: all that the device has)\n"
    "      --lanes N         rays a work-item carries: 1, 4, 8 or 16 (default: the device's own)\n"
    "      --no-cache        build the kernels anew and keep nothing\n"
    "      --json            the results as JSON\n";

typedef struct {
    CommonOptions common;
    bool every_precision, json;
} VerifyOptions;

// The renderer as the cases see it.
typedef struct {
    Compute *compute;
    const VerifyOptions *options;
    Precision precision;
} Prober;

// With every feature built in, so that one program serves all scenes.
static void *prober_open(void *context, const Scene *scene, bool hierarchy)
{
    const Prober *prober = context;
    RenderSettings settings = {
        .width = 1,
        .height = 1,
        .region_width = 1,
        .region_height = 1,
        .sample_count = 1,
        .precision = prober->precision,
        .lanes = prober->options->common.lanes,
        .bvh = hierarchy ? BVH_ON : BVH_OFF,
        .no_cache = prober->options->common.no_cache,
        .perturb_seed = prober->options->common.perturb_seed,
        .perturb_scale = prober->options->common.perturb_scale,
        .extra_features = FEATURE_ALL,
    };
    MessageList messages = {0};
    Renderer *renderer = renderer_open(prober->compute, scene, &settings, &messages);
    messages_tell(&messages, NULL);
    if (!renderer) fault("a hard case does not fit the device");
    return renderer;
}

static void prober_trace(void *opened, const ProbeRay *rays, size_t count, ProbeHit *hits)
{
    renderer_trace(opened, rays, count, hits);
}

static void prober_close(void *opened)
{
    renderer_close(opened);
}

static void prober_camera_axes(const Camera *camera, Vector3 axes[3])
{
    CameraBasis basis = camera_basis(camera, 640, 480);
    axes[0] = basis.forward;
    axes[1] = basis.right;
    axes[2] = basis.up;
}

static const VerifyTier tier_of[PRECISION_COUNT] = {
    [PRECISION_FAST] = TIER_A,
    [PRECISION_SINGLE] = TIER_B,
    [PRECISION_STRICT] = TIER_C,
    [PRECISION_DOUBLE] = TIER_D,
};

typedef struct {
    Json *json; // or NULL: lines
    char tier;
    size_t held, failed;
} Report;

static void result_tell(const VerifyResult *result, const Report *report)
{
    printf("  %-3s %c  %-60s ", result->name, report->tier, result->title);
    if (result->bound > 0)
        printf("%8.3g of %-8.3g ulp", result->worst, result->bound);
    else
        printf("%24s", "");
    printf("  %s", verify_holds(result) ? "ok" : "FAIL");
    const struct {
        size_t count;
        const char *what;
    } faults[] = {{result->wrong, "wrong"},
                  {result->leaks, "leaks"},
                  {result->unsound, "unsound"},
                  {result->differing, "differ"}};
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++)
        if (faults[i].count > 0) printf("  %zu %s", faults[i].count, faults[i].what);
    putchar('\n');
    fflush(stdout);
}

static void result_add_json(Json *json, const VerifyResult *result)
{
    json_begin_object(json, NULL);
    json_text(json, "name", result->name);
    json_text(json, "title", result->title);
    json_boolean(json, "held", verify_holds(result));
    json_integer(json, "rays", (int64_t)result->ray_count);
    json_integer(json, "wrong", (int64_t)result->wrong);
    json_integer(json, "leaks", (int64_t)result->leaks);
    json_integer(json, "unsound", (int64_t)result->unsound);
    json_integer(json, "differing", (int64_t)result->differing);
    json_number(json, "worst_ulp", result->bound > 0 ? result->worst : NAN);
    json_number(json, "bound_ulp", result->bound > 0 ? result->bound : NAN);
    json_end(json);
}

static void result_take(void *context, const VerifyResult *result)
{
    Report *report = context;
    if (verify_holds(result))
        report->held++;
    else
        report->failed++;
    if (report->json)
        result_add_json(report->json, result);
    else
        result_tell(result, report);
}

// Runs all cases at one precision; returns how many failed.
static size_t precision_verify(Compute *compute, const VerifyOptions *options, Precision precision,
                               Json *json)
{
    Prober prober = {compute, options, precision};
    const VerifyRenderer renderer = {&prober, prober_open, prober_trace, prober_close, prober_camera_axes};
    // perturbed, a device is inexact: `single` cannot be held to its bounds, `strict` repairs what it does
    bool inexact = options->common.perturb_seed > 0 && precision == PRECISION_SINGLE;
    VerifyTier tier = inexact ? TIER_A : tier_of[precision];
    Report report = {.json = json, .tier = (char)('A' + tier)};
    const char *name = precision_names[precision];
    if (json) {
        json_begin_object(json, NULL);
        json_text(json, "precision", name);
        json_text(json, "tier", (const char[]){report.tier, '\0'});
        json_begin_array(json, "cases");
    } else {
        printf("%s\n", name);
    }
    double start = clock_seconds();
    verify_run(&renderer, tier, result_take, &report);
    double seconds = clock_seconds() - start;
    if (json) {
        json_end(json);
        json_integer(json, "held", (int64_t)report.held);
        json_integer(json, "failed", (int64_t)report.failed);
        json_number(json, "seconds", seconds);
        json_end(json);
    } else {
        printf("  tier %c: %zu of %zu cases held, in %.1f s\n", report.tier, report.held,
               report.held + report.failed, seconds);
    }
    return report.failed;
}

static int device_verify(Compute *compute, const VerifyOptions *options)
{
    Precision first = options->every_precision ? PRECISION_FAST : options->common.precision;
    Precision last = options->every_precision ? PRECISION_DOUBLE : options->common.precision;
    if (!compute->device->fp64 && last == PRECISION_DOUBLE) {
        if (!options->every_precision) {
            fprintf(stderr, "glint: precision double: the device \"%s\" has no 64-bit floating point\n",
                    compute->device->name);
            return EXIT_USER;
        }
        last = PRECISION_STRICT;
    }
    Json *json = options->json ? json_open() : NULL;
    if (json) {
        json_integer(json, "schema", 1);
        json_text(json, "device", compute->device->name);
        json_begin_array(json, "precisions");
    } else {
        printf("%s\n", compute->device->name);
    }
    size_t failed = 0;
    for (Precision precision = first; precision <= last; precision++)
        failed += precision_verify(compute, options, precision, json);
    if (json) {
        json_end(json);
        json_print(json, stdout);
    }
    return failed > 0 ? EXIT_CHECK : EXIT_DONE;
}

static int options_read(VerifyOptions *options, int argument_count, char **arguments, bool *helped)
{
    *options = (VerifyOptions){.every_precision = true};
    int option;
    bool valid;
    while ((option = getopt_long(argument_count, arguments, "h", long_options, NULL)) != -1) {
        if (option == 'h') {
            printf("%s%s", help_text, perturb_option_help);
            *helped = true;
            return EXIT_DONE;
        }
        if (option == '?') return EXIT_USER;
        if (option == OPTION_PRECISION) options->every_precision = false;
        if (option == OPTION_JSON)
            options->json = true;
        else if (option_common(&options->common, option, optarg, &valid) && !valid)
            return EXIT_USER;
    }
    if (optind < argument_count) return option_usage_fault("verify", "takes no scene; its cases are its own");
    return EXIT_DONE;
}

int command_verify(int argument_count, char **arguments)
{
    VerifyOptions options;
    bool helped = false;
    int status = options_read(&options, argument_count, arguments, &helped);
    if (status != EXIT_DONE || helped) return status;
    OpenDevice open;
    if (!device_open(&open, options.common.device)) return EXIT_USER;
    status = device_verify(&open.compute, &options);
    device_close(&open);
    return status;
}
