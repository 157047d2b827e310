// Replaces the process that reads a mesh by assimp. glint restarts its own program for it, here a test. If
// the mesh's file has one of these names, the new process misbehaves as assimp might.
#include "host/import/mesh/assimp_process.h"
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/memory.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static void reply_with(const char *text, size_t size)
{
    if (write(3, text, size) < 0) _exit(EXIT_FAILURE);
    _exit(EXIT_SUCCESS);
}

static void misbehave(const char *name)
{
    const struct rlimit few_seconds = {1, 2};
    if (!strcmp(name, "hang.fbx")) setrlimit(RLIMIT_CPU, &few_seconds);
#ifdef __SANITIZE_ADDRESS__ // no limit of address space then
    if (!strcmp(name, "bloat.fbx")) _exit(EXIT_MACHINE);
#else
    const struct rlimit few_bytes = {1 << 28, RLIM_INFINITY};
    if (!strcmp(name, "bloat.fbx")) setrlimit(RLIMIT_AS, &few_bytes);
#endif
    assimp_process_limit();
    if (!strcmp(name, "crash.fbx")) {
        signal(SIGSEGV, SIG_DFL); // a sanitizer's handler exits
        raise(SIGSEGV);
    }
    if (!strcmp(name, "silent.fbx")) _exit(EXIT_SUCCESS);
    if (!strcmp(name, "garbage.fbx")) reply_with("a mesh", 6);
    while (!strcmp(name, "hang.fbx")) {
    }
    if (!strcmp(name, "wait.fbx")) {
        alarm(1);
        pause();
    }
    while (!strcmp(name, "bloat.fbx"))
        memset(memory_allocate(1 << 20, 1), 1, 1 << 20);
}

__attribute__((constructor)) static void child_serve(int argument_count, char **arguments)
{
    if (argument_count == 4 && !strcmp(arguments[1], "--read-mesh")) misbehave(arguments[2]);
    const int status = assimp_process_main(argument_count, arguments);
    if (status >= 0) _exit(status);
}
