// Bugs and lack of memory end the process. Everything else that fails is returned to the caller.
#pragma once

// Prints `glint: format…` to stderr and exits with EXIT_MACHINE. After fault_output_is_complete, prints a
// warning and exits with that call's status.
_Noreturn void fault(const char *format, ...) __attribute__((format(printf, 1, 2)));

// Makes a crash within an OpenCL call end the process with EXIT_MACHINE and a message that names the call. A
// driver that lacks memory or threads may abort or access invalid memory. A crash outside of a call is a bug
// of glint and ends the process by the signal. Sanitizers handle crashes themselves.
void fault_catch_crashes(void);
// Records the name of the OpenCL call that follows, which ends at a parenthesis, or NULL for none.
void fault_record_call(const char *call);
// Records the kernel that the following calls build or run, which a crash's message names, or NULL for none.
void fault_record_kernel(const char *name);
// Makes a crash within a call write its description to `text`, which must be zeroed, instead of stderr.
enum { CRASH_TEXT_SIZE = 160 };
void fault_record_crashes(char text[CRASH_TEXT_SIZE]);
// Declares all output complete. A later fault or crash prints a warning and the process exits with `status`.
void fault_output_is_complete(int status);
// Returns " (limited to …)" if the process had little address space or few threads at the first call, and
// otherwise "".
const char *fault_limits(void);
