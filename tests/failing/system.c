// Makes calls of the system fail in C tests.
#include "tests/failing/calls.h"
#include "tests/failing/faults.h"
#include <errno.h>
#include <sys/statvfs.h>

bool disk_is_full;

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *argument)
{
    return fault_at("pthread_create", 0, NULL) ? EAGAIN
                                               : __real_pthread_create(thread, attributes, run, argument);
}

// Where _FILE_OFFSET_BITS is 64, on i386 or by OpenEXR's flags, the call is named statvfs64.
int __real_statvfs(const char *path, struct statvfs *disk);
int __real_statvfs64(const char *path, struct statvfs *disk);
int __wrap_statvfs(const char *path, struct statvfs *disk);
int __wrap_statvfs64(const char *path, struct statvfs *disk);

static bool full_disk_report(struct statvfs *disk)
{
    if (disk_is_full) *disk = (struct statvfs){.f_blocks = 25, .f_bavail = 3, .f_frsize = 4096};
    return disk_is_full;
}

int __wrap_statvfs(const char *path, struct statvfs *disk)
{
    return full_disk_report(disk) ? 0 : __real_statvfs(path, disk);
}

int __wrap_statvfs64(const char *path, struct statvfs *disk)
{
    return full_disk_report(disk) ? 0 : __real_statvfs64(path, disk);
}
