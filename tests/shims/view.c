// Makes calls of glint view fail while files exist in its working folder. tests/test_view.py preloads it.
//
//   fails       launches fail
//   late        file changes are reported late
//   unwatched   files cannot be watched
//   folders     folders cannot be watched
#define CL_TARGET_OPENCL_VERSION 120
#define _GNU_SOURCE
#include <CL/cl.h>
#include <dlfcn.h>
#include <errno.h>
#include <sys/inotify.h>
#include <unistd.h>

// The function that the shim stands in for.
#define NEXT(function) ((__typeof__(&function))dlsym(RTLD_NEXT, #function))

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                              const size_t *first, const size_t *global, const size_t *local,
                              cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    if (access("fails", F_OK) == 0) return CL_OUT_OF_RESOURCES;
    return NEXT(clEnqueueNDRangeKernel)(queue, kernel, dimensions, first, global, local, wait_count, wait,
                                        event);
}

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
