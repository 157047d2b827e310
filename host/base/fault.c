#include "host/base/fault.h"

#include "host/base/array.h"
#include "host/base/exit_status.h"

#include <assert.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

// What a crash's message needs is global, because a signal handler has no context. current_call is the
// call of this thread, and last_call that of any thread, which stands in for drivers' threads.
static _Thread_local const char *volatile current_call;
static const char *_Atomic last_call;
static const char *_Atomic current_kernel;
static _Atomic int calling_threads;
static volatile sig_atomic_t is_complete, complete_status;
static char limits[128];
static char *crash_record;

_Noreturn void fault(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fputs(is_complete ? "glint: warning: " : "glint: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(is_complete ? complete_status : EXIT_MACHINE);
}

void fault_record_call(const char *call)
{
    calling_threads += (call != NULL) - (current_call != NULL);
    current_call = call;
    if (call) last_call = call;
}

void fault_record_kernel(const char *name)
{
    current_kernel = name;
}

void fault_record_crashes(char text[CRASH_TEXT_SIZE])
{
    crash_record = text;
}

void fault_output_is_complete(int status)
{
    fflush(stdout);
    complete_status = status;
    is_complete = 1;
}

static void limits_write(void)
{
    enum { FEW_THREADS = 256 };
    struct rlimit space, threads;
    bool has_space = getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY;
    bool has_threads = getrlimit(RLIMIT_NPROC, &threads) == 0 && threads.rlim_cur < FEW_THREADS;
    if (has_space)
        snprintf(limits, sizeof limits, " (limited to %ju MiB of address space, see ulimit -v)",
                 (uintmax_t)space.rlim_cur >> 20);
    if (has_threads)
        snprintf(limits + strlen(limits), sizeof limits - strlen(limits),
                 " (limited to %ju processes of the user, see ulimit -u)", (uintmax_t)threads.rlim_cur);
}

const char *fault_limits(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT; // other threads may be reading it
    pthread_once(&once, limits_write);
    return limits;
}

#ifdef __SANITIZE_ADDRESS__

void fault_catch_crashes(void)
{
}

#else

typedef struct {
    char text[2 * CRASH_TEXT_SIZE];
    size_t length;
} CrashText;

static void crash_append(CrashText *crash, const char *text, size_t length)
{
    const size_t room = sizeof crash->text - 1 - crash->length;
    if (length > room) length = room;
    memcpy(crash->text + crash->length, text, length);
    crash->length += length;
    crash->text[crash->length] = '\0';
}

static void crash_describe(CrashText *crash, const char *call, int signal_number)
{
    static const char how[2][32] = {": the OpenCL driver crashed", ": the OpenCL driver aborted"};
    const char *kernel = current_kernel, *what = how[signal_number == SIGABRT];
    crash_append(crash, call, strcspn(call, "("));
    crash_append(crash, what, strlen(what));
    if (kernel) {
        static const char at[] = " at the kernel ";
        crash_append(crash, at, sizeof at - 1);
        crash_append(crash, kernel, strlen(kernel));
    }
    crash_append(crash, limits, strlen(limits));
}

// Prints the crash's message. Calls only functions that a signal handler may call.
static void crash_report(int signal_number)
{
    const char *call = current_call ? current_call : calling_threads > 0 ? last_call : NULL;
    if (!call && !is_complete) {
        signal(signal_number, SIG_DFL);
        raise(signal_number);
        return;
    }
    if (!call) call = "at the end";
    CrashText crash = {{0}, 0};
    if (crash_record && !is_complete) {
        crash_describe(&crash, call, signal_number);
        memcpy(crash_record, crash.text, CRASH_TEXT_SIZE - 1);
        _exit(EXIT_MACHINE);
    }
    static const char start[] = "glint: ", warning[] = "warning: ";
    crash_append(&crash, start, sizeof start - 1);
    if (is_complete) crash_append(&crash, warning, sizeof warning - 1);
    crash_describe(&crash, call, signal_number);
    crash_append(&crash, "\n", 1);
    ssize_t ignored = write(STDERR_FILENO, crash.text, crash.length);
    (void)ignored;
    _exit(is_complete ? complete_status : EXIT_MACHINE);
}

// Replaces libc's function, also in drivers (through LDFLAGS), because LLVM replaces our handler of SIGABRT
// with one that does not call ours.
__attribute__((visibility("default"))) _Noreturn void abort(void)
{
    crash_report(SIGABRT);
    signal(SIGABRT, SIG_DFL);
    raise(SIGABRT);
    _exit(EXIT_MACHINE);
}

// Replaces libc's function, which does not call our abort.
// NOLINTNEXTLINE(bugprone-reserved-identifier): libc's name
__attribute__((visibility("default"))) _Noreturn void __assert_fail(const char *assertion, const char *file,
                                                                    unsigned line, const char *function)
{
    fprintf(stderr, "%s:%u: %s: Assertion `%s' failed.\n", file, line, function, assertion);
    abort();
}

void fault_catch_crashes(void)
{
    static const int signals[] = {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE};
    static char stack[1 << 16]; // a separate stack, since the crash may be a full stack
    const stack_t other = {.ss_sp = stack, .ss_size = sizeof stack};
    const struct sigaction action = {.sa_handler = crash_report, .sa_flags = SA_ONSTACK};
    fault_limits();
    sigaltstack(&other, NULL);
    for (size_t i = 0; i < COUNT_OF(signals); i++)
        sigaction(signals[i], &action, NULL);
}

#endif
