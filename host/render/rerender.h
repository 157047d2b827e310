// Re-renders the flagged pixels of a band in double precision at `certified`.
#pragma once

#include "host/render/band.h"

// Clears the layer `flag` of a band if the buffers have it.
void flag_layer_clear(Pass *pass, const BandBuffers *buffers, BandRows rows);

// Re-renders in double precision, with bounds, the pixels that a kernel flagged. Re-renders those that remain
// uncertified as at `double`. Adds the number of both to the buffers' counts and records them in the layer
// `flag` if the buffers have it. Returns false if the device failed or settings.stop ended the render.
bool band_rerender(Pass *pass, KernelType type, unsigned layers, BandBuffers *buffers, unsigned aovs,
                   BandRows rows);
