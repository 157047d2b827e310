// glint verify runs the hard cases on a device and prints one line per case.
#include "host/verify/verify.h"
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/json.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/format.h"
#include "host/cli/options.h"
#include "host/cli/passport_report.h"
#include "host/cli/progress.h"
#include "host/cli/report_json.h"
#include "host/cli/verify_journal.h"
#include "host/render/arithmetic.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const ResultTable verify_table = {
    .command = "verify",
    .rows = "precisions.cases",
    .names = {"precision", "case=name", "title"},
    .values = {"passed", "rays", "wrong", "leaks", "unsound", "off the surface=off", "turned normals=turned",
               "differing", "worst", "bound", "unit", "crash", "seconds"},
    .verdicts = {"passed"},
    .failed = "false",
    .seconds = "seconds",
};

typedef struct {
    CommonOptions common;
    bool quick, lean;      // see VerifySettings
    CommandOperands names; // of the cases, all if none is named
} VerifyOptions;

static const Option options_own[] = {
    {"quick", NULL, "a sixteenth of the random rays, and fewer pixels", option_flag,
     offsetof(VerifyOptions, quick)},
    {"lean", NULL, "build one small kernel per scene instead of one for all, for slow compilers", option_flag,
     offsetof(VerifyOptions, lean)}};
static const Option precision_own[] = {
    PRECISION_OPTION("single, strict or double (default: all that the device has)", ARITHMETIC_COUNT)};

static bool is_case(const char *name)
{
    size_t i = 0;
    while (verify_case_name(i) && strcmp(verify_case_name(i), name) != 0)
        i++;
    return verify_case_name(i);
}

static void case_fault(const char *name)
{
    fprintf(stderr, "glint: verify: there is no case \"%s\"; the cases are ", name);
    for (size_t i = 0; verify_case_name(i); i++)
        fprintf(stderr, "%s%s", i ? ", " : "", verify_case_name(i));
    fprintf(stderr, " (docs/verify.md)\n");
}

static const char *options_check(void *verify_options)
{
    const VerifyOptions *options = verify_options;
    for (size_t i = 0; i < options->names.count; i++) {
        if (is_case(options->names.items[i])) continue;
        case_fault(options->names.items[i]);
        return "";
    }
    return NULL;
}

static const CommandLine command_line = {
    .command = "verify",
    .usage =
        "usage: glint verify [CASE...] [OPTIONS]\n\n"
        "Runs the hard cases, or those named, on a device and checks each against its bound; exit status "
        "3 if any fails.\n",
    .groups = {OPTIONS(precision_own), OPTIONS(options_own), OPTIONS(device_option),
               OPTION(common_options[COMMON_LANES]), OPTION(common_options[COMMON_NO_CACHE]),
               OPTIONS(driver_options), OPTIONS(keep_kernels_option), OPTIONS(perturb_option),
               REPORT_OPTIONS},
    OPERANDS(ANY, VerifyOptions, names),
    .check = options_check};

typedef struct {
    const VerifyOptions *options;
    VerifyJournal *journal;
    const Compute *compute;
    Progress progress;
    bool has_text;
    size_t case_count, row_count; // the cases of one precision, and of all that are requested
    // The current state:
    Precision precision;
    PrecisionRecord *record;
    char tier;
} Verification;

static bool is_chosen(const VerifyOptions *options, const char *name)
{
    for (size_t i = 0; i < options->names.count; i++)
        if (strcmp(options->names.items[i], name) == 0) return true;
    return options->names.count == 0;
}

static bool has_failed(const CaseRecord *record)
{
    return record->state == CASE_CRASHED || (record->state == CASE_DONE && !verify_holds(&record->result));
}

static bool has_ended(const CaseRecord *record)
{
    return record->state == CASE_DONE || record->state == CASE_CRASHED;
}

static size_t records_count(const PrecisionRecord *record, bool (*is_counted)(const CaseRecord *record))
{
    size_t count = 0;
    for (size_t i = 0; i < VERIFY_CASES_MAX; i++)
        count += is_counted(&record->cases[i]);
    return count;
}

