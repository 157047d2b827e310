#include "host/base/parallel.h"

#include <pthread.h>
#include <unistd.h>

enum { THREADS_MAX = 64 };

typedef struct {
    pthread_t thread;
    void (*work)(void *context, size_t begin, size_t end);
    void *context;
    size_t begin, end;
} IndexRange;

static void *range_run(void *index_range)
{
    const IndexRange *range = index_range;
    range->work(range->context, range->begin, range->end);
    return NULL;
}

void parallel_run(size_t count, size_t grain_size, void (*work)(void *context, size_t begin, size_t end),
                  void *context)
{
    const size_t most = count / grain_size;
    const long cores = most > 1 ? sysconf(_SC_NPROCESSORS_ONLN) : 1; // sysconf reads a file
    size_t range_count = cores < 1 ? 1 : cores > THREADS_MAX ? THREADS_MAX : (size_t)cores;
    if (most > 0 && range_count > most) range_count = most;
    IndexRange ranges[THREADS_MAX];
    size_t started = 0, begin = 0;
    while (started + 1 < range_count) {
        IndexRange *range = &ranges[started];
        *range = (IndexRange){
            .work = work, .context = context, .begin = begin, .end = count * (started + 1) / range_count};
        if (pthread_create(&range->thread, NULL, range_run, range) != 0) break;
        begin = range->end;
        started++;
    }
    work(context, begin, count); // the last range, and those whose threads could not be started
    for (size_t i = 0; i < started; i++)
        pthread_join(ranges[i].thread, NULL);
}
