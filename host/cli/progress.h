// Progress of a long render, on a terminal only, and the user's interrupts.
#pragma once

#include <stdbool.h>

typedef struct {
    bool visible;
    double start_seconds, shown_seconds;
} Progress;

// Lets SIGINT, SIGTERM and SIGHUP end the process with EXIT_INTERRUPTED, but for those that its parent
// ignores, as nohup and a shell's background jobs do. Called first.
void progress_catch_signals(void);
// From here on the signals set a flag; the third ends the process.
void progress_open(Progress *progress, bool quiet);
// `fraction_done`: above 0, at most 1; the remaining time is extrapolated from it.
void progress_show(Progress *progress, double fraction_done);
void progress_close(Progress *progress); // erases the line; signals still only set the flag
bool progress_interrupted(void);