static void record_print(CaseRecord *record, char tier)
{
    const VerifyResult *result = &record->result;
    record->is_printed = true;
    printf("  %-3s %c  %-60s ", result->name, tier, result->title);
    if (record->state == CASE_CRASHED) {
        printf("%25s  FAIL  %s\n", "", record->crash);
        fflush(stdout);
        return;
    }
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
    for (size_t i = 0; i < COUNT_OF(faults); i++)
        if (faults[i].count > 0) printf("  %zu %s", faults[i].count, faults[i].what);
    putchar('\n');
    fflush(stdout);
}

static void record_add_json(Json *json, const CaseRecord *record)
{
    const VerifyResult *result = &record->result;
    json_begin_object(json, NULL);
    json_text(json, "name", result->name);
    json_text(json, "title", result->title);
    json_bool(json, "passed", !has_failed(record));
    if (record->state == CASE_CRASHED) {
        json_text(json, "crash", record->crash);
        json_number(json, "seconds", record->seconds);
        json_end(json);
        return;
    }
    json_count(json, "rays", result->ray_count);
    json_count(json, "wrong", result->wrong);
    json_count(json, "leaks", result->leaks);
    json_count(json, "unsound", result->unsound);
    json_count(json, "off", result->off_surface);
    json_count(json, "turned", result->wrong_normals);
    json_count(json, "differing", result->differing);
    json_number(json, "surface_part", result->worst_position_ratio);
    json_number(json, "normal_part", result->worst_normal_ratio);
    json_number(json, "worst", result->bound > 0 ? result->worst : NAN);
    json_number(json, "bound", result->bound > 0 ? result->bound : NAN);
    if (result->bound > 0) json_text(json, "unit", result->unit);
    hash_json(json, "hash", result->hash);
    json_number(json, "seconds", record->seconds);
    json_end(json);
}

static CaseRecord *record_of(const Verification *verification, const char *name)
{
    size_t i = 0;
    while (strcmp(verify_case_name(i), name) != 0)
        i++;
    return &verification->record->cases[i];
}

static size_t rows_ended(const Verification *verification)
{
    size_t count = 0;
    for (size_t i = 0; i < ARITHMETIC_COUNT; i++)
        count += records_count(&verification->journal->precisions[i], has_ended);
    return count;
}

// Clears the line of progress for a line of the report.
static void line_begin(Verification *verification)
{
    fflush(stdout);
    progress_close(&verification->progress);
}

static bool case_start(void *context, const VerifyResult *result)
{
    Verification *verification = context;
    CaseRecord *record = record_of(verification, result->name);
    if (record->state == CASE_CRASHED && !record->is_printed && verification->has_text) {
        line_begin(verification);
        record_print(record, verification->tier);
    }
    if (has_ended(record)) return false;
    *record = (CaseRecord){.state = CASE_RUNNING, .result = *result, .start_seconds = clock_seconds()};
    const size_t ended = rows_ended(verification);
    progress_step(&verification->progress, (double)ended / (double)verification->row_count,
                  "%s at %s, case %zu of %zu", result->name, precision_names[verification->precision],
                  ended + 1, verification->row_count);
    return true;
}

static bool case_receive(void *context, const VerifyResult *result)
{
    Verification *verification = context;
    if (!compute_ok(verification->compute)) return false;
    CaseRecord *record = record_of(verification, result->name);
    record->result = *result;
    record->seconds = clock_seconds() - record->start_seconds;
    record->state = CASE_DONE;
    if (!verification->has_text) return true;
    line_begin(verification);
    record_print(record, verification->tier);
    return true;
}

static RenderSettings precision_settings(const VerifyOptions *options, Precision precision)
{
    RenderSettings settings = settings_whole(&options->common, 1, 1);
    settings.precision = precision;
    return settings;
}

