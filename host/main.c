// Runs a subcommand by its name.
#include "host/api/version.h"
#include "host/base/array.h"
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/command_line.h"
#include "host/cli/commands.h"
#include "host/cli/interrupts.h"
#include "host/import/load.h"
#include "host/import/mesh/assimp_process.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define COMMAND_ROW(name, purpose) {#name, command_##name, purpose},
static const struct {
    const char *name;
    int (*run)(int argument_count, char **arguments);
    const char *purpose;
} commands[] = {COMMAND_LIST(COMMAND_ROW)};

enum { COMMAND_COUNT = COUNT_OF(commands) };

static void help(FILE *stream)
{
    fputs("glint: an OpenCL ray tracer that reports its speed and its error\n\n"
          "usage: glint COMMAND [OPTIONS]\n"
          "       glint SCENE [OPTIONS]     renders the scene as glint render SCENE [OPTIONS]\n\n",
          stream);
    for (size_t i = 0; i < COMMAND_COUNT; i++)
        fprintf(stream, "  %-9s %s\n", commands[i].name, commands[i].purpose);
    fputs("\nglint COMMAND --help lists a command's options, glint --version prints the version.\n", stream);
}

static bool file_exists(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && !S_ISDIR(status.st_mode);
}

// Returns whether a folder of the PATH has the file, which may be one that cannot be started.
static bool path_has(const char *name)
{
    for (const char *at = getenv("PATH"); at;) {
        const size_t length = strcspn(at, ":");
        OWNED char *path = text_format("%.*s/%s", length > 0 ? (int)length : 1, length > 0 ? at : ".", name);
        if (file_exists(path)) return true;
        at = at[length] == ':' ? at + length + 1 : NULL;
    }
    return false;
}

// Starts glint-NAME if there is such a program on the PATH, as git does: the Python package has glint-locate.
// Returns whether it printed why that failed. It prints nothing if the command is unknown.
static bool program_start(const char *name, char **arguments)
{
    if (strchr(name, '/')) return false;
    OWNED char *program = text_format("glint-%s", name);
    execvp(program, arguments);
    const int error = errno; // which may be that of a folder of the PATH that cannot be searched
    const bool exists = path_has(program), is_locate = strcmp(name, "locate") == 0;
    if (exists)
        stderr_print("cannot start %s: %s", program, strerror(error));
    else if (is_locate)
        stderr_print("glint locate needs glint's Python package with the extra [locate]");
    return exists || is_locate;
}

static int command_run(int argument_count, char **arguments)
{
    if (argument_count < 2) {
        help(stderr);
        return EXIT_USER;
    }
    const char *name = arguments[1];
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0 || strcmp(name, "help") == 0) {
        help(stdout);
        return EXIT_DONE;
    }
    if (strcmp(name, "--version") == 0) {
        printf("glint %s\n", glint_version());
        return EXIT_DONE;
    }
    const char *names[COMMAND_COUNT];
    for (size_t i = 0; i < COMMAND_COUNT; i++) {
        if (strcmp(name, commands[i].name) == 0) {
            // getopt heads its messages with the first argument
            static char full_name[32];
            snprintf(full_name, sizeof full_name, "glint %s", name);
            arguments[1] = full_name;
            return commands[i].run(argument_count - 1, arguments + 1);
        }
        names[i] = commands[i].name;
    }
    if (scene_is_known(name) || file_exists(name)) {
        static char render_name[] = "glint render";
        arguments[0] = render_name;
        return command_render(argument_count, arguments);
    }
    if (program_start(name, arguments + 1)) return EXIT_USER;
    const char *near = text_nearest(name, names, COMMAND_COUNT);
    stderr_print("unknown command \"%s\"%s%s%s", name, near ? "; did you mean " : "", near ? near : "",
                 near ? "?" : "");
    return EXIT_USER;
}

int main(int argument_count, char **arguments)
{
    const int child_status = assimp_process_main(argument_count, arguments);
    if (child_status >= 0) return child_status;
    signals_prepare();
    interrupts_catch();
    fault_catch_crashes();
    return command_finish(command_run(argument_count, arguments));
}
