// glint verify runs the hard cases on a device and prints one line per case.
#include "host/verify/verify.h"
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/exit_status.h"
#include "host/base/json.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/format.h"
#include "host/cli/interrupts.h"
#include "host/cli/open_device.h"
#include "host/cli/passport_report.h"
#include "host/cli/progress.h"
#include "host/cli/report_json.h"
#include "host/cli/verify_journal.h"
#include "host/render/arithmetic.h"
#include "host/scene/quad.h"
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
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
    bool quick, lean;      // the members of VerifySettings
    CommandOperands names; // of the cases, all if none is named
} VerifyOptions;

static const Option command_options[] = {
    {"quick", NULL, "a sixteenth of the random rays, and fewer pixels", option_flag,
     offsetof(VerifyOptions, quick)},
    {"lean", NULL, "build one small kernel per scene instead of one for all, for slow compilers", option_flag,
     offsetof(VerifyOptions, lean)}};
static const Option command_precision[] = {
    PRECISION_OPTION("single, strict or double (default: all that the device has)", ARITHMETIC_COUNT)};

// Returns the index of a case, or the number of cases if there is none of this name.
static size_t case_index(const char *name)
{
    size_t i = 0;
    while (verify_case_name(i) && strcmp(verify_case_name(i), name) != 0)
        i++;
    return i;
}

bool verify_case_check(const char *name)
{
    if (verify_case_name(case_index(name))) return true;
    fprintf(stderr, "glint: there is no case \"%s\"; the cases are ", name);
    for (size_t i = 0; verify_case_name(i); i++)
        fprintf(stderr, "%s%s", i ? ", " : "", verify_case_name(i));
    fprintf(stderr, " (docs/verify.md)\n");
    return false;
}

static const CommandLine command_line = {
    .command = "verify",
    .usage =
        "usage: glint verify [CASE...] [OPTIONS]\n\n"
        "Runs the hard cases, or those named, on a device and checks each against its bound; exit status "
        "3 if any fails.\n",
    .groups = {OPTIONS(command_precision), OPTIONS(command_options), OPTIONS(device_option),
               OPTION(common_options[COMMON_LANES]), OPTION(common_options[COMMON_NO_CACHE]),
               OPTIONS(driver_options), OPTIONS(keep_kernels_option), OPTIONS(perturb_option),
               REPORT_OPTIONS},
    OPERANDS(ANY, VerifyOptions, names),
    .operand_check = verify_case_check};

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

// The counts of faults of a result.
static const struct {
    const char *key, *words;
    size_t offset;
} faults[] = {{"wrong", "wrong", offsetof(VerifyResult, wrong)},
              {"leaks", "leaks", offsetof(VerifyResult, leaks)},
              {"unsound", "unsound", offsetof(VerifyResult, unsound)},
              {"off", "off the surface", offsetof(VerifyResult, off_surface)},
              {"turned", "normals turned", offsetof(VerifyResult, wrong_normals)},
              {"differing", "differ", offsetof(VerifyResult, differing)}};

static size_t fault_count(const VerifyResult *result, size_t index)
{
    return *(const size_t *)((const char *)result + faults[index].offset);
}

// Prints text in place of the line of progress, if the command prints text.
static void __attribute__((format(printf, 2, 3)))
text_print(Verification *verification, const char *format, ...)
{
    if (!verification->has_text) return;
    progress_close(&verification->progress);
    va_list arguments;
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    fflush(stdout);
}

static void record_print(Verification *verification, CaseRecord *record)
{
    const VerifyResult *result = &record->result;
    OwnedText line = {0};
    if (record->state == CASE_CRASHED)
        text_appendf(&line, "%25s  FAIL  %s", "", record->crash);
    else if (result->bound > 0)
        text_appendf(&line, "%8.3g of %-8.3g %-4s", result->worst, result->bound, result->unit);
    else
        text_appendf(&line, "%20zu rays", result->ray_count);
    if (record->state != CASE_CRASHED) {
        text_appendf(&line, "  %s", verify_holds(result) ? "ok" : "FAIL");
        for (size_t i = 0; i < COUNT_OF(faults); i++)
            if (fault_count(result, i) > 0)
                text_appendf(&line, "  %zu %s", fault_count(result, i), faults[i].words);
    }
    text_print(verification, "  %-3s %c  %-60s %s\n", result->name, verification->tier, result->title,
               text_c(&line));
    record->is_printed = true;
}

