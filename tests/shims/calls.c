// Launches fail while a file `fails` exists. Files cannot be watched if there is one `unwatched`, folders if `folders`.
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
int inotify_init1(int flags)
{
    int (*init)(int) = dlsym(RTLD_NEXT, "inotify_init1");
    if (access("unwatched", F_OK) != 0) return init(flags);
    errno = EMFILE;
    return -1;
}
int inotify_add_watch(int notify, const char *folder, unsigned events)
{
    int (*add)(int, const char *, unsigned) = dlsym(RTLD_NEXT, "inotify_add_watch");
    if (access("folders", F_OK) != 0) return add(notify, folder, events);
    errno = ENOSPC;
    return -1;
}
