// Handles signals, above all SIGINT, SIGTERM and SIGHUP, by which the user interrupts a command.
#pragma once

#include <stdbool.h>

// Makes failed writes and ended child processes return their status, whatever the parent does with SIGPIPE,
// SIGXFSZ and SIGCHLD.
void signals_prepare(void);
// Makes the signals end the process with EXIT_INTERRUPTED, except for those that the parent ignores, as nohup
// and a shell's background jobs do. Must be called first.
void interrupts_catch(void);
// Ignores the signals, in a process whose parent handles them.
void interrupts_ignore(void);
// Makes the signals set a flag, which is_interrupted returns. The third signal ends the process.
void interrupts_flag(void);
// Makes the signals end the process at once, until interrupts_flag is called.
void interrupts_end_at_once(void);
// Makes the signals only set the flag until interrupts_release is called, even if interrupts_end_at_once is
// called.
void interrupts_hold(void);
void interrupts_release(void);
// Makes is_interrupted also return true when `source` does. NULL removes the source.
void interrupts_set_source(bool (*source)(void *context), void *context);

bool is_interrupted(void);
// Prints once that the command was interrupted, followed by the consequence, such as ": no image was
// written".
void interrupt_report(const char *consequence);
// Returns is_interrupted() for a `stop` function, and ignores its context.
bool interrupts_stop(void *context);