static void record_json(Json *json, const CaseRecord *record)
{
    const VerifyResult *result = &record->result;
    const bool has_bound = result->bound > 0;
    json_begin_object(json, NULL);
    json_addf(json, "name %s title %s passed %d", result->name, result->title, !has_failed(record));
    if (record->state == CASE_CRASHED) {
        json_text(json, "crash", record->crash);
    } else {
        json_count(json, "rays", result->ray_count);
        for (size_t i = 0; i < COUNT_OF(faults); i++)
            json_count(json, faults[i].key, fault_count(result, i));
        json_addf(json, "surface_part %g normal_part %g worst %g bound %g", result->worst_position_ratio,
                  result->worst_normal_ratio, has_bound ? result->worst : NAN,
                  has_bound ? result->bound : NAN);
        if (has_bound) json_text(json, "unit", result->unit);
        json_addf(json, "hash %016" PRIx64, result->hash);
    }
    json_number(json, "seconds", record->seconds);
    json_end(json);
}

static size_t rows_ended(const Verification *verification)
{
    size_t count = 0;
    for (size_t i = 0; i < ARITHMETIC_COUNT; i++)
        count += records_count(&verification->journal->precisions[i], has_ended);
    return count;
}

static bool case_start(void *context, const VerifyResult *result)
{
    Verification *verification = context;
    CaseRecord *record = &verification->record->cases[case_index(result->name)];
    if (!is_chosen(verification->options, result->name)) return false;
    if (record->state == CASE_CRASHED && !record->is_printed) record_print(verification, record);
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
    CaseRecord *record = &verification->record->cases[case_index(result->name)];
    record->result = *result;
    record->seconds = clock_seconds() - record->start_seconds;
    record->state = CASE_DONE;
    record_print(verification, record);
    return true;
}

static RenderSettings precision_settings(const VerifyOptions *options, Precision precision)
{
    RenderSettings settings = settings_whole(&options->common, 1, 1);
    settings.precision = precision;
    return settings;
}

// Prints the hash of a kernel unless no case needed it.
static void hash_print(Verification *verification, const char *kernel, uint64_t hash)
{
    if (hash != 0) text_print(verification, "; %s kernel %016" PRIx64, kernel, hash);
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
        if (tier == TIER_D && QUAD_BITS < 64)
            stderr_print("the reference has %d bits here: tier D is checked against numbers of the "
                         "precision that it tests",
                         QUAD_BITS);
        text_print(verification, "%s\n", precision_names[verification->precision]);
        record->is_started = true;
    }
    const VerifySink sink = {case_start, case_receive, verification};
    verify_run(compute, &settings, &sink, &record->kernels);
    record->seconds = clock_seconds() - record->start_seconds;
    if (!compute_ok(compute)) return;
    record->is_ended = true;
    const size_t count = records_count(record, has_ended);
    text_print(verification, "  tier %c: %zu of %zu case%s passed, in %.1f s", verification->tier,
               count - records_count(record, has_failed), count, text_plural(count), record->seconds);
    hash_print(verification, "trace", record->kernels.trace_hash);
    hash_print(verification, "render", record->kernels.render_hash);
    text_print(verification, "\n");
}

static void precision_json(Json *json, const PrecisionRecord *record, Precision precision,
                           const VerifyOptions *options)
{
    const RenderSettings settings = precision_settings(options, precision);
    const char tier[] = {(char)('A' + verify_tier(&settings)), '\0'};
    const size_t failed = records_count(record, has_failed);
    json_begin_object(json, NULL);
    json_addf(json, "precision %s tier %s", precision_names[precision], tier);
    json_begin_array(json, "cases");
    for (size_t i = 0; i < VERIFY_CASES_MAX; i++)
        if (has_ended(&record->cases[i])) record_json(json, &record->cases[i]);
    json_end(json);
    json_addf(json,
              "lanes %u trace_kernel %016" PRIx64 " render_kernel %016" PRIx64
              " passed %zu failed %zu seconds %g",
              record->kernels.lanes, record->kernels.trace_hash, record->kernels.render_hash,
              records_count(record, has_ended) - failed, failed, record->seconds);
    json_end(json);
}

