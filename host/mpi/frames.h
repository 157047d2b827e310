// Whole frames: where all ranks see the files, each renders frames by itself, the next one as soon as it is
// done with one. What does not divide among them is left to be rendered by all of them together.
#pragma once

#include "host/cli/render.h"

// The first rank's side; the command is that of the arguments. Returns the first frame that is left.
size_t frames_deal(RenderCommand *command, size_t other_count, int argument_count, char **arguments);
// Another rank's.
void frames_work(size_t local_rank, int argument_count, char **arguments);
