// Makes calls of glint view fail while files exist in its working folder. tests/test_view.py preloads it.
//
//   late        file changes are reported late
//   unwatched   files cannot be watched
//   folders     folders cannot be watched
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <sys/inotify.h>
#include <unistd.h>

// The function that the shim stands in for.
#define NEXT(function) ((__typeof__(&function))dlsym(RTLD_NEXT, #function))

static volatile int watches = -1; // inotify's file

int inotify_init1(int flags)
{
    if (access("unwatched", F_OK) != 0) return watches = NEXT(inotify_init1)(flags);
    errno = EMFILE;
    return -1;
}

ssize_t read(int file, void *bytes, size_t size)
{
    while (file == watches && access("late", F_OK) == 0)
        usleep(10000);
    return NEXT(read)(file, bytes, size);
}

int inotify_add_watch(int file, const char *path, uint32_t events)
{
    if (access("folders", F_OK) != 0) return NEXT(inotify_add_watch)(file, path, events);
    errno = ENOSPC;
    return -1;
}
