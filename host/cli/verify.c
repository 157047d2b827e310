// glint verify: the hard cases on a device, one line each.
#include "host/verify/verify.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/json.h"
#include "host/cli/commands.h"
#include "host/cli/options.h"
#include "host/cli/passport_report.h"
#include "host/cli/report_json.h"
#include "host/cli/version.h"
#include "host/render/arithmetic.h"
#include <getopt.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { OPTION_JSON = OPTION_OWN, OPTION_LEAN };

static const struct option long_options[] = {
    {"device", required_argument, NULL, OPTION_DEVICE},
    {"precision", required_argument, NULL, OPTION_PRECISION},
    {"lanes", required_argument, NULL, OPTION_LANES},
    {"no-cache", no_argument, NULL, OPTION_NO_CACHE},
    {"lean", no_argument, NULL, OPTION_LEAN},
    {"json", no_argument, NULL, OPTION_JSON},
    PERTURB_LONG_OPTION,
    DRIVER_LONG_OPTIONS,
    {"help", no_argument, NULL, 'h'},
    {0},
};

static const char help_text[] =
    "usage: glint verify [CASE...] [OPTIONS]\n\n"
    "Runs the hard cases, or those named, on a device and checks each against its bound; exit status 3 if "
    "any fails.\n\n"
    "      --precision P     fast, single, strict or double (default: all that the device has)\n"
    "      --lean            build kernels of what each scene needs alone: more of them, for a slow "
    "compiler\n" //
    HELP_DEVICE HELP_LANES HELP_NO_CACHE HELP_DRIVER HELP_PERTURB HELP_JSON HELP_HELP;

typedef struct {
    CommonOptions common;
    bool every_precision, json;
    bool lean;          // each scene has kernels of its own
    VerifyChoice cases; // none named: all
} VerifyOptions;

typedef struct {
    const Compute *compute;
    Json *json; // or NULL: lines
    char tier;
    size_t passed, failed;
    double start; // of the case
} Report;

static void result_print(const VerifyResult *result, const Report *report)
{
    printf("  %-3s %c  %-60s ", result->name, report->tier, result->title);
    if (result->bound > 0)
        printf("%8.3g of %-8.3g %-4s", result->worst, result->bound, result->unit);
    else
        printf("%20zu rays", result->ray_count);
    printf("  %s", verify_holds(result) ? "ok" : "FAIL");
    const struct {
        size_t count;
        const char *what;
    } faults[] = {{result->wrong, "wrong"},
                  {result->leaks, "leaks"},
                  {result->unsound, "unsound"},
                  {result->off_surface, "off the surface"},
                  {result->wrong_normals, "normals turned"},
                  {result->differing, "differ"}};
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++)
        if (faults[i].count > 0) printf("  %zu %s", faults[i].count, faults[i].what);
    putchar('\n');
    fflush(stdout);
}

static void result_add_json(Json *json, const VerifyResult *result, double seconds)
{
    json_begin_object(json, NULL);
    json_text(json, "name", result->name);
    json_text(json, "title", result->title);
    json_bool(json, "passed", verify_holds(result));
    json_int64(json, "rays", (int64_t)result->ray_count);
    json_int64(json, "wrong", (int64_t)result->wrong);
    json_int64(json, "leaks", (int64_t)result->leaks);
    json_int64(json, "unsound", (int64_t)result->unsound);
    json_int64(json, "off", (int64_t)result->off_surface);
    json_int64(json, "turned", (int64_t)result->wrong_normals);
    json_int64(json, "differing", (int64_t)result->differing);
    json_number(json, "surface_part", result->worst_position_ratio);
    json_number(json, "normal_part", result->worst_normal_ratio);
    json_number(json, "worst", result->bound > 0 ? result->worst : NAN);
    json_number(json, "bound", result->bound > 0 ? result->bound : NAN);
    if (result->bound > 0) json_text(json, "unit", result->unit);
    hash_json(json, "hash", result->hash);
    json_number(json, "seconds", seconds);
    json_end(json);
}

static bool result_take(void *context, const VerifyResult *result)
{
    Report *report = context;
    if (!compute_ok(report->compute)) return false;
    if (verify_holds(result))
        report->passed++;
    else
        report->failed++;
    if (report->json)
        result_add_json(report->json, result, clock_seconds() - report->start);
    else
        result_print(result, report);
    report->start = clock_seconds();
    return true;
}

