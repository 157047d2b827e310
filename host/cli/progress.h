// Displays the progress of a long command, on a terminal only, and handles the user's interrupts.
#pragma once

#include <stdbool.h>

typedef struct {
    bool visible;
    double opened_seconds, shown_seconds;
    double start_seconds, start_fraction; // the point from which the time is extrapolated
    char step[96];
} Progress;

// Makes SIGINT, SIGTERM and SIGHUP end the process with EXIT_INTERRUPTED, except for signals that the parent
// ignores, as nohup and a shell's background jobs do. Must be called first.
void progress_catch_signals(void);
// Ignores these signals, in a process whose parent handles them.
void progress_ignore_signals(void);
// Opens the progress. Afterwards the signals set a flag, and the third signal ends the process.
void progress_open(Progress *progress, bool quiet);
// Returns the remaining time, extrapolated from the fraction that is done (above 0, at most 1), or a negative
// number if it is not known yet. The first second does not count, since it may contain a kernel's build or a
// checkpoint's bands.
double progress_seconds_left(Progress *progress, double fraction_done);
void progress_show(Progress *progress, double fraction_done);
// Shows the progress with the name of the next step, such as "building row 2 of 8".
void progress_step(Progress *progress, double fraction_done, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// Makes the signals set a flag until they are released, even if progress_end_at_once is called.
void progress_hold_signals(void);
void progress_release_signals(void);
// Makes signals set a flag, as progress_open does, or end the process at once.
void progress_flag_signals(void);
void progress_end_at_once(void);
// Erases the line. Signals still only set the flag.
void progress_close(Progress *progress);
bool progress_interrupted(void);
// Returns progress_interrupted(). A renderer's `stop` function, which ignores its context.
bool progress_stops(void *context);
// Makes progress_interrupted return true also if `interrupts` does, which may be NULL.
void progress_set_interrupt(bool (*interrupts)(void *context), void *context);
