#include "host/cli/interrupts.h"

#include "host/base/array.h"
#include "host/base/exit_status.h"
#include "host/cli/command_line.h"
#include <signal.h>
#include <stddef.h>
#include <unistd.h>

static volatile sig_atomic_t interrupted, is_flag_read, is_held;

// One Ctrl-C often arrives as two signals, one to the process and one to its group, so only a third signal
// counts as a second request.
static void interrupt_record(int signal_number)
{
    if (!is_flag_read && !is_held) {
        static const char text[] = "glint: interrupted\n";
        ssize_t ignored = write(STDERR_FILENO, text, sizeof text - 1);
        (void)ignored;
        _exit(EXIT_INTERRUPTED);
    }
    if (interrupted) signal(signal_number, SIG_DFL);
    interrupted = 1;
}

static const int signals[] = {SIGINT, SIGTERM, SIGHUP};

void signals_prepare(void)
{
    // a failed write is reported like a full disk, and no partial output is left
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
    signal(SIGCHLD, SIG_DFL); // if it is ignored, the system keeps no exit status
}

void interrupts_ignore(void)
{
    for (size_t i = 0; i < COUNT_OF(signals); i++)
        signal(signals[i], SIG_IGN);
}

void interrupts_catch(void)
{
    const struct sigaction action = {.sa_handler = interrupt_record};
    for (size_t i = 0; i < COUNT_OF(signals); i++) {
        struct sigaction before;
        if (sigaction(signals[i], NULL, &before) == 0 && before.sa_handler != SIG_IGN)
            sigaction(signals[i], &action, NULL);
    }
}

void interrupts_hold(void)
{
    is_held = 1;
}

void interrupts_release(void)
{
    is_held = 0;
}

void interrupts_flag(void)
{
    is_flag_read = 1;
}

void interrupts_end_at_once(void)
{
    is_flag_read = 0;
}

static bool (*other_interrupts)(void *context);
static void *other_context;

void interrupts_set_source(bool (*source)(void *context), void *context)
{
    other_interrupts = source;
    other_context = context;
}

bool is_interrupted(void)
{
    return interrupted != 0 || (other_interrupts && other_interrupts(other_context));
}

void interrupt_report(const char *consequence)
{
    static bool is_reported;
    if (!is_reported) stderr_print("interrupted%s", consequence);
    is_reported = true;
}

bool interrupts_stop(void *context)
{
    (void)context;
    return is_interrupted();
}
