#include "host/base/parallel.h"

#include <pthread.h>
#include <stdbool.h>
#include <unistd.h>

enum { THREADS_MAX = 64 };

typedef struct {
    void (*work)(void *context, size_t begin, size_t end);
    void *context;
    size_t begin, end;
} IndexRange;

static void *range_run(void *context)
{
    const IndexRange *range = context;
    range->work(range->context, range->begin, range->end);
    return NULL;
}

void parallel_run(size_t count, size_t least, void (*work)(void *context, size_t begin, size_t end),
                  void *context)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    size_t threads = cores < 1 ? 1 : cores > THREADS_MAX ? THREADS_MAX : (size_t)cores;
    if (threads > count / least) threads = count < least ? 1 : count / least;
    IndexRange ranges[THREADS_MAX];
    pthread_t others[THREADS_MAX];
    bool started[THREADS_MAX];
    for (size_t i = 1; i < threads; i++) {
        ranges[i] = (IndexRange){work, context, count * i / threads, count * (i + 1) / threads};
        started[i] = pthread_create(&others[i], NULL, range_run, &ranges[i]) == 0;
    }
    work(context, 0, count / threads);
    for (size_t i = 1; i < threads; i++) {
        if (started[i])
            pthread_join(others[i], NULL);
        else
            range_run(&ranges[i]);
    }
}
