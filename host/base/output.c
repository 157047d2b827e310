#include "host/base/output.h"
#include "host/base/fault.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

// The files with a temporary, and their mutex. They are global, because temporaries are removed when any
// thread calls exit(). The list allocates nothing, so no fault calls exit() while its mutex is locked.
static OutputFile *pending;
static pthread_mutex_t pending_mutex = PTHREAD_MUTEX_INITIALIZER;

static void pending_remove_all(void)
{
    pthread_mutex_lock(&pending_mutex);
    for (; pending; pending = pending->next_pending)
        if (pending->process == getpid()) unlinkat(pending->folder, pending->temporary, 0);
    pthread_mutex_unlock(&pending_mutex);
}

static void exit_handler_register(void)
{
    if (atexit(pending_remove_all) != 0) fault("atexit failed");
}

// Registers the file's temporary and takes ownership of its name.
static void pending_add(OutputFile *output, char *temporary)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, exit_handler_register);
    pthread_mutex_lock(&pending_mutex);
    output->temporary = temporary;
    output->process = getpid();
    output->next_pending = pending;
    pending = output;
    pthread_mutex_unlock(&pending_mutex);
}

// Unregisters the file's temporary, if it has one, and frees its name.
static void pending_drop(OutputFile *output)
{
    pthread_mutex_lock(&pending_mutex);
    OutputFile **at = &pending;
    while (*at && *at != output)
        at = &(*at)->next_pending;
    if (*at) *at = output->next_pending;
    pthread_mutex_unlock(&pending_mutex);
    free(output->temporary);
    output->temporary = NULL;
}

static bool output_failed(OutputFile *output, const char *doing, MessageList *messages)
{
    message_error(messages, "cannot %s '%s': %s", doing, output->target, strerror(errno));
    output_abandon(output);
    return false;
}

// A temporary is `.NAME.glint-N` in the folder of NAME, so that the rename is one step, and is locked while
// its process lives. A name may have 255 bytes; its start shows what the temporary is for.
#define TEMPORARY_FORMAT ".%.200s.glint-"

static char *temporary_name(const OutputFile *output, unsigned number)
{
    return text_format(TEMPORARY_FORMAT "%u", output->name, number);
}

bool output_is_temporary(const char *file_name, const char *name)
{
    char start[256];
    size_t length = (size_t)snprintf(start, sizeof start, TEMPORARY_FORMAT, name);
    if (strncmp(file_name, start, length) != 0 || file_name[length] == '\0') return false;
    return file_name[length + strspn(file_name + length, "0123456789")] == '\0';
}

void output_remove_stale(int folder, const char *file_name)
{
    struct stat opened;
    OwnedDescriptor descriptor = openat(folder, file_name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) return;
    // its process may have removed or renamed it meanwhile, and another may use the name again
    if (flock(descriptor, LOCK_EX | LOCK_NB) == 0 && fstat(descriptor, &opened) == 0 &&
        S_ISREG(opened.st_mode) && opened.st_uid == geteuid() && file_has_name(descriptor, folder, file_name))
        unlinkat(folder, file_name, 0);
}

