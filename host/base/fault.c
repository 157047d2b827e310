#include "host/base/fault.h"

#include <assert.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

// The call of this thread, and the last of any, which stands for those of a driver's own threads.
static _Thread_local const char *volatile noted_call;
static const char *_Atomic last_call;
static _Atomic int calling_threads;
static volatile sig_atomic_t is_complete, complete_status;
static char limits[128];

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

void fault_note_call(const char *call)
{
    calling_threads += (call != NULL) - (noted_call != NULL);
    noted_call = call;
    if (call) last_call = call;
}

void fault_output_is_complete(int status)
{
    fflush(stdout);
    complete_status = status;
    is_complete = 1;
}

const char *fault_limits(void)
{
    enum { FEW_THREADS = 256 };
    struct rlimit space, threads;
    bool has_space = getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY;
    bool has_threads = getrlimit(RLIMIT_NPROC, &threads) == 0 && threads.rlim_cur < FEW_THREADS;
    limits[0] = '\0';
    if (has_space)
        snprintf(limits, sizeof limits, " (limited to %ju MiB of address space, see ulimit -v)",
                 (uintmax_t)space.rlim_cur >> 20);
    if (has_threads)
        snprintf(limits + strlen(limits), sizeof limits - strlen(limits),
                 " (limited to %ju processes of the user, see ulimit -u)", (uintmax_t)threads.rlim_cur);
    return limits;
}

#ifdef __SANITIZE_ADDRESS__

void fault_catch_crashes(void)
{
}

#else

static void error_write(const char *text, size_t length)
{
    ssize_t ignored = write(STDERR_FILENO, text, length);
    (void)ignored;
}

// Only what a signal handler may call.
static void crash_report(int signal_number)
{
    const char *call = noted_call ? noted_call : calling_threads > 0 ? last_call : NULL;
    static const char start[] = "glint: ", warning[] = "warning: ", driver[] = ": the OpenCL driver ";
    const char *how = signal_number == SIGABRT ? "aborted" : "crashed";
    if (!call && !is_complete) {
        signal(signal_number, SIG_DFL);
        raise(signal_number);
        return;
    }
    error_write(start, sizeof start - 1);
    if (is_complete) error_write(warning, sizeof warning - 1);
    if (!call) call = "at the end";
    error_write(call, strcspn(call, "("));
    error_write(driver, sizeof driver - 1);
    error_write(how, strlen(how));
    error_write(limits, strlen(limits));
    error_write("\n", 1);
    _exit(is_complete ? complete_status : EXIT_MACHINE);
}

// In place of libc's, also for drivers (see LDFLAGS): LLVM replaces the handler of SIGABRT by one that does
// not call ours.
_Noreturn void abort(void)
{
    crash_report(SIGABRT);
    signal(SIGABRT, SIG_DFL);
    raise(SIGABRT);
    _exit(EXIT_MACHINE);
}

// Libc's calls another abort than the one above.
// NOLINTNEXTLINE(bugprone-reserved-identifier): libc's name
_Noreturn void __assert_fail(const char *assertion, const char *file, unsigned line, const char *function)
{
    fprintf(stderr, "%s:%u: %s: Assertion `%s' failed.\n", file, line, function, assertion);
    abort();
}

void fault_catch_crashes(void)
{
    static const int signals[] = {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE};
    static char stack[1 << 16]; // its own: the crash may be a stack that is full
    const stack_t other = {.ss_sp = stack, .ss_size = sizeof stack};
    const struct sigaction action = {.sa_handler = crash_report, .sa_flags = SA_ONSTACK};
    fault_limits();
    sigaltstack(&other, NULL);
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        sigaction(signals[i], &action, NULL);
}

#endif
