// Loops over several threads.
#pragma once

#include <stddef.h>

// Calls `work` on ranges begin..end-1 that cover 0..count-1 once, on a thread per core, 64 at most, but
// each with at least `least`. Returns when all are done.
void parallel_run(size_t count, size_t least, void (*work)(void *context, size_t begin, size_t end),
                  void *context);
