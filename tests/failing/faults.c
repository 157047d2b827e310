#include "tests/failing/faults.h"
#include <assert.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define COUNT_OF(array) (sizeof(array) / sizeof *(array))

static const char *const class_names[] = {"opencl", "creating", "allocation", "file"};
static const char *const act_names[] = {"",      "count", "fail",      "null", "full", "interrupt", "short",
                                        "crash", "abort", "assertion", "kill", "hang", "exit",      "sleep"};

enum { FAULTS_MAX = 8 };
Fault injected;
static Fault faults[FAULTS_MAX];
static size_t fault_count;
pthread_t first_thread;
bool faults_are_for_children;
static const char *log_path;

// Reads a rule, whose texts stay where they are. Ends the process if it has no act.
static void fault_read(Fault *fault, char *text)
{
    char *rest, *end, *word = strtok_r(text, " ", &rest);
    *fault = (Fault){.call = word, .index = EVERY_CALL};
    char *at = word ? strchr(word, '@') : NULL;
    if (at) {
        *at = '\0';
        fault->index = strtoul(at + 1, &end, 10);
        fault->is_lasting = *end == '-';
    }
    for (size_t i = 0; word && i < COUNT_OF(class_names); i++)
        if (strcmp(word, class_names[i]) == 0) fault->classes = 1U << i;
    while ((word = strtok_r(NULL, " ", &rest))) {
        char *value = word + strcspn(word, "=");
        if (*value == '=') *value++ = '\0';
        if (strcmp(word, "kernel") == 0) fault->kernel = value;
        if (strcmp(word, "file") == 0) {
            fault->file = strtok_r(value, ":", &end);
            fault->file_bytes = strtoul(end, NULL, 10);
        }
        for (size_t i = 1; i < COUNT_OF(act_names); i++)
            if (strcmp(word, act_names[i]) == 0) {
                fault->act = (FaultAct)i;
                fault->number = (int)strtol(value, NULL, 10);
            }
    }
    if (!fault->act) {
        fputs("GLINT_FAULTS: a rule has no known act\n", stderr);
        abort();
    }
}

__attribute__((constructor(101))) static void faults_read(void)
{
    static const char child[] = "child ";
    static char text[512];
    const char *rules = getenv("GLINT_FAULTS");
    if (!rules) return;
    faults_are_for_children = strncmp(rules, child, strlen(child)) == 0;
    if (faults_are_for_children) {
        setenv("GLINT_FAULTS", rules + strlen(child), 1);
        return;
    }
    log_path = getenv("GLINT_FAULT_LOG");
    snprintf(text, sizeof text, "%s", rules);
    char *rest, *rule = strtok_r(text, ";", &rest);
    for (; rule && fault_count < FAULTS_MAX; rule = strtok_r(NULL, ";", &rest))
        fault_read(&faults[fault_count++], rule);
}

void faults_log_failed(const char *call)
{
    const int log = log_path ? open(log_path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600) : -1;
    if (log < 0) return;
    dprintf(log, "failed %s\n", call);
    close(log);
}

__attribute__((destructor)) void faults_log_counts(void)
{
    const int log = log_path ? open(log_path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600) : -1;
    for (size_t i = 0; i < fault_count && log >= 0; i++)
        dprintf(log, "%s %zu\n", faults[i].call, faults[i].count);
    if (log >= 0) close(log);
}

bool faults_concern(unsigned class)
{
    for (size_t i = 0; i < fault_count; i++)
        if (faults[i].classes & class) return true;
    return false;
}

// Counts a call that a rule may concern, and returns whether it fails by the rule.
static bool fault_applies(Fault *fault, const char *call, unsigned classes, const char *kernel)
{
    struct stat status;
    if (!fault->call || (fault->classes ? !(fault->classes & classes) : strcmp(fault->call, call) != 0))
        return false;
    if (fault->is_in_threads && pthread_equal(pthread_self(), first_thread)) return false;
    if (fault->kernel && (!kernel || strcmp(fault->kernel, kernel) != 0)) return false;
    if (fault->file && (stat(fault->file, &status) != 0 || (size_t)status.st_size < fault->file_bytes))
        return false;
    const size_t index = fault->count++;
    return index == fault->index || fault->index == EVERY_CALL || (fault->is_lasting && index > fault->index);
}

// Does what a rule demands of a call. Returns how the call then fails.
static FaultAct fault_act(const Fault *fault)
{
    switch (fault->act) {
    case FAULT_CRASH:
        for (;;)
            raise(SIGSEGV); // as a wrong access would again; LLVM's handler only resets the signal's
    case FAULT_ABORT:
        abort();
    case FAULT_ASSERTION:
        signal(SIGABRT, SIG_DFL); // as LLVM leaves it
        __assert_fail("lib != NULL", "driver.cc", 1, "getKernelLibrary");
    case FAULT_KILL:
        raise(SIGKILL);
        break;
    case FAULT_HANG:
        for (;;)
            pause();
    case FAULT_EXIT:
        exit(fault->number);
    case FAULT_SLEEP:
        usleep((useconds_t)fault->number * 1000);
        break;
    default:
        return fault->act == FAULT_COUNT ? FAULT_NONE : fault->act;
    }
    return FAULT_NONE;
}

FaultAct fault_at(const char *call, unsigned classes, const char *kernel)
{
    FaultAct act = FAULT_NONE;
    if (fault_applies(&injected, call, classes, kernel)) act = fault_act(&injected);
    for (size_t i = 0; i < fault_count; i++)
        if (fault_applies(&faults[i], call, classes, kernel)) act = fault_act(&faults[i]);
    if (act == FAULT_FAIL || act == FAULT_NULL || act == FAULT_INTERRUPT) faults_log_failed(call);
    return act;
}
