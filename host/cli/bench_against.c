#include "host/cli/bench_against.h"

#include "host/base/clock.h"
#include "host/base/exit_status.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/bench_report.h"
#include "host/cli/interrupts.h"
#include "host/cli/passport_report.h"
#include "host/cli/report_json.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

// A worker first prints this line with its number of rows. For each line that it reads, it then prints a line
// with the seconds of a frame of every row, or 0 for a row that the device cannot render.
static const char greeting[] = "glint bench worker 1: %zu rows\n";

int bench_work(VariantSet *set, Compute *compute)
{
    if (!variant_set_start(set, compute, false, NULL)) return EXIT_INTERRUPTED;
    printf(greeting, set->count);
    fflush(stdout);
    for (int byte; (byte = getchar()) != EOF;) {
        if (byte != '\n') continue;
        if (!variant_set_round(set, false)) return EXIT_INTERRUPTED;
        for (size_t i = 0; i < set->count; i++) {
            const Series *frame = &set->rows[i].times.frame;
            printf("%s%.9g", i > 0 ? " " : "", frame->count > 0 ? frame->items[frame->count - 1] : 0.0);
        }
        putchar('\n');
        fflush(stdout);
    }
    return EXIT_DONE;
}

typedef struct {
    const char *name, *path; // as messages print it, and as it is started
    pid_t process;
    FILE *requests, *replies, *errors;
} MeasuredProgram;

typedef struct {
    const AgainstOptions *options;
    VariantSet *set;
    MeasuredProgram programs[2]; // this program and the other, not started
    struct {
        Series ratios;    // the logarithms of the ratios, one per pair
        Series frames[2]; // the seconds of all runs of this program and of the other
    } * rows;
    RowComparison *comparisons; // of the rows
} Against;

static const char not_available[] = "not available on this device";

// Ends the worker and returns its exit status. If that is not 0, prints the worker's messages, unless the
// user interrupted, since every process received the interrupt.
static int worker_close(MeasuredProgram *worker)
{
    if (worker->requests) fclose(worker->requests);
    if (worker->replies) fclose(worker->replies);
    int status = EXIT_MACHINE, ended = 0;
    if (worker->process > 0) {
        while (waitpid(worker->process, &ended, 0) < 0 && errno == EINTR)
            continue;
        status = WIFEXITED(ended) ? WEXITSTATUS(ended) : EXIT_MACHINE;
        if (WIFSIGNALED(ended)) stderr_print("'%s' was ended by signal %d", worker->name, WTERMSIG(ended));
    }
    if (worker->errors) {
        char line[512];
        fseek(worker->errors, 0, SEEK_SET);
        while (status != EXIT_DONE && !is_interrupted() && fgets(line, sizeof line, worker->errors))
            fputs(line, stderr);
        fclose(worker->errors);
    }
    *worker = (MeasuredProgram){0};
    return status;
}

static bool worker_spawn(MeasuredProgram *worker, const AgainstOptions *options, const int *to,
                         const int *from)
{
    // --worker comes first, since an argument "--" ends the options
    OWNED char **arguments = memory_allocate_zeroed((size_t)options->argument_count + 3, sizeof *arguments);
    char bench[] = "bench", work[] = "--worker";
    OWNED char *name = memory_copy_text(worker->name);
    arguments[0] = name;
    arguments[1] = bench;
    arguments[2] = work;
    for (int i = 1; i < options->argument_count; i++)
        arguments[i + 2] = options->arguments[i];
    posix_spawn_file_actions_t actions;
    int error = posix_spawn_file_actions_init(&actions);
    if (!error) {
        posix_spawn_file_actions_adddup2(&actions, to[0], STDIN_FILENO);
        posix_spawn_file_actions_adddup2(&actions, from[1], STDOUT_FILENO);
        posix_spawn_file_actions_adddup2(&actions, fileno(worker->errors), STDERR_FILENO);
        error = posix_spawnp(&worker->process, worker->path, &actions, NULL, arguments, environ);
        posix_spawn_file_actions_destroy(&actions);
    }
    if (error) {
        worker->process = 0;
        stderr_print("cannot run '%s': %s", worker->name, strerror(error));
    }
    return !error;
}

// Returns whether the user interrupted. Every process receives the signal, so the worker may have exited
// before this process has noticed.
static bool worker_is_interrupted(const MeasuredProgram *worker)
{
    siginfo_t ended = {0};
    if (is_interrupted()) return true;
    if (!feof(worker->replies) || waitid(P_PID, (id_t)worker->process, &ended, WEXITED | WNOWAIT) != 0)
        return false;
    return ended.si_code == CLD_EXITED ? ended.si_status == EXIT_INTERRUPTED : ended.si_status == SIGINT;
}

