// Progress of a long command, on a terminal only, and the user's interrupts.
#pragma once

#include <stdbool.h>

typedef struct {
    bool visible;
    double opened_seconds, shown_seconds;
    double start_seconds, start_fraction; // from where on the time is extrapolated
    char step[96];
} Progress;

// Lets SIGINT, SIGTERM and SIGHUP end the process with EXIT_INTERRUPTED, but for those that its parent
// ignores, as nohup and a shell's background jobs do. Called first.
void progress_catch_signals(void);
// From here on the signals set a flag; the third ends the process.
void progress_open(Progress *progress, bool quiet);
// The remaining time, extrapolated from the fraction that is done, above 0 and at most 1; negative: not known
// yet. What is done in the first second does not count: a kernel's build, or a checkpoint's bands.
double progress_seconds_left(Progress *progress, double fraction_done);
void progress_show(Progress *progress, double fraction_done);
// Shows the progress with what happens from now on, such as "building row 2 of 8".
void progress_step(Progress *progress, double fraction_done, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// From here on the signals set a flag, even where progress_end_at_once is called, until they are released.
void progress_hold_signals(void);
void progress_release_signals(void);
// Signals end the process at once again, until progress_open.
void progress_end_at_once(void);
void progress_close(Progress *progress); // erases the line; signals still only set the flag
bool progress_interrupted(void);
// Returns progress_interrupted(); a renderer's `stop`, whose context it ignores.
bool progress_stops(void *context);
// From now on progress_interrupted is also true where `ask` is, which it calls.
void progress_ask(bool (*ask)(void));
