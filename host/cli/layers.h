// A whole picture with all that lies behind its pixels, in the host's memory.
#pragma once

#include "host/base/message.h"
#include "host/render/layers.h"
#include "host/render/renderer.h"

// Renders the whole picture into the arrays that are there; all must be but position and ray. False if the
// user stopped it.
bool layers_take(PictureLayers *layers, Renderer *renderer);

// Renders with `settings`, which the renderer was opened with. False if the user stopped it: nothing to free.
bool layers_render(PictureLayers *layers, Renderer *renderer, const RenderSettings *settings,
                   uint32_t light_count);

// Writes PREFIX.color.npy, PREFIX.t.npy and so on, each number as it was computed; a scene without lights has
// no PREFIX.shadow.npy. False with a message if one could not be written.
bool layers_save(const PictureLayers *layers, const char *prefix, MessageList *messages);
