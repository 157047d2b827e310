// Distributes whole frames. If all ranks see the files, each renders frames alone, the next one as soon as
// it has finished one. Frames that do not divide evenly are left to all ranks together.
#pragma once

#include "host/cli/render.h"

// Runs on the first rank. `command` is that of the arguments. Returns the first frame that is left to all
// ranks.
size_t frames_deal(RenderCommand *command, size_t other_count, int argument_count, char **arguments);
// Runs on another rank.
void frames_work(size_t local_rank, int argument_count, char **arguments);
