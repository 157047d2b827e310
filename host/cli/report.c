// glint report runs the commands that a bug report needs, each in a separate process, and writes one archive.
// With reports of glint bench it compares these instead.
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/exit_status.h"
#include "host/base/output.h"
#include "host/cli/commands.h"
#include "host/cli/interrupts.h"
#include "host/cli/options.h"
#include "host/cli/progress.h"
#include "host/cli/report_archive.h"
#include "host/cli/side_by_side.h"
#include "host/cli/variants.h"
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char scene_text[] = "# What glint bench times for glint report.\n"
                                 "camera: {position: [0, 2, -6], look_at: [0, 0.5, 0], fov: 50}\n"
                                 "lights: [{point: {position: [3, 5, -4]}}]\n"
                                 "objects:\n"
                                 "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
                                 "  - sphere: {center: [-1, 1, 0], radius: 1, material: {reflection: 0.4}}\n"
                                 "  - triangle: {vertices: [[1, 0, 0], [2, 0, 1], [1.5, 1.5, 0.5]]}\n";

enum { PASSED_MAX = 5, STEP_ARGUMENTS_MAX = 12 };

typedef struct {
    CommonOptions common;
    const char *output, *page; // NULL if not given
    char *passed[PASSED_MAX];  // options for verify and bench
    size_t passed_count;
    CommandOperands operands; // cases, or reports to compare
    bool compares;
    double seconds; // 0 if not given
} ReportChoice;

static const Option archive_options[] = {{"output", "FILE", "the archive (default: glint-report.tar.gz)",
                                          option_text, offsetof(ReportChoice, output), .letter = 'o'},
                                         {"seconds", "MAX", "time limit of each step (default: 1800)",
                                          option_number, offsetof(ReportChoice, seconds),
                                          NUMBERS_ABOVE(0, SECONDS_MAX)}};
static const Option command_precision[] = {PRECISION_OPTION(
    "single, strict or double (default: all for verify, single for bench)", ARITHMETIC_COUNT)};
static const Option page_option[] = {{"html", "FILE", "write a self-contained HTML page of this comparison",
                                      option_named_file, offsetof(ReportChoice, page)}};

// Lists the options for verify and bench.
static void passed_list(ReportChoice *choice)
{
    const CommonOptions *common = &choice->common;
    char **next = choice->passed;
    if (common->device) *next++ = text_format("--device=%s", common->device);
    if (common->has_precision)
        *next++ = text_format("--precision=%s", precision_names[common->settings.precision]);
    if (common->settings.lanes > 0) *next++ = text_format("--lanes=%u", common->settings.lanes);
    if (common->driver.work_group[0] > 0)
        *next++ =
            text_format("--work-group=%ux%u", common->driver.work_group[0], common->driver.work_group[1]);
    if (common->driver.build_options)
        *next++ = text_format("--build-options=%s", common->driver.build_options);
    choice->passed_count = (size_t)(next - choice->passed);
}

static bool is_bench_report(const char *operand)
{
    const char *ending = strrchr(operand, '.');
    return ending && strcmp(ending, ".json") == 0;
}

// Checks that the operands are cases, or all are reports of glint bench to compare.
static bool operands_check(const ReportChoice *choice)
{
    for (size_t i = 0; i < choice->operands.count; i++) {
        const char *operand = choice->operands.items[i];
        if (!choice->compares && !verify_case_check(operand)) return false;
        if (choice->compares && !is_bench_report(operand))
            return stderr_print("'%s' is not a report of glint bench, whose name ends in .json", operand);
    }
    return true;
}

static const char *options_check(void *report_choice)
{
    ReportChoice *choice = report_choice;
    passed_list(choice);
    size_t count = 0;
    for (size_t i = 0; i < choice->operands.count; i++)
        count += is_bench_report(choice->operands.items[i]);
    choice->compares = count > 0 || choice->page;
    if (!choice->compares) return NULL;
    if (count == 0) return "--html needs reports of glint bench, whose names end in .json";
    if (choice->output || choice->seconds > 0 || choice->passed_count > 0)
        return "--html is the only option for reports (.json)";
    if (count > SIDE_REPORTS_MAX) return "at most 26 reports can be compared";
    return NULL;
}