static void stale_temporaries_remove(const OutputFile *output)
{
    int descriptor = openat(output->folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *folder = descriptor < 0 ? NULL : fdopendir(descriptor);
    if (!folder) {
        if (descriptor >= 0) close(descriptor);
        return;
    }
    for (const struct dirent *item; (item = readdir(folder)) != NULL;)
        if (output_is_temporary(item->d_name, output->name))
            output_remove_stale(output->folder, item->d_name);
    closedir(folder);
}

enum { TEMPORARY_TRIES = 1000 };

static int named_open(OutputFile *output, mode_t mode)
{
    stale_temporaries_remove(output);
    for (unsigned i = 0; i < TEMPORARY_TRIES; i++) {
        char *name = temporary_name(output, i);
        int descriptor = openat(output->folder, name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
        // a process that removes stale temporaries may have locked it first
        if (descriptor >= 0 && file_lock(descriptor) == FILE_LOCKED) {
            pending_add(output, name);
            return descriptor;
        }
        free(name);
        if (descriptor >= 0)
            close(descriptor);
        else if (errno != EEXIST)
            return -1;
    }
    return -1;
}

typedef struct {
    char path[32];
} DescriptorPath;

static DescriptorPath descriptor_path(int descriptor)
{
    DescriptorPath link;
    snprintf(link.path, sizeof link.path, "/proc/self/fd/%d", descriptor);
    return link;
}

// Opens an unnamed file, which vanishes with its process. Returns -1 if the file system does not support it
// or /proc cannot name it.
static int unnamed_open(const OutputFile *output, mode_t mode)
{
    int descriptor = openat(output->folder, ".", O_WRONLY | O_TMPFILE | O_CLOEXEC, mode);
    if (descriptor < 0 || access(descriptor_path(descriptor).path, F_OK) == 0) return descriptor;
    close(descriptor);
    return -1;
}

// Links an unnamed file to its target's name if that is free, else to a temporary name.
static bool unnamed_link(OutputFile *output)
{
    int descriptor = fileno(output->file);
    DescriptorPath link = descriptor_path(descriptor);
    if (linkat(AT_FDCWD, link.path, output->folder, output->name, AT_SYMLINK_FOLLOW) == 0) return true;
    if (errno != EEXIST) return false;
    stale_temporaries_remove(output);
    flock(descriptor, LOCK_EX | LOCK_NB);
    for (unsigned i = 0; i < TEMPORARY_TRIES; i++) {
        char *name = temporary_name(output, i);
        if (linkat(AT_FDCWD, link.path, output->folder, name, AT_SYMLINK_FOLLOW) == 0) {
            pending_add(output, name);
            return true;
        }
        free(name);
        if (errno != EEXIST) return false;
    }
    return false;
}

// Opens a device or a pipe directly, because renaming cannot replace it.
static bool output_open_directly(OutputFile *output, MessageList *messages)
{
    output->file = fopen(output->target, "wbe");
    return output->file || output_failed(output, "write", messages);
}

enum { MODE_NEW = 0666, MODE_PRIVATE = 0600, MODE_BITS = 0777 };

// Creates `output->name` in `output->folder`. The umask applies to the mode `created`, but not to `exact`,
// which may be NULL.
static bool output_create_next_to(OutputFile *output, mode_t created, const mode_t *exact,
                                  MessageList *messages)
{
    int descriptor = unnamed_open(output, created);
    if (descriptor < 0) descriptor = named_open(output, created);
    if (descriptor < 0) return output_failed(output, "create", messages);
    if (exact) fchmod(descriptor, *exact); // failure is harmless on a file system without modes
    output->file = fdopen(descriptor, "wb");
    if (output->file) return true;
    int error = errno;
    close(descriptor);
    errno = error;
    return output_failed(output, "create", messages);
}

static bool folder_open(OutputFile *output)
{
    char *slash = strrchr(output->target, '/');
    output->name = slash ? slash + 1 : output->target;
    if (output->name[0] == '\0') {
        errno = ENOENT;
        return false;
    }
    output->folder = file_folder_open(output->target);
    output->has_folder = output->folder >= 0;
    return output->has_folder;
}

bool output_open_private(OutputFile *output, int folder, const char *name, MessageList *messages)
{
    *output = (OutputFile){.target = memory_copy_text(name), .is_private = true};
    output->name = output->target;
    output->folder = fcntl(folder, F_DUPFD_CLOEXEC, 0);
    output->has_folder = output->folder >= 0;
    if (!output->has_folder) return output_failed(output, "create", messages);
    static const mode_t exact = MODE_PRIVATE;
    return output_create_next_to(output, MODE_PRIVATE, &exact, messages);
}

// Returns the end of a chain of symbolic links, even if no file exists there, or `target` if not a link.
static char *link_end(const char *target)
{
    enum { STEPS_MAX = 40 }; // as in Linux; a longer chain is a cycle
    char *path = memory_copy_text(target), aim[PATH_MAX];
    for (int step = 0; step < STEPS_MAX; step++) {
        ssize_t length = readlink(path, aim, sizeof aim);
        if (length < 0) break;
        const char *slash = aim[0] == '/' ? NULL : strrchr(path, '/');
        char *next = text_format("%.*s%.*s", slash ? (int)(slash + 1 - path) : 0, path, (int)length, aim);
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
    // A symbolic link is kept, and its target is replaced or created.
    char *resolved = exists ? realpath(target, NULL) : link_end(target);
    output->target = resolved ? resolved : memory_copy_text(target);
    if (error == ELOOP) {
        errno = error;
        return output_failed(output, "create", messages);
    }
    if (exists && !S_ISREG(old.st_mode)) return output_open_directly(output, messages);
    // Renaming would replace a read-only file.
    if (exists && access(output->target, W_OK) != 0) return output_failed(output, "write", messages);
    if (!folder_open(output)) return output_failed(output, "create", messages);
    return output_create_next_to(output, exists ? MODE_PRIVATE : MODE_NEW,
                                 exists ? &(mode_t){old.st_mode & MODE_BITS} : NULL, messages);
}

bool output_write(OutputFile *output, const void *bytes, size_t size, MessageList *messages)
{
    if (size == 0 || fwrite(bytes, 1, size, output->file) == size) return true;
    if (output->file == stdout) clearerr(stdout); // reported here, not by main
    return message_error(messages, "cannot write '%s': %s", output->target, strerror(errno));
}

bool output_finish(OutputFile *output, MessageList *messages)
{
    FILE *file = output->file;
    if (!file || file == stdout || output->is_finished) return true;
    output->is_finished = true;
    errno = EIO; // the error of an earlier write is lost
    if (fflush(file) != 0 || ferror(file)) return output_failed(output, "write", messages);
    bool needs_sync = output->has_folder && !output->is_private;
    if (needs_sync && !file_sync(fileno(file))) return output_failed(output, "write", messages);
    return true;
}

bool output_commit(OutputFile *output, MessageList *messages)
{
    if (!output_finish(output, messages)) return false;
    if (output->has_folder) {
        bool is_named = output->temporary || unnamed_link(output);
        if (is_named && output->temporary) {
            is_named = renameat(output->folder, output->temporary, output->folder, output->name) == 0;
            if (is_named) pending_drop(output);
        }
        if (!is_named || (!output->is_private && !file_sync(output->folder)))
            return output_failed(output, "write", messages);
    }
    FILE *file = output->file;
    output->file = NULL;
    if (file && file != stdout && fclose(file) != 0) return output_failed(output, "write", messages);
    output_abandon(output);
    return true;
}

void output_abandon(OutputFile *output)
{
    // closing the file ends its lock, after which another process may use the temporary's name
    if (output->temporary) unlinkat(output->folder, output->temporary, 0);
    if (output->file && output->file != stdout) fclose(output->file);
    pending_drop(output);
    if (output->has_folder) close(output->folder);
    free(output->target);
    *output = (OutputFile){0};
}

bool output_write_file(const char *target, const void *bytes, size_t size, MessageList *messages)
{
    OutputFile output;
    if (!output_open(&output, target, messages)) return false;
    if (output_write(&output, bytes, size, messages)) return output_commit(&output, messages);
    output_abandon(&output);
    return false;
}