static bool worker_greets(MeasuredProgram *worker, size_t row_count)
{
    char line[80], expected[80];
    snprintf(expected, sizeof expected, greeting, row_count);
    if (fgets(line, sizeof line, worker->replies) && strcmp(line, expected) == 0) return true;
    if (!worker_is_interrupted(worker))
        stderr_print("'%s' is not a glint that supports bench --against", worker->name);
    return false;
}

// Starts a worker and waits until it is warm.
static bool worker_open(MeasuredProgram *worker, const Against *against)
{
    worker->errors = tmpfile();
    int to[2] = {-1, -1}, from[2] = {-1, -1};
    bool ready = worker->errors && pipe2(to, O_CLOEXEC) == 0 && pipe2(from, O_CLOEXEC) == 0 &&
                 (worker->requests = fdopen(to[1], "w")) != NULL &&
                 (worker->replies = fdopen(from[0], "r")) != NULL;
    if (!ready) stderr_print("cannot run '%s': %s", worker->name, strerror(errno));
    bool spawned = ready && worker_spawn(worker, against->options, to, from);
    if (to[0] >= 0) close(to[0]);
    if (from[1] >= 0) close(from[1]);
    if (to[1] >= 0 && !worker->requests) close(to[1]);
    if (from[0] >= 0 && !worker->replies) close(from[0]);
    return spawned && worker_greets(worker, against->set->count);
}

// Reads one line of times.
static bool reply_read(FILE *replies, double *seconds, size_t row_count)
{
    OWNED char *line = NULL;
    size_t capacity = 0;
    bool whole = getline(&line, &capacity, replies) > 0;
    char *at = line;
    for (size_t i = 0; i < row_count && whole; i++) {
        char *end;
        seconds[i] = strtod(at, &end);
        whole = end != at && seconds[i] >= 0 && isfinite(seconds[i]);
        at = end;
    }
    return whole;
}

// Runs every row once; `seconds` receives the frames' times.
static bool worker_run(MeasuredProgram *worker, double *seconds, size_t row_count)
{
    fputc('\n', worker->requests);
    fflush(worker->requests);
    bool whole = reply_read(worker->replies, seconds, row_count);
    if (!whole && !worker_is_interrupted(worker)) stderr_print("'%s' exited early", worker->name);
    return whole;
}

// Returns whether the other program goes first at the n-th turn. The order is the Thue-Morse sequence, which
// cancels drifts.
static bool other_is_first(size_t n)
{
    return __builtin_popcountll(n) % 2 == 1;
}

enum { PAIR_ROUNDS_MIN = 5 };
static const double pair_seconds = 0.25; // the time per row

// Alternates rounds of the two warm workers and adds each row's ratio.
static bool pair_measure(Against *against, MeasuredProgram *workers, size_t pair)
{
    const size_t row_count = against->set->count;
    OWNED double *seconds = memory_allocate(row_count, sizeof *seconds);
    OWNED Series *times = memory_allocate_zeroed(2 * row_count, sizeof *times);
    bool whole = true;
    double start = clock_seconds();
    for (size_t round = 0;
         whole && (round < PAIR_ROUNDS_MIN || clock_seconds() - start < pair_seconds * (double)row_count);
         round++)
        for (size_t turn = 0; turn < 2 && whole; turn++) {
            size_t which = (turn + other_is_first(pair + round)) % 2;
            whole = worker_run(&workers[which], seconds, row_count) && !is_interrupted();
            for (size_t i = 0; i < row_count && whole; i++) {
                if (seconds[i] == 0 && !against->comparisons[i].why_not)
                    against->comparisons[i].why_not = not_available;
                series_add(&times[2 * i + which], seconds[i]);
                series_add(&against->rows[i].frames[which], seconds[i]);
            }
        }
    for (size_t i = 0; i < row_count && whole; i++)
        if (!against->comparisons[i].why_not)
            series_add(&against->rows[i].ratios, comparison_log_ratio(&times[2 * i], &times[2 * i + 1]));
    for (size_t i = 0; i < 2 * row_count; i++)
        series_free(&times[i]);
    return whole;
}

// Measures with a new pair of processes. Returns the exit status.
static int pair_run(Against *against, size_t pair)
{
    MeasuredProgram workers[2] = {against->programs[0], against->programs[1]};
    int status = EXIT_DONE;
    for (size_t turn = 0; turn < 2 && status == EXIT_DONE; turn++) {
        size_t which = (turn + other_is_first(pair)) % 2;
        if (worker_open(&workers[which], against)) continue;
        // only the other program was named by the user
        status = which == 0 && workers[which].process <= 0 ? EXIT_MACHINE : EXIT_USER;
    }
    if (status == EXIT_DONE && !pair_measure(against, workers, pair)) status = EXIT_USER;
    for (size_t which = 0; which < 2; which++) {
        bool was_started = workers[which].process > 0;
        int ended = worker_close(&workers[which]);
        if (was_started && ended == EXIT_MACHINE) status = EXIT_MACHINE;
    }
    return is_interrupted() ? EXIT_INTERRUPTED : status;
}