// Runs the cases at the current precision that have not ended.
static void precision_verify(Verification *verification, Compute *compute)
{
    const VerifyOptions *options = verification->options;
    const VerifySettings settings = {.render = precision_settings(options, verification->precision),
                                     .quick = options->quick,
                                     .lean = options->lean};
    const VerifyTier tier = verify_tier(&settings.render);
    PrecisionRecord *record = verification->record;
    verification->tier = (char)('A' + tier);
    if (!record->is_started) {
        record->start_seconds = clock_seconds();
        if (tier == TIER_D && verify_reference_bits() < 64)
            fprintf(stderr,
                    "glint: verify: the reference has %d bits here: tier D is checked against numbers of the "
                    "precision that it tests\n",
                    verify_reference_bits());
        if (verification->has_text) {
            line_begin(verification);
            printf("%s\n", precision_names[verification->precision]);
            fflush(stdout);
        }
        record->is_started = true;
    }
    const VerifyChoice choice = {options->names.items, options->names.count};
    const VerifySink sink = {case_start, case_receive, verification};
    verify_run(compute, &settings, choice.count > 0 ? &choice : NULL, &sink, &record->kernels);
    record->seconds = clock_seconds() - record->start_seconds;
    if (!compute_ok(compute)) return;
    record->is_ended = true;
    if (!verification->has_text) return;
    const size_t count = records_count(record, has_ended);
    line_begin(verification);
    printf("  tier %c: %zu of %zu case%s passed, in %.1f s; kernels: trace %016" PRIx64 ", render %016" PRIx64
           "\n",
           verification->tier, count - records_count(record, has_failed), count, text_plural(count),
           record->seconds, record->kernels.trace_hash, record->kernels.render_hash);
    fflush(stdout);
}

static void precision_add_json(Json *json, const PrecisionRecord *record, Precision precision,
                               const VerifyOptions *options)
{
    const RenderSettings settings = precision_settings(options, precision);
    const char tier[] = {(char)('A' + verify_tier(&settings)), '\0'};
    json_begin_object(json, NULL);
    json_text(json, "precision", precision_names[precision]);
    json_text(json, "tier", tier);
    json_begin_array(json, "cases");
    for (size_t i = 0; i < VERIFY_CASES_MAX; i++)
        if (has_ended(&record->cases[i])) record_add_json(json, &record->cases[i]);
    json_end(json);
    const size_t failed = records_count(record, has_failed);
    json_int64(json, "lanes", record->kernels.lanes);
    hash_json(json, "trace_kernel", record->kernels.trace_hash);
    hash_json(json, "render_kernel", record->kernels.render_hash);
    json_count(json, "passed", records_count(record, has_ended) - failed);
    json_count(json, "failed", failed);
    json_number(json, "seconds", record->seconds);
    json_end(json);
}

static Json *journal_json(const Verification *verification)
{
    const VerifyOptions *options = verification->options;
    Json *json = report_json_open(3, verification->compute->device);
    json_int64(json, "reference_bits", verify_reference_bits());
    json_bool(json, "quick", options->quick);
    perturb_json(json, options->common.perturb_seed, options->common.perturb_scale);
    json_begin_array(json, "precisions");
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        const PrecisionRecord *record = &verification->journal->precisions[precision];
        if (record->is_started) precision_add_json(json, record, precision, options);
    }
    json_end(json);
    return json;
}

// Prints why the device's arithmetic is unsuitable for a precision.
static bool arithmetic_is_suitable(Compute *compute, const VerifyOptions *options, Precision precision)
{
    const RenderSettings settings = precision_settings(options, precision);
    MessageList messages = {0};
    const bool is_suitable = arithmetic_suits(compute, &settings, &messages);
    messages_print(&messages, NULL);
    return is_suitable;
}

