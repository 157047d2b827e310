// Bugs and lack of memory end the process. Everything else that fails is returned to the caller.
#pragma once

enum {
    EXIT_DONE = 0,
    EXIT_USER = 1,      // wrong usage or input
    EXIT_MACHINE = 2,   // the device or memory failed
    EXIT_CHECK = 3,     // diff, bench, verify, certify, golden or cache found a difference
    EXIT_UNDECIDED = 4, // bench: the times are too noisy to compare
    EXIT_INTERRUPTED = 130
};

// Prints `glint: format…` to stderr and exits with EXIT_MACHINE, or as fault_output_is_complete says.
_Noreturn void fault(const char *format, ...) __attribute__((format(printf, 1, 2)));

// An OpenCL driver that lacks memory or threads may abort or read where nothing is. After this call, that
// ends the process with EXIT_MACHINE and a message that names the call. A crash outside of a call is a bug of
// glint and ends the process by the signal. Sanitizers handle crashes themselves.
void fault_catch_crashes(void);
// Records the OpenCL call that follows, a text up to a parenthesis, or NULL for none.
void fault_record_call(const char *call);
// Records the kernel that the following calls build or run, which a crash's message names, or NULL for none.
void fault_record_kernel(const char *name);
// Makes a crash within a call write its description to `text` instead of stderr.
enum { CRASH_TEXT_SIZE = 160 };
void fault_record_crashes(char text[CRASH_TEXT_SIZE]);
// Makes a fault or a crash a warning, after which the process exits with `status`: all output is complete.
void fault_output_is_complete(int status);
// Returns " (limited to …)" where the process has little address space or may have few threads, otherwise "".
const char *fault_limits(void);
