// glint view starts the window, which is a separate program, so that other commands do not load its
// libraries. Loading them took a tenth of the processor time of a small render.
#include "host/base/exit_status.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/command_line.h"
#include "host/cli/commands.h"
#include <errno.h>
#include <limits.h>
#include <string.h>
#include <unistd.h>

int command_view(int argument_count, char **arguments)
{
    static const char deleted[] = " (deleted)"; // appended by Linux once the file was replaced
    char self[PATH_MAX];
    const ssize_t read = readlink("/proc/self/exe", self, sizeof self);
    if (read < 0 || read == sizeof self) {
        stderr_print("cannot find its own program: %s", strerror(read < 0 ? errno : ENAMETOOLONG));
        return EXIT_MACHINE;
    }
    size_t length = (size_t)read;
    const size_t rest = sizeof deleted - 1;
    if (length > rest && memcmp(self + length - rest, deleted, rest) == 0) length -= rest;
    Text path = {0};
    text_append(&path, self, length);
    text_appendf(&path, "-view");
    // one argument replaces the first two, "glint" and "view"
    char **passed = memory_allocate((size_t)argument_count + 2, sizeof *passed);
    passed[0] = "glint";
    passed[1] = "view";
    for (int i = 1; i <= argument_count; i++)
        passed[i + 1] = arguments[i];
    execv(text_c(&path), passed);
    stderr_print("cannot start %s: %s", text_c(&path), strerror(errno));
    return EXIT_MACHINE;
}
