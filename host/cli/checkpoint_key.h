// What the bits of an image depend on, as the key of its checkpoint.
#pragma once

#include "host/base/text.h"
#include "host/cli/ranks.h"

// The renderers are open, with settings.hashes_scene. At `strict` any device may go on; at other precisions
// only devices of the same makes. `ranks` may be NULL.
void checkpoint_key(Text *key, const RenderSettings *settings, unsigned aovs, Renderer *const *renderers,
                    size_t count, const Ranks *ranks);
