// Composes the key of a checkpoint, which holds everything that the bits of its image depend on.
#pragma once

#include "host/base/text.h"
#include "host/cli/image_notes.h"

// Appends the key of an image. The renderers must be open, with settings.hashes_scene. At `strict` any device
// may resume the render; at other precisions only devices of the same models may.
void checkpoint_key(Text *key, const ImageOrigin *origin, unsigned aovs);
