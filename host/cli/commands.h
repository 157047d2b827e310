// The subcommands. Each receives its name as the first argument and returns the exit status.
#pragma once

#include <stdbool.h>

// COMMAND(name, purpose)
#define COMMAND_LIST(COMMAND)                                                                                \
    COMMAND(render, "render a scene file to an image")                                                       \
    COMMAND(view, "show a scene in a window")                                                                \
    COMMAND(trace, "trace explicit rays")                                                                    \
    COMMAND(check, "read a scene and report its contents")                                                   \
    COMMAND(devices, "list OpenCL devices")                                                                  \
    COMMAND(diff, "compare two images")                                                                      \
    COMMAND(bench, "measure speed on a device")                                                              \
    COMMAND(accuracy, "measure speed against error")                                                         \
    COMMAND(certify, "compare an image with a reference of quadruple precision")                             \
    COMMAND(verify, "run the hard cases on a device")                                                        \
    COMMAND(golden, "write or check the hashes of images at strict")                                         \
    COMMAND(report, "write an archive for a bug report, or compare reports of bench")                        \
    COMMAND(cache, "list, check or empty the kernel cache")

#define COMMAND_DECLARATION(name, purpose) int command_##name(int argument_count, char **arguments);
COMMAND_LIST(COMMAND_DECLARATION)

// Returns whether glint verify has a case of this name. If not, prints the cases.
bool verify_case_check(const char *name);