static bool rows_classify(Against *against, size_t look)
{
    bool decided = true;
    for (size_t i = 0; i < against->set->count; i++) {
        RowComparison *comparison = &against->comparisons[i];
        if (comparison->why_not) continue;
        comparison->frame = comparison_of_pairs(comparison->frame, &against->rows[i].ratios, look,
                                                against->set->count, against->options->tolerance);
        comparison->verdict = comparison->frame.verdict;
        decided = decided && comparison->verdict != VERDICT_UNDECIDED;
    }
    return decided;
}

// Adds pairs until every row has a verdict or the time has passed, when rows are classified a last time.
static int pairs_run(Against *against, Progress *progress)
{
    const size_t row_count = against->set->count;
    const double start = clock_seconds();
    double spent = 0;
    for (size_t look = 0, pair = 0;; look++) {
        while (pair < comparison_pairs_at_look(look, row_count) &&
               (pair == 0 || spent < against->options->seconds)) {
            int status = pair_run(against, pair++);
            if (status != EXIT_DONE) return status;
            spent = clock_seconds() - start;
            progress_show(progress, fmin(spent / against->options->seconds, 1));
        }
        if (rows_classify(against, look) || spent >= against->options->seconds) return EXIT_DONE;
    }
}

static Json *against_json(const Against *against, const Device *device)
{
    Json *json = bench_json_open(device);
    json_addf(json, "against %s confidence %g", against->options->other, comparison_confidence);
    json_begin_array(json, "runs");
    for (size_t i = 0; i < against->set->count; i++) {
        json_begin_object(json, NULL);
        key_json(json, &against->set->rows[i].key);
        if (against->comparisons[i].why_not) {
            unavailable_json(json, against->comparisons[i].why_not);
        } else {
            comparison_json(json, &against->comparisons[i]);
            summary_json(json, "frame_ms", series_summarize(&against->rows[i].frames[0]));
            summary_json(json, "against_frame_ms", series_summarize(&against->rows[i].frames[1]));
            samples_json(json, "frame_samples_ms", &against->rows[i].frames[0]);
            samples_json(json, "against_frame_samples_ms", &against->rows[i].frames[1]);
            json_begin_array(json, "pair_ratios");
            for (size_t pair = 0; pair < against->rows[i].ratios.count; pair++)
                json_number(json, NULL, exp(against->rows[i].ratios.items[pair]));
            json_end(json);
        }
        json_end(json);
    }
    json_end(json);
    return json;
}

static void against_notes(const void *context, size_t row, Text *notes)
{
    const Against *against = context;
    const size_t pairs = against->rows[row].ratios.count;
    if (against->comparisons[row].why_not) return;
    text_appendf(notes, "    %zu pair%s\n", pairs, text_plural(pairs));
    comparison_append(notes, &against->comparisons[row]);
}

static bool against_print(const Against *against, const Device *device)
{
    if (report_has_text(&against->options->report)) {
        device_heading_print(device, stdout);
        printf("against %s; intervals of %g%% confidence\n", against->options->other,
               100 * comparison_confidence);
    }
    return report_output(against_json(against, device), &against->options->report, against_notes, against);
}

int bench_against(const AgainstOptions *options, VariantSet *set, const Device *device)
{
    char self[PATH_MAX] = "";
    if (readlink("/proc/self/exe", self, sizeof self - 1) < 0) {
        stderr_print("--against needs /proc");
        return EXIT_MACHINE;
    }
    Against against = {
        .options = options,
        .set = set,
        .programs = {{.name = self, .path = "/proc/self/exe"},
                     {.name = options->other, .path = options->other}},
        .rows = memory_allocate_zeroed(set->count, sizeof *against.rows),
        .comparisons = memory_allocate_zeroed(set->count, sizeof *against.comparisons),
    };
    variant_set_fit_lanes(set, device);
    for (size_t i = 0; i < set->count; i++)
        against.comparisons[i].why_not = set->rows[i].failure;
    Progress progress;
    progress_open(&progress, !report_has_text(&options->report));
    int status = pairs_run(&against, &progress);
    progress_close(&progress);
    if (status == EXIT_DONE) {
        passports_recall(device); // the workers have cached them
        if (!against_print(&against, device)) status = EXIT_USER;
        if (status == EXIT_DONE) status = comparisons_status(against.comparisons, set->count, options->other);
    }
    for (size_t i = 0; i < set->count; i++) {
        series_free(&against.rows[i].ratios);
        series_free(&against.rows[i].frames[0]);
        series_free(&against.rows[i].frames[1]);
    }
    free(against.rows);
    free(against.comparisons);
    return status;
}
