// MPI rank 0: glint render, with the other ranks' devices added.
#pragma once

#include <stddef.h>

// Returns the exit status.
int first_rank_run(size_t other_count, int argument_count, char **arguments);
