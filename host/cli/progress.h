// Displays the progress of a long command, on a terminal only.
#pragma once

#include <stdbool.h>

typedef struct {
    bool visible;
    double opened_seconds, shown_seconds;
    double start_seconds, start_fraction; // the point from which the time is extrapolated
    char step[96];
} Progress;

// Opens the progress and calls interrupts_flag.
void progress_open(Progress *progress, bool quiet);
// Returns the remaining time, or a negative number if it is not known yet. Extrapolates it from the fraction
// that is done, which is above 0 and at most 1. The first second does not count, since it may contain a
// kernel's build or a checkpoint's bands.
double progress_seconds_left(Progress *progress, double fraction_done);
void progress_show(Progress *progress, double fraction_done);
// Shows the progress with the name of the next step, such as "building row 2 of 8".
void progress_step(Progress *progress, double fraction_done, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// Erases the progress. Signals still only set the flag.
void progress_close(Progress *progress);
