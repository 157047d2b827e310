// Watches folders, not files, because the watch of a file would stay with it when another file is renamed to
// its name.
#include "host/view/watch.h"

#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

typedef struct {
    int folder; // its watch
    char *name; // in the folder
    char *path; // reported
} WatchedFile;

struct Watch {
    void (*changed)(void *context, const char *path);
    void *context;
    int notify, end; // inotify; an event that ends the thread
    pthread_t thread;
    pthread_mutex_t mutex; // guards what follows
    bool has_failed;       // a folder cannot be watched, which is reported once
    ARRAY_OF(WatchedFile) files;
};

static void event_report(const Watch *watch, const struct inotify_event *event)
{
    if (event->mask & IN_Q_OVERFLOW) watch->changed(watch->context, NULL);
    for (size_t i = 0; i < watch->files.count && event->len > 0; i++) {
        const WatchedFile *file = &watch->files.items[i];
        if (file->folder == event->wd && strcmp(file->name, event->name) == 0)
            watch->changed(watch->context, file->path);
    }
}

// Reads pending events, up to 4096 bytes, and reports those of watched files.
static void events_report(Watch *watch)
{
    _Alignas(struct inotify_event) char events[4096];
    ssize_t size = read(watch->notify, events, sizeof events);
    pthread_mutex_lock(&watch->mutex);
    for (ssize_t at = 0; at < size;) {
        const struct inotify_event *event = (const void *)(events + at);
        event_report(watch, event);
        at += (ssize_t)(sizeof *event + event->len);
    }
    pthread_mutex_unlock(&watch->mutex);
}

static void *watch_run(void *context)
{
    Watch *watch = context;
    struct pollfd sources[] = {{watch->notify, POLLIN, 0}, {watch->end, POLLIN, 0}};
    for (;;) {
        poll(sources, 2, -1);
        if (sources[1].revents) return NULL;
        if (sources[0].revents) events_report(watch);
    }
}

static void files_forget(Watch *watch)
{
    for (size_t i = 0; i < watch->files.count; i++) {
        free(watch->files.items[i].name);
        free(watch->files.items[i].path);
    }
    watch->files.count = 0;
}

static void watch_free(Watch *watch)
{
    if (watch->notify >= 0) close(watch->notify);
    if (watch->end >= 0) close(watch->end);
    files_forget(watch);
    free(watch->files.items);
    pthread_mutex_destroy(&watch->mutex);
    free(watch);
}

static void failure_print(const char *files, const char *more, int error)
{
    fprintf(stderr, "glint: warning: changes to %s%s will not be noticed: %s\n", files, more,
            strerror(error));
}

Watch *watch_open(void (*changed)(void *context, const char *path), void *context)
{
    Watch *watch = memory_allocate_zeroed(1, sizeof *watch);
    watch->changed = changed;
    watch->context = context;
    pthread_mutex_init(&watch->mutex, NULL);
    watch->notify = inotify_init1(IN_CLOEXEC);
    watch->end = watch->notify < 0 ? -1 : eventfd(0, EFD_CLOEXEC);
    const int error = watch->end < 0 ? errno : pthread_create(&watch->thread, NULL, watch_run, watch);
    if (error == 0) return watch;
    failure_print("files", "", error);
    watch_free(watch);
    return NULL;
}

void watch_close(Watch *watch)
{
    if (!watch) return;
    const uint64_t one = 1;
    while (write(watch->end, &one, sizeof one) != sizeof one) {
    }
    pthread_join(watch->thread, NULL);
    watch_free(watch);
}

// Watches the file at a place, whose changes are reported as those of the path.
static void place_add(Watch *watch, const char *place, const char *path)
{
    const char *slash = strrchr(place, '/');
    OWNED char *folder = memory_copy_text(slash ? place : ".");
    if (slash) folder[slash == place ? 1 : slash - place] = '\0';
    // the same folder gets the same watch
    const int descriptor =
        inotify_add_watch(watch->notify, folder, IN_CLOSE_WRITE | IN_MOVED_TO | IN_ONLYDIR);
    if (descriptor >= 0) {
        WatchedFile file = {descriptor, memory_copy_text(file_base_name(place)), memory_copy_text(path)};
        array_push(watch->files, file);
    } else if (errno != ENOENT && !watch->has_failed) { // the reader of a missing file reports it
        failure_print(path, ", and perhaps to other files,", errno);
        watch->has_failed = true;
    }
}

// Watches the file and, if it is a symbolic link, each link on the way and the file to which they lead, which
// may be missing.
static void file_add(Watch *watch, const char *path)
{
    enum { LINKS_MAX = 40 }; // as in the kernel
    OwnedText place = {0};
    text_append(&place, path, strlen(path));
    for (int i = 0; i < LINKS_MAX; i++) {
        char link[PATH_MAX];
        place_add(watch, text_c(&place), path);
        const ssize_t length = readlink(text_c(&place), link, sizeof link);
        if (length <= 0) return;
        const char *slash = strrchr(text_c(&place), '/');
        place.count = link[0] != '/' && slash ? (size_t)(slash + 1 - place.items) : 0;
        text_append(&place, link, (size_t)length);
    }
}

void watch_add(Watch *watch, const char *path)
{
    if (!watch) return;
    pthread_mutex_lock(&watch->mutex);
    file_add(watch, path);
    pthread_mutex_unlock(&watch->mutex);
}

// Folders stay watched until the end. Events of their other files are ignored.
void watch_only(Watch *watch, const char *path)
{
    if (!watch) return;
    pthread_mutex_lock(&watch->mutex);
    files_forget(watch);
    file_add(watch, path);
    pthread_mutex_unlock(&watch->mutex);
}
