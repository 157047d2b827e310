// The first rank: glint render, with the devices of the others.
#pragma once

#include <stddef.h>

// Returns the exit status.
int first_rank_run(size_t other_count, int argument_count, char **arguments);
