// Loops over several threads.
#pragma once

#include <stddef.h>

// Returns the number of threads that a loop takes at most: one per core, at most 64.
size_t parallel_threads(void);

// Calls `work` on ranges begin..end-1 that together cover 0..count-1 once, on parallel_threads
// threads at most. Each range has at least `least` items. Returns when all are done.
void parallel_run(size_t count, size_t least, void (*work)(void *context, size_t begin, size_t end),
                  void *context);