static Json *journal_json(const Verification *verification)
{
    const VerifyOptions *options = verification->options;
    Json *json = report_json_open(3, verification->compute->device);
    json_addf(json, "reference_bits %u quick %d", (unsigned)QUAD_BITS, options->quick);
    perturb_json(json, options->common.settings.perturb_seed, options->common.settings.perturb_scale);
    json_begin_array(json, "precisions");
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        const PrecisionRecord *record = &verification->journal->precisions[precision];
        if (record->is_started) precision_json(json, record, precision, options);
    }
    json_end(json);
    return json;
}

// Returns whether the device suits a precision. If not, prints the reason.
static bool precision_is_suitable(Compute *compute, const VerifyOptions *options, Precision precision)
{
    const RenderSettings settings = precision_settings(options, precision);
    PrintedMessages messages = {0};
    return device_suits(compute, &settings, &messages);
}

static int device_verify(Verification *verification, Compute *compute)
{
    const VerifyOptions *options = verification->options;
    VerifyJournal *journal = verification->journal;
    Precision first = options->common.has_precision ? options->common.settings.precision : PRECISION_SINGLE;
    Precision last = options->common.has_precision ? options->common.settings.precision : PRECISION_DOUBLE;
    if (!options->common.has_precision && !compute->device->fp64) last = PRECISION_STRICT;
    if (options->common.has_precision && !journal->is_headed &&
        !precision_is_suitable(compute, options, first))
        return EXIT_USER;
    if (!journal->is_headed)
        text_print(verification, "%s; reference of %d bits%s\n  case   %-60s %s\n", compute->device->name,
                   QUAD_BITS, options->quick ? "; --quick" : "", "test", "largest error of its bound");
    journal->is_headed = true;
    verification->row_count = verification->case_count * (size_t)(last - first + 1);
    size_t failed = 0;
    for (Precision precision = first; precision <= last && compute_ok(compute); precision++) {
        PrecisionRecord *record = &journal->precisions[precision];
        verification->precision = precision;
        verification->record = record;
        if (!record->is_started && !record->is_unsuitable)
            record->is_unsuitable = !precision_is_suitable(compute, options, precision);
        if (!record->is_ended && !record->is_unsuitable) precision_verify(verification, compute);
        failed += records_count(record, has_failed);
    }
    progress_close(&verification->progress);
    if (verification->has_text) passports_remark(compute->device, stdout);
    const ReportOptions *report = &options->common.report;
    if (report_has_document(report) && !report_write(journal_json(verification), report)) return EXIT_USER;
    return failed > 0 ? EXIT_CHECK : EXIT_DONE;
}

static int verification_work(void *context)
{
    Verification *verification = context;
    OpenDevice open;
    if (!device_open(&open, &verification->options->common)) return EXIT_USER;
    verification->compute = &open.compute;
    progress_open(&verification->progress, false);
    interrupts_end_at_once();
    return device_close(&open, device_verify(verification, &open.compute));
}

static bool needs_all_kernels(void *context, const VerifyResult *result)
{
    (void)context;
    return strcmp(result->name, "P6") == 0;
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
    const VerifySink sink = {.start = needs_all_kernels, .receive = result_discard};
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
        if (precision_is_suitable(&open.compute, options, precision))
            verify_run(&open.compute, &settings, &sink, &kernels);
    }
    _exit(EXIT_DONE);
}

int command_verify(int argument_count, char **arguments)
{
    VerifyOptions options = {.common.settings.bounce_count = BOUNCES_DEFAULT,
                             .common.report.table = &verify_table};
    int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    Verification verification = {.options = &options,
                                 .journal = verify_journal_open(),
                                 .has_text = report_has_text(&options.common.report)};
    for (size_t i = 0; verify_case_name(i); i++)
        verification.case_count += is_chosen(&options, verify_case_name(i));
    const CommonOptions *common = &options.common;
    if (!options.common.has_precision && options.names.count == 0 && !options.lean &&
        !common->settings.no_cache && !common->driver.kernel_folder)
        builder_start(&options);
    return verify_journal_work(verification.journal, verification_work, &verification);
}
