#include "host/base/file.h"

#include "host/base/memory.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

FileLock file_lock(int descriptor)
{
    struct stat status;
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) return errno == EWOULDBLOCK ? FILE_BUSY : FILE_LOCKED;
    return fstat(descriptor, &status) == 0 && status.st_nlink > 0 ? FILE_LOCKED : FILE_REMOVED;
}

bool file_has_name(int descriptor, int folder, const char *name)
{
    struct stat opened, named;
    return fstat(descriptor, &opened) == 0 && fstatat(folder, name, &named, AT_SYMLINK_NOFOLLOW) == 0 &&
           named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

FileId file_id(const char *path)
{
    struct stat status;
    return path && stat(path, &status) == 0 ? (FileId){status.st_dev, status.st_ino} : (FileId){0};
}

bool file_is_same(FileId a, FileId b)
{
    return a.device == b.device && a.index == b.index && a.index > 0;
}

const char *file_base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

char *file_stem(const char *path)
{
    const char *name = strcmp(path, "-") == 0 ? "image" : file_base_name(path), *dot = strrchr(name, '.');
    return memory_copy_part(name, dot && dot > name ? (size_t)(dot - name) : strlen(name));
}

int file_folder_open(const char *path)
{
    const char *slash = strrchr(path, '/');
    OWNED char *folder = slash ? memory_copy_part(path, (size_t)(slash + 1 - path)) : memory_copy_text(".");
    int descriptor = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0 && errno == EACCES) descriptor = open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC);
    return descriptor;
}

const char *file_obstacle(const char *path)
{
    struct stat status;
    if (stat(path, &status) != 0) return strerror(errno);
    if (!S_ISREG(status.st_mode)) return "not a regular file";
    return access(path, R_OK) == 0 ? NULL : strerror(errno);
}

bool file_sync(int descriptor)
{
    return fsync(descriptor) == 0 || errno == EINVAL || errno == ENOSYS || errno == EBADF;
}
