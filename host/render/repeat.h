// At `certified`: the pixels of a band that are in doubt, rendered anew in double.
#pragma once

#include "host/render/band.h"

// Begins a band, without a pixel in doubt.
void band_clear_doubts(Renderer *renderer, const BandBuffers *buffers, BandRows rows);

// Renders again in double what a kernel has left in doubt, and as at `double` what that leaves undecided.
// Counts both in the buffers, and notes them in AOV_DOUBT if that is there. Returns false if the device
// failed or settings.stop ended it.
bool band_repeat(Renderer *renderer, KernelKind kind, unsigned layers, BandBuffers *buffers, unsigned aovs,
                 BandRows rows);