static int device_verify(Verification *verification, Compute *compute)
{
    const VerifyOptions *options = verification->options;
    VerifyJournal *journal = verification->journal;
    Precision first = options->common.has_precision ? options->common.precision : PRECISION_SINGLE;
    Precision last = options->common.has_precision ? options->common.precision : PRECISION_DOUBLE;
    if (!compute->device->fp64 && last == PRECISION_DOUBLE) {
        if (options->common.has_precision) {
            fprintf(stderr, "glint: precision double: the device \"%s\" has no 64-bit floating point\n",
                    compute->device->name);
            return EXIT_USER;
        }
        last = PRECISION_STRICT;
    }
    if (options->common.has_precision && !journal->is_headed &&
        !arithmetic_is_suitable(compute, options, first))
        return EXIT_USER;
    if (verification->has_text && !journal->is_headed) {
        printf("%s; reference of %d bits%s\n", compute->device->name, verify_reference_bits(),
               options->quick ? "; quick" : "");
        fflush(stdout);
    }
    journal->is_headed = true;
    verification->row_count = verification->case_count * (size_t)(last - first + 1);
    size_t failed = 0;
    for (Precision precision = first; precision <= last && compute_ok(compute); precision++) {
        PrecisionRecord *record = &journal->precisions[precision];
        verification->precision = precision;
        verification->record = record;
        if (!record->is_started && !record->is_unsuitable)
            record->is_unsuitable = !arithmetic_is_suitable(compute, options, precision);
        if (!record->is_ended && !record->is_unsuitable) precision_verify(verification, compute);
        failed += records_count(record, has_failed);
    }
    progress_close(&verification->progress);
    if (verification->has_text) passports_remark(compute->device, stdout);
    if (options->common.report.format != FORMAT_TEXT &&
        !report_write(journal_json(verification), &options->common.report))
        return EXIT_USER;
    return failed > 0 ? EXIT_CHECK : EXIT_DONE;
}

static int verification_work(void *context)
{
    Verification *verification = context;
    OpenDevice open;
    if (!device_open(&open, &verification->options->common)) return EXIT_USER;
    verification->compute = &open.compute;
    progress_open(&verification->progress, false);
    progress_end_at_once();
    return device_close(&open, device_verify(verification, &open.compute));
}

static bool result_discard(void *context, const VerifyResult *result)
{
    (void)context, (void)result;
    return true;
}

// Starts a process that adds the kernels of `strict` and `double` to the cache while `single` is
// verified, by running a case that needs all of them. It ends with this process. No OpenCL call may have been
// made before.
static void builder_start(const VerifyOptions *options)
{
    static char name[] = "P6";
    char *const names[] = {name};
    const VerifyChoice choice = {names, 1};
    const VerifySink sink = {.receive = result_discard};
    const pid_t parent = getpid();
    fflush(stdout); // otherwise each process would print the contents of the buffer
    if (fork() != 0) return;
    child_end_with(parent);
    if (!freopen("/dev/null", "w", stdout) || !freopen("/dev/null", "w", stderr)) _exit(EXIT_USER);
    OpenDevice open;
    if (!device_open(&open, &options->common)) _exit(EXIT_USER);
    const Precision last = open.compute.device->fp64 ? PRECISION_DOUBLE : PRECISION_STRICT;
    for (Precision precision = PRECISION_STRICT; precision <= last; precision++) {
        const VerifySettings settings = {.render = precision_settings(options, precision), .quick = true};
        VerifyKernels kernels = {0};
        verify_run(&open.compute, &settings, &choice, &sink, &kernels);
    }
    _exit(EXIT_DONE);
}

int command_verify(int argument_count, char **arguments)
{
    VerifyOptions options = {.common.bounce_count = BOUNCES_DEFAULT, .common.report.table = &verify_table};
    int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    Verification verification = {.options = &options,
                                 .journal = verify_journal_open(),
                                 .has_text = report_has_text(&options.common.report)};
    for (size_t i = 0; verify_case_name(i); i++)
        verification.case_count += is_chosen(&options, verify_case_name(i));
    const CommonOptions *common = &options.common;
    if (!options.common.has_precision && options.names.count == 0 && !options.lean && !common->no_cache &&
        !common->kernel_folder)
        builder_start(&options);
    return verify_journal_work(verification.journal, verification_work, &verification);
}
