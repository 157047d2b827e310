// Collects everything that the bits of an image depend on as the key of its checkpoint.
#pragma once

#include "host/base/text.h"
#include "host/cli/ranks.h"

// Appends the key of an image. The renderers must be open, with settings.hashes_scene. At `strict` any device
// may resume the render; at other precisions only devices of the same models may. `ranks` may be NULL.
void checkpoint_key(Text *key, const RenderSettings *settings, unsigned aovs, Renderer *const *renderers,
                    size_t count, const Ranks *ranks);
