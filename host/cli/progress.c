#include "host/cli/progress.h"

#include "host/base/clock.h"
#include "host/base/text.h"
#include "host/cli/interrupts.h"
#include <stdarg.h>
#include <stdio.h>
#include <unistd.h>

void progress_open(Progress *progress, bool quiet)
{
    double now = clock_seconds();
    *progress =
        (Progress){.visible = !quiet && isatty(STDERR_FILENO), .opened_seconds = now, .shown_seconds = now};
    interrupts_flag();
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
