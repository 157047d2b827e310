// The other MPI ranks. Each renders rows of the first one's images on its device.
#pragma once

#include <stddef.h>

// Runs until the first rank has no more images. `local_rank` is its number on this machine, by which ranks
// share the devices. The arguments are the first rank's.
void other_rank_run(size_t local_rank, int argument_count, char **arguments);
