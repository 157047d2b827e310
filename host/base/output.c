#include "host/base/output.h"
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// The temporaries not yet renamed, for the exit handler.
static struct {
    char **items;
    size_t count, capacity;
} pending;

static void pending_remove_all(void)
{
    for (size_t i = 0; i < pending.count; i++)
        unlink(pending.items[i]);
    free(pending.items);
}

static void pending_add(char *temporary)
{
    static bool is_registered;
    if (!is_registered && atexit(pending_remove_all) != 0) fault("atexit failed");
    is_registered = true;
    array_push(pending, temporary);
}

static void pending_drop(const char *temporary)
{
    for (size_t i = 0; i < pending.count; i++) {
        if (pending.items[i] == temporary) pending.items[i--] = pending.items[--pending.count];
    }
}

// `directory/.name.XXXXXX`: the same file system, so that the rename is one step.
static char *temporary_name(const char *target)
{
    const char *slash = strrchr(target, '/');
    const char *name = slash ? slash + 1 : target;
    char *temporary;
    // A name may have 255 bytes; its start shows what the temporary is for.
    if (asprintf(&temporary, "%.*s.%.200s.XXXXXX", (int)(name - target), target, name) < 0)
        fault("out of memory: file name");
    return temporary;
}

static mode_t mode_by_umask(void)
{
    mode_t mask = umask(0);
    umask(mask);
    return 0666 & ~mask;
}

static bool output_failed(OutputFile *output, const char *doing, MessageList *messages)
{
    message_add(messages, MESSAGE_ERROR, "cannot %s '%s': %s", doing, output->target, strerror(errno));
    output_abandon(output);
    return false;
}

// A device or a pipe cannot be replaced by renaming: it is written directly.
static bool output_open_directly(OutputFile *output, MessageList *messages)
{
    output->file = fopen(output->target, "wbe");
    return output->file || output_failed(output, "write", messages);
}

static bool output_open_beside(OutputFile *output, mode_t mode, MessageList *messages)
{
    size_t length = strlen(output->target);
    if (length == 0 || output->target[length - 1] == '/') {
        errno = ENOENT;
        return output_failed(output, "create", messages);
    }
    output->temporary = temporary_name(output->target);
    int descriptor = mkostemp(output->temporary, O_CLOEXEC);
    if (descriptor < 0) {
        free(output->temporary);
        output->temporary = NULL;
        return output_failed(output, "create", messages);
    }
    pending_add(output->temporary);
    fchmod(descriptor, mode); // fails where a file system has no modes, which does not matter
    output->file = fdopen(descriptor, "wb");
    if (output->file) return true;
    int error = errno;
    close(descriptor);
    errno = error;
    return output_failed(output, "create", messages);
}

// The end of a chain of symbolic links, whether a file exists there or not; `target` itself if it is no link.
static char *link_end(const char *target)
{
    enum { STEPS_MAX = 40 }; // as in Linux; a longer chain is a cycle
    char *path = memory_copy_text(target), aim[PATH_MAX];
    for (int step = 0; step < STEPS_MAX; step++) {
        ssize_t length = readlink(path, aim, sizeof aim);
        if (length < 0) break;
        const char *slash = aim[0] == '/' ? NULL : strrchr(path, '/');
        char *next;
        if (asprintf(&next, "%.*s%.*s", slash ? (int)(slash + 1 - path) : 0, path, (int)length, aim) < 0)
            fault("out of memory: file name");
        free(path);
        path = next;
    }
    return path;
}

bool output_open(OutputFile *output, const char *target, MessageList *messages)
{
    *output = (OutputFile){0};
    if (strcmp(target, "-") == 0) {
        output->target = memory_copy_text("standard output");
        output->file = stdout;
        return true;
    }
    struct stat old;
    bool exists = stat(target, &old) == 0;
    int error = exists ? 0 : errno;
    // A symbolic link is kept: its target is replaced or created.
    char *resolved = exists ? realpath(target, NULL) : link_end(target);
    output->target = resolved ? resolved : memory_copy_text(target);
    if (error == ELOOP) {
        errno = error;
        return output_failed(output, "create", messages);
    }
    if (exists && !S_ISREG(old.st_mode)) return output_open_directly(output, messages);
    // Renaming would replace a read-only file.
    if (exists && access(output->target, W_OK) != 0) return output_failed(output, "write", messages);
    return output_open_beside(output, exists ? old.st_mode & 0777 : mode_by_umask(), messages);
}

bool output_write(OutputFile *output, const void *bytes, size_t size, MessageList *messages)
{
    if (size == 0 || fwrite(bytes, 1, size, output->file) == size || output->file == stdout) return true;
    message_add(messages, MESSAGE_ERROR, "cannot write '%s': %s", output->target, strerror(errno));
    return false;
}

bool output_finish(OutputFile *output, MessageList *messages)
{
    FILE *file = output->file;
    output->file = NULL;
    if (!file || file == stdout) return true;
    errno = EIO; // if an earlier write failed, its error is lost
    bool written = fflush(file) == 0 && !ferror(file);
    int error = errno;
    if (fclose(file) == 0 && written) return true;
    if (!written) errno = error;
    return output_failed(output, "write", messages);
}

bool output_commit(OutputFile *output, MessageList *messages)
{
    if (!output_finish(output, messages)) return false;
    if (output->temporary) {
        if (rename(output->temporary, output->target) != 0) return output_failed(output, "write", messages);
        pending_drop(output->temporary);
        free(output->temporary);
        output->temporary = NULL;
    }
    output_abandon(output);
    return true;
}

void output_abandon(OutputFile *output)
{
    if (output->file && output->file != stdout) fclose(output->file);
    if (output->temporary) {
        unlink(output->temporary);
        pending_drop(output->temporary);
    }
    free(output->temporary);
    free(output->target);
    *output = (OutputFile){0};
}
