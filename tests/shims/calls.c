// While a file `fails` exists, launches fail. While `late` exists, file changes are reported late. `unwatched` and `folders` make
// watches of files and of folders fail.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stddef.h>
#include <unistd.h>
int clEnqueueNDRangeKernel(void *queue, void *kernel, unsigned dimensions, const size_t *offset, const size_t *items,
                           const size_t *group, unsigned count, const void *events, void *event)
{
    int (*launch)(void *, void *, unsigned, const size_t *, const size_t *, const size_t *, unsigned, const void *,
                  void *) = dlsym(RTLD_NEXT, "clEnqueueNDRangeKernel");
    if (access("fails", F_OK) == 0) return -5;
    return launch(queue, kernel, dimensions, offset, items, group, count, events, event);
}
static volatile int notify = -1;
int inotify_init1(int flags)
{
    int (*init)(int) = dlsym(RTLD_NEXT, "inotify_init1");
    if (access("unwatched", F_OK) != 0) return notify = init(flags);
    errno = EMFILE;
    return -1;
}
ssize_t read(int file, void *bytes, size_t size)
{
    ssize_t (*read_now)(int, void *, size_t) = dlsym(RTLD_NEXT, "read");
    while (file == notify && access("late", F_OK) == 0)
        usleep(10000);
    return read_now(file, bytes, size);
}
int inotify_add_watch(int notify, const char *folder, unsigned events)
{
    int (*add)(int, const char *, unsigned) = dlsym(RTLD_NEXT, "inotify_add_watch");
    if (access("folders", F_OK) != 0) return add(notify, folder, events);
    errno = ENOSPC;
    return -1;
}