static const CommandLine command_line = {
    .command = "report",
    .usage = "usage: glint report [CASE...] [OPTIONS]\n"
             "       glint report REPORT.json... [--html FILE]\n\n"
             "Writes an archive for a bug report: the output of glint devices, its passports, glint verify "
             "--quick and a\nsmall glint bench, the text and build log of every kernel, and versions. All "
             "kernels are built, which takes\nminutes. A step that fails or crashes is named in index.txt. "
             "Names of the user, the host and folders are left\nout. With CASE, glint verify runs only these "
             "cases.\n",
    .groups = {OPTIONS(archive_options),
               OPTIONS(command_precision),
               OPTIONS(device_option),
               OPTION(common_options[COMMON_LANES]),
               OPTIONS(driver_options),
               {page_option, 1,
                "With reports of glint bench --json instead, shows their rows side by side: of several "
                "devices, versions or days. A\nrow is faster or slower than in the first report only where "
                "both are of the same device and host.\n"}},
    OPERANDS(ANY, ReportChoice, operands),
    .check = options_check};

// A command that the report runs in its folder. It prints to the file `name`.`prints`.
typedef struct {
    const char *name, *prints;
    const char *arguments[STEP_ARGUMENTS_MAX];
    bool has_options, has_cases; // whether the user's options and cases follow
    const char *program;         // NULL for glint
} Step;

#define KEEP_KERNELS "--keep-kernels", "kernels"
static const Step steps[] = {
    {"devices", "json", {"devices", "--json"}, false, false},
    {"passports", "json", {"devices", "--probe", "--json", KEEP_KERNELS}, false, false},
    {"verify", "txt", {"verify", "--quick", "--output", "verify.json", KEEP_KERNELS}, true, true},
    {"bench",
     "txt",
     {"bench", "scene.yaml", "--size", "160x120", "--seconds", "2", "--output", "bench.json", KEEP_KERNELS},
     true,
     false},
};
enum { STEP_COUNT = COUNT_OF(steps) };

static const Step archive_step = {"archive",
                                  "tar.gz",
                                  {"--create", "--file=-", "--gzip", "--owner=0", "--group=0",
                                   "--numeric-owner", "--mode=644", "--files-from", REPORT_NAMES},
                                  .program = "tar"};

typedef struct {
    double seconds;
    char *failure; // NULL if the step has succeeded
} StepResult;

static int folder_entry_remove(const char *path, const struct stat *status, int type, struct FTW *walk)
{
    (void)status, (void)type, (void)walk;
    remove(path);
    return 0;
}

static void folder_remove(const char *path)
{
    enum { OPEN_FOLDERS_MAX = 16 };
    nftw(path, folder_entry_remove, OPEN_FOLDERS_MAX, FTW_DEPTH | FTW_PHYS);
}

// Creates the folder in which the steps run. The caller removes and frees it. Returns NULL with a message on
// failure.
static char *steps_folder_create(MessageList *messages)
{
    const char *parent = getenv("TMPDIR");
    OWNED char *folder = text_format("%s/glint-report-XXXXXX", parent && parent[0] ? parent : "/tmp");
    char *absolute = mkdtemp(folder) ? realpath(folder, NULL) : NULL; // as the caches' variables must be
    if (!absolute) message_error(messages, "cannot create the folder '%s': %s", folder, strerror(errno));
    return absolute;
}

// Writes the versions and the scene that glint bench renders. Returns false with a message on failure.
static bool inputs_write(const char *folder, MessageList *messages)
{
    OwnedText versions = report_versions(), scene = {0};
    text_append(&scene, scene_text, sizeof scene_text - 1);
    return report_file_write(folder, "versions.txt", &versions, messages) &&
           report_file_write(folder, "scene.yaml", &scene, messages);
}

