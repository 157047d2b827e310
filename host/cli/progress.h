// How far a long render is, on a terminal only, and whether the user wants it to end.
#pragma once

#include <stdbool.h>

typedef struct {
    bool visible;
    double start_seconds, shown_seconds;
} Progress;

// From here on an interrupt, a request to end or the terminal's end is noted, not obeyed at once; a third
// ends the process.
void progress_open(Progress *progress, bool quiet);
// `fraction_done` is above 0 and at most 1, which is all; from it and the time spent follows the time left.
void progress_show(Progress *progress, double fraction_done);
void progress_close(Progress *progress); // wipes the line; signals are noted as before
bool progress_interrupted(void);
