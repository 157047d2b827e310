// Bugs and lack of memory end the process. Everything else that fails is returned to the caller.
#pragma once

enum {
    EXIT_DONE = 0,
    EXIT_USER = 1,    // wrong usage or input
    EXIT_MACHINE = 2, // the device or memory failed
    EXIT_CHECK = 3,   // diff, bench or verify found a difference
    EXIT_INTERRUPTED = 130
};

// Prints `glint: format…` to stderr and exits with EXIT_MACHINE.
_Noreturn void fault(const char *format, ...) __attribute__((format(printf, 1, 2)));
