// The other MPI ranks: each renders rows of the first one's images on its device.
#pragma once

#include <stddef.h>

// Runs until the first rank has no more images. `local_rank`: among those of this machine, by which they
// share its devices. The arguments are the first rank's.
void other_rank_run(int rank, size_t local_rank, int argument_count, char **arguments);