// Places the steps' temporary files and kernel caches in the folder. The caches are empty, so every kernel
// is built and has a log.
static void variables_set(const char *folder)
{
    static const char *const variables[] = {"XDG_CACHE_HOME", "POCL_CACHE_DIR", "TMPDIR"};
    for (size_t i = 0; i < COUNT_OF(variables); i++)
        setenv(variables[i], folder, true);
    unsetenv("TAR_OPTIONS");
}

// Waits for a step's process. Returns false if it had to be stopped, at the time limit or by an interrupt.
static bool process_wait(pid_t process, double seconds, Progress *progress, double fraction, int *status)
{
    static const struct timespec pause = {.tv_nsec = 20000000};
    const double limit = clock_seconds() + seconds;
    bool is_stopped = false;
    while (waitpid(process, status, WNOHANG) == 0) {
        if (!is_stopped && (is_interrupted() || clock_seconds() > limit)) {
            is_stopped = true;
            kill(process, SIGKILL);
        }
        progress_show(progress, fraction);
        nanosleep(&pause, NULL);
    }
    return !is_stopped;
}

// Returns why the process failed, or NULL. A failed check is a result.
static char *status_failure(int status)
{
    if (WIFSIGNALED(status)) return text_format("ended by a signal: %s", strsignal(WTERMSIG(status)));
    const int code = WEXITSTATUS(status);
    return code == EXIT_DONE || code == EXIT_CHECK ? NULL : text_format("exit status %d", code);
}

// Starts a step. Returns 0 or an error number.
static int step_start(const Step *step, const ReportChoice *choice, const char *folder, pid_t *process)
{
    char name[] = "glint";
    OWNED char **arguments = memory_allocate_zeroed(
        1 + STEP_ARGUMENTS_MAX + PASSED_MAX + choice->operands.count + 1, sizeof *arguments);
    size_t count = 0;
    arguments[count++] = step->program ? (char *)step->program : name;
    for (size_t i = 0; step->arguments[i]; i++)
        arguments[count++] = (char *)step->arguments[i];
    for (size_t i = 0; step->has_options && i < choice->passed_count; i++)
        arguments[count++] = choice->passed[i];
    for (size_t i = 0; step->has_cases && i < choice->operands.count; i++)
        arguments[count++] = choice->operands.items[i];
    OWNED char *output = text_format("%s/%s.%s", folder, step->name, step->prints),
               *messages = text_format("%s/%s.log", folder, step->name);
    posix_spawn_file_actions_t actions;
    int error = posix_spawn_file_actions_init(&actions);
    if (!error) {
        posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output, O_WRONLY | O_CREAT, 0600);
        posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, messages, O_WRONLY | O_CREAT, 0600);
        posix_spawn_file_actions_addchdir_np(&actions, folder);
        error = posix_spawnp(process, step->program ? step->program : "/proc/self/exe", &actions, NULL,
                             arguments, environ);
        posix_spawn_file_actions_destroy(&actions);
    }
    return error;
}

// Runs a step, which is killed after `seconds`.
static StepResult step_run(const Step *step, const ReportChoice *choice, double seconds, const char *folder,
                           Progress *progress, double fraction)
{
    progress_step(progress, fraction, "%s", step->name);
    const double start = clock_seconds();
    StepResult result = {0};
    pid_t process;
    int status = 0;
    const int error = step_start(step, choice, folder, &process);
    if (error)
        result.failure = text_format("not started: %s", strerror(error));
    else if (!process_wait(process, seconds, progress, fraction, &status))
        result.failure = text_format("stopped after %s", text_duration(seconds).text);
    else
        result.failure = status_failure(status);
    result.seconds = clock_seconds() - start;
    return result;
}

// Returns a line for each step. Adds a warning for each that failed.
static Text results_text(const StepResult *results, MessageList *messages)
{
    Text text = {0};
    for (size_t i = 0; i < STEP_COUNT; i++) {
        const char *failure = results[i].failure;
        text_appendf(&text, "  %-10s %s%s, %.1f s\n", steps[i].name, failure ? "FAILED: " : "done",
                     failure ? failure : "", results[i].seconds);
        if (failure) message_warning(messages, "the step %s failed: %s", steps[i].name, failure);
    }
    return text;
}