// Runs all cases at one precision; returns how many failed.
static size_t precision_verify(Compute *compute, const VerifyOptions *options, Precision precision,
                               Json *json)
{
    VerifySettings settings = {.render = settings_whole(&options->common, 1, 1), .lean = options->lean};
    settings.render.precision = precision;
    settings.render.bounce_count = BOUNCES_DEFAULT;
    const VerifyTier tier = verify_tier(&settings.render);
    if (tier == TIER_D && verify_reference_bits() < 64)
        fprintf(stderr,
                "glint: verify: the reference has %d bits here: tier D is checked against numbers of its own "
                "precision\n",
                verify_reference_bits());
    double start = clock_seconds();
    Report report = {.compute = compute, .json = json, .tier = (char)('A' + tier), .start = start};
    const char *name = precision_names[precision];
    if (json) {
        json_begin_object(json, NULL);
        json_text(json, "precision", name);
        json_text(json, "tier", (const char[]){report.tier, '\0'});
        json_begin_array(json, "cases");
    } else {
        printf("%s\n", name);
    }
    const VerifyChoice *choice = options->cases.count > 0 ? &options->cases : NULL;
    const VerifyKernels kernels = verify_run(compute, &settings, choice, result_take, &report);
    double seconds = clock_seconds() - start;
    if (json) {
        json_end(json);
        json_int64(json, "lanes", kernels.lanes);
        hash_json(json, "trace_kernel", kernels.trace_hash);
        hash_json(json, "render_kernel", kernels.render_hash);
        json_int64(json, "passed", (int64_t)report.passed);
        json_int64(json, "failed", (int64_t)report.failed);
        json_number(json, "seconds", seconds);
        json_end(json);
    } else if (compute_ok(compute)) {
        printf("  tier %c: %zu of %zu cases passed, in %.1f s; kernels: trace %016" PRIx64
               ", render %016" PRIx64 "\n",
               report.tier, report.passed, report.passed + report.failed, seconds, kernels.trace_hash,
               kernels.render_hash);
    }
    return report.failed;
}

// What the results are of.
static void origin_add_json(Json *json, const Device *device, const CommonOptions *common)
{
    json_int64(json, "schema", 3);
    json_text(json, "glint", glint_version());
    json_int64(json, "reference_bits", verify_reference_bits());
    json_begin_object(json, "device");
    device_json(json, device);
    json_end(json);
    perturb_json(json, common->perturb_seed, common->perturb_scale);
}

// Prints why the arithmetic of the device does not suit a precision.
static bool arithmetic_is_suitable(Compute *compute, const VerifyOptions *options, Precision precision)
{
    RenderSettings settings = settings_whole(&options->common, 1, 1);
    settings.precision = precision;
    MessageList messages = {0};
    const bool is_suitable = arithmetic_suits(compute, &settings, &messages);
    messages_print(&messages, NULL);
    return is_suitable;
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
    if (!options->every_precision && !arithmetic_is_suitable(compute, options, first)) return EXIT_USER;
    Json *json = options->json ? json_open() : NULL;
    if (json) {
        origin_add_json(json, compute->device, &options->common);
        json_begin_array(json, "precisions");
    } else {
        printf("%s; reference of %d bits\n", compute->device->name, verify_reference_bits());
    }
    size_t failed = 0;
    for (Precision precision = first; precision <= last && compute_ok(compute); precision++)
        if (arithmetic_is_suitable(compute, options, precision))
            failed += precision_verify(compute, options, precision, json);
    if (!json) passports_remark(compute->device, stdout);
    if (json) {
        json_end(json);
        json_print(json, stdout);
    }
    return failed > 0 ? EXIT_CHECK : EXIT_DONE;
}

static bool is_case(const char *name)
{
    size_t i = 0;
    while (verify_case_name(i) && strcmp(verify_case_name(i), name) != 0)
        i++;
    return verify_case_name(i);
}

static int refuse_case(const char *name)
{
    fprintf(stderr, "glint: verify: there is no case \"%s\"; there are ", name);
    for (size_t i = 0; verify_case_name(i); i++)
        fprintf(stderr, "%s%s", i ? ", " : "", verify_case_name(i));
    fprintf(stderr, " (docs/verify.md)\n");
    return EXIT_USER;
}

static int options_read(VerifyOptions *options, int argument_count, char **arguments)
{
    *options = (VerifyOptions){.every_precision = true};
    int option;
    bool valid;
    while ((option = getopt_long(argument_count, arguments, "h", long_options, NULL)) != -1) {
        if (option == 'h') return option_help(help_text);
        if (option == '?') return EXIT_USER;
        if (option == OPTION_PRECISION) options->every_precision = false;
        if (option == OPTION_JSON)
            options->json = true;
        else if (option == OPTION_LEAN)
            options->lean = true;
        else if (option_common(&options->common, option, optarg, &valid) && !valid)
            return EXIT_USER;
    }
    if (options->common.precision == PRECISION_CERTIFIED)
        return option_usage_fault("verify", "--precision certified is for images");
    options->cases = (VerifyChoice){arguments + optind, (size_t)(argument_count - optind)};
    for (size_t i = 0; i < options->cases.count; i++)
        if (!is_case(options->cases.names[i])) return refuse_case(options->cases.names[i]);
    return OPTIONS_READ;
}

int command_verify(int argument_count, char **arguments)
{
    VerifyOptions options;
    int status = options_read(&options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    OpenDevice open;
    if (!device_open(&open, &options.common)) return EXIT_USER;
    return device_close(&open, device_verify(&open.compute, &options));
}
