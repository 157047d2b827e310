// Runs loops in several threads.
#pragma once

#include <stddef.h>

// Calls `work` on ranges begin..end-1 that together cover 0..count-1 once, on one thread per core, at most
// 64. Each range has at least `least` items. Returns when all are done.
void parallel_run(size_t count, size_t least, void (*work)(void *context, size_t begin, size_t end),
                  void *context);