// Archives the files of the folder by tar. Returns the exit status, which is EXIT_MACHINE if tar fails.
static int archive_write(const ReportChoice *choice, const char *folder, OutputFile *output,
                         Progress *progress, MessageList *messages)
{
    OWNED char *failure = step_run(&archive_step, choice, INFINITY, folder, progress, 1).failure;
    OWNED char *path = text_format("%s/archive.tar.gz", folder);
    OWNED char *log_path = text_format("%s/archive.log", folder);
    OwnedText archive = {0}, log = {0};
    if (is_interrupted()) return EXIT_INTERRUPTED;
    if (failure) {
        text_read_file(&log, log_path, NULL);
        const int length = (int)strcspn(text_c(&log), "\n"); // later lines are consequences
        message_error(messages, "tar cannot write the archive: %s%s%.*s; its files stay in %s", failure,
                      length > 0 ? ": " : "", length, text_c(&log), folder);
        return EXIT_MACHINE;
    }
    const bool is_written = text_read_file(&archive, path, messages) &&
                            output_write(output, archive.items, archive.count, messages) &&
                            output_commit(output, messages);
    return is_written ? EXIT_DONE : EXIT_USER;
}

// Runs the steps and writes the archive. Returns the exit status.
static int report_make(const ReportChoice *choice, const char *folder, OutputFile *output,
                       MessageList *messages)
{
    Progress progress;
    StepResult results[STEP_COUNT] = {0};
    variables_set(folder);
    progress_open(&progress, false);
    for (size_t i = 0; i < STEP_COUNT && !is_interrupted(); i++)
        results[i] = step_run(&steps[i], choice, choice->seconds, folder, &progress, (double)i / STEP_COUNT);
    size_t count = 0;
    int status = EXIT_INTERRUPTED;
    if (!is_interrupted()) {
        OwnedText lines = results_text(results, messages);
        Scrubber scrubber = scrubber_open(folder);
        count = report_files_prepare(folder, &scrubber, text_c(&lines), messages);
        scrubber_close(&scrubber);
        status = count > 0 ? archive_write(choice, folder, output, &progress, messages) : EXIT_USER;
    }
    progress_close(&progress);
    for (size_t i = 0; i < STEP_COUNT; i++)
        free(results[i].failure);
    if (status == EXIT_DONE && strcmp(choice->output, "-") != 0)
        printf("%s: %zu files\n", choice->output, count);
    return status;
}

// Opens the archive, runs the steps and writes it. Returns the exit status.
static int archive_make(ReportChoice *choice)
{
    if (!choice->output) choice->output = "glint-report.tar.gz";
    if (choice->seconds == 0) choice->seconds = 1800;
    OutputFile output;
    MessageList messages = {0};
    const bool is_open = output_open(&output, choice->output, &messages);
    OWNED char *folder = is_open ? steps_folder_create(&messages) : NULL;
    const bool is_ready = folder && inputs_write(folder, &messages);
    const int status = is_ready  ? report_make(choice, folder, &output, &messages)
                       : is_open ? EXIT_MACHINE
                                 : EXIT_USER;
    if (folder && !(is_ready && status == EXIT_MACHINE)) folder_remove(folder);
    if (is_open && status != EXIT_DONE) output_abandon(&output);
    messages_print(&messages, NULL);
    return status;
}

int command_report(int argument_count, char **arguments)
{
    ReportChoice choice = {0};
    int status = command_line_read(&command_line, &choice, argument_count, arguments);
    if (status == OPTIONS_READ)
        status = !operands_check(&choice) ? EXIT_USER
                 : choice.compares
                     ? side_by_side_run(choice.operands.items, choice.operands.count, choice.page)
                     : archive_make(&choice);
    for (size_t i = 0; i < choice.passed_count; i++)
        free(choice.passed[i]);
    return status;
}
