#include "host/cli/progress.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/text.h"
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

static volatile sig_atomic_t interrupted, is_flag_read, is_held;

// Two signals often arrive together, one for the process and one for its group. Only a third is a second
// request of the user.
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

void progress_ignore_signals(void)
{
    for (size_t i = 0; i < COUNT_OF(signals); i++)
        signal(signals[i], SIG_IGN);
}

void progress_catch_signals(void)
{
    const struct sigaction action = {.sa_handler = interrupt_record};
    for (size_t i = 0; i < COUNT_OF(signals); i++) {
        struct sigaction before;
        if (sigaction(signals[i], NULL, &before) == 0 && before.sa_handler != SIG_IGN)
            sigaction(signals[i], &action, NULL);
    }
}

void progress_open(Progress *progress, bool quiet)
{
    double now = clock_seconds();
    *progress =
        (Progress){.visible = !quiet && isatty(STDERR_FILENO), .opened_seconds = now, .shown_seconds = now};
    progress_flag_signals();
}

void progress_hold_signals(void)
{
    is_held = 1;
}

void progress_release_signals(void)
{
    is_held = 0;
}

void progress_flag_signals(void)
{
    is_flag_read = 1;
}

void progress_end_at_once(void)
{
    is_flag_read = 0;
}

double progress_seconds_left(Progress *progress, double fraction_done)
{
    static const double seconds_min = 1; // before the interval that is extrapolated, and its least length
    double now = clock_seconds();
    if (progress->start_fraction == 0 || now - progress->opened_seconds < seconds_min) {
        progress->start_seconds = now;
        progress->start_fraction = fraction_done;
    }
    double spent = now - progress->start_seconds, done = fraction_done - progress->start_fraction;
    return spent < seconds_min || done <= 0 ? -1 : spent * (1 - fraction_done) / done;
}

static const double show_seconds = 0.25;

static void line_show(Progress *progress, double fraction_done, double left)
{
    progress->shown_seconds = clock_seconds();
    fprintf(stderr, "\r%3.0f%% \033[K", 100 * fraction_done);
    if (progress->step[0] != '\0') fprintf(stderr, " %s", progress->step);
    if (left >= 0)
        fprintf(stderr, "%s %s left ", progress->step[0] != '\0' ? "," : "", text_duration(left).text);
    fflush(stderr);
}

void progress_show(Progress *progress, double fraction_done)
{
    const double left = progress_seconds_left(progress, fraction_done);
    // no progress for short renders, a few updates per second for long ones
    if (progress->visible && clock_seconds() - progress->shown_seconds >= show_seconds)
        line_show(progress, fraction_done, left);
}

void progress_step(Progress *progress, double fraction_done, const char *format, ...)
{
    const double left = fraction_done > 0 ? progress_seconds_left(progress, fraction_done) : -1;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(progress->step, sizeof progress->step, format, arguments);
    va_end(arguments);
    if (progress->visible && clock_seconds() - progress->opened_seconds >= show_seconds)
        line_show(progress, fraction_done, left);
}

void progress_close(Progress *progress)
{
    if (progress->visible) fputs("\r\033[K", stderr);
}

static bool (*other_interrupts)(void *context);
static void *other_context;

void progress_set_interrupt(bool (*interrupts)(void *context), void *context)
{
    other_interrupts = interrupts;
    other_context = context;
}

bool progress_interrupted(void)
{
    return interrupted != 0 || (other_interrupts && other_interrupts(other_context));
}

bool progress_stops(void *context)
{
    (void)context;
    return progress_interrupted();
}
