// Runs loops in several threads.
#pragma once

#include <stddef.h>

// Calls `work` for consecutive ranges [begin, end) that partition the indices below `count`, each in its own
// thread: one per core, at most 64, and fewer where a range would have fewer than `grain_size` indices, which
// must not be 0. The calling thread works on one range. Returns when all are done.
void parallel_run(size_t count, size_t grain_size, void (*work)(void *context, size_t begin, size_t end),
                  void *context);
