// The exit statuses of glint.
#pragma once

enum {
    EXIT_DONE = 0,
    EXIT_USER = 1,      // wrong usage or input, or an output file that cannot be written
    EXIT_MACHINE = 2,   // the device, memory or standard output failed
    EXIT_CHECK = 3,     // diff, bench, verify, certify, golden or cache found a difference
    EXIT_UNDECIDED = 4, // bench: the times are too noisy to compare
    EXIT_INTERRUPTED = 130
};
