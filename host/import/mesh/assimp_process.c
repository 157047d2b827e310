#include "host/import/mesh/assimp_process.h"
#include "host/base/array.h"
#include "host/base/exit_status.h"
#include "host/base/fault.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { REPLY_DESCRIPTOR = 3 };

static const char command[] = "--read-mesh";

static void limit(__rlimit_resource_t resource, rlim_t most)
{
    struct rlimit now;
    if (getrlimit(resource, &now) != 0 || now.rlim_cur <= most) return;
    now.rlim_cur = most;
    setrlimit(resource, &now);
}

void assimp_process_limit(void)
{
#ifndef __SANITIZE_ADDRESS__ // its shadow memory exceeds the limit
    limit(RLIMIT_AS, (rlim_t)ASSIMP_MEBIBYTES_MAX << 20);
#endif
    limit(RLIMIT_CPU, ASSIMP_PROCESSOR_SECONDS_MAX);
    limit(RLIMIT_CORE, 0);
    alarm(ASSIMP_SECONDS_MAX);
    // a terminal also signals the parent, which ends this process when it ends
    signal(SIGINT, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
}

int assimp_process_main(int argument_count, char **arguments)
{
    if (argument_count != 4 || strcmp(arguments[1], command) != 0) return -1;
    assimp_process_limit();
    FILE *reply = fdopen(REPLY_DESCRIPTOR, "wb");
    if (!reply) return EXIT_FAILURE;
    MessageList messages = {0};
    const Source source = {.file = arguments[2], .bytes = ""};
    Report report = report_open(&source, &messages);
    Scene scene = {0};
    MeshView view = {0};
    const bool is_scene = strcmp(arguments[3], "scene") == 0;
    const MeshImport import = {.path = arguments[2],
                               .own_materials = is_scene || strcmp(arguments[3], "own") == 0,
                               .view = is_scene ? &view : NULL,
                               .report = &report,
                               .offset = MESSAGE_WHOLE_FILE};
    MeshDraft draft = {.import = &import, .scene = &scene, .source = source, .places = DRAFT_NO_PLACES};
    const bool is_read = assimp_read(&draft);
    assimp_reply_write(&draft, reply, is_read);
    // assimp's destructors are not needed
    _exit(fflush(reply) == 0 ? EXIT_SUCCESS : EXIT_FAILURE);
}

// Starts the process. Returns 0 and sets *reply to the reading end of the pipe, or returns an errno value.
static int child_start(const MeshDraft *draft, pid_t *process, int *reply)
{
    char *arguments[] = {"glint", (char *)command, (char *)draft->import->path,
                         draft->import->view            ? "scene"
                         : draft->import->own_materials ? "own"
                                                        : "none",
                         NULL};
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return errno;
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    // glint ignores the first two; who started it may ignore the others, which end this process in time
    static const int ending[] = {SIGPIPE, SIGXFSZ, SIGXCPU, SIGALRM};
    sigset_t none, defaults;
    sigemptyset(&none);
    sigemptyset(&defaults);
    for (size_t i = 0; i < COUNT_OF(ending); i++)
        sigaddset(&defaults, ending[i]);
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    // first, because the pipe may have a standard descriptor that was closed
    posix_spawn_file_actions_adddup2(&actions, ends[1], REPLY_DESCRIPTOR);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    const SceneOptions *options = draft->import->options;
    const char *program = options && options->mesh_program ? options->mesh_program : "/proc/self/exe";
    const int error = posix_spawnp(process, program, &actions, &attributes, arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (error != 0)
        close(ends[0]);
    else
        *reply = ends[0];
    return error;
}

static bool child_fails(MeshDraft *draft, int status)
{
    const int by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (by == SIGXCPU)
        return draft_refuse(draft, "assimp needs more than %d s of processor time to read the file",
                            ASSIMP_PROCESSOR_SECONDS_MAX);
    if (by == SIGALRM)
        return draft_refuse(draft, "assimp needs more than %d s to read the file", ASSIMP_SECONDS_MAX);
    if (WIFEXITED(status) && WEXITSTATUS(status) == EXIT_MACHINE)
        return draft_refuse(draft, "assimp needs more than %d MiB to read the file", ASSIMP_MEBIBYTES_MAX);
    return draft_refuse(draft, "assimp %s while reading the file", by != 0 ? "crashed" : "failed");
}

bool assimp_process_read(MeshDraft *draft)
{
    draft->places = DRAFT_NO_PLACES;
    pid_t process = -1;
    int descriptor = -1, status = 0;
    const int error = child_start(draft, &process, &descriptor);
    if (error != 0)
        return draft_refuse(draft, "cannot start a process to read the file: %s", strerror(error));
    FILE *reply = fdopen(descriptor, "rb");
    bool read = false;
    const bool is_whole = reply && assimp_reply_read(draft, reply, &read);
    if (reply)
        fclose(reply);
    else
        close(descriptor);
    while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    return is_whole ? read : child_fails(draft, status);
}
