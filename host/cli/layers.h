// A whole picture with all that lies behind its pixels, in the host's memory.
#pragma once

#include "host/measure/accuracy.h"
#include "host/render/renderer.h"

// Renders with `settings`, which the renderer was opened with. False if the user stopped it: nothing to free.
bool layers_render(AccuracyLayers *layers, Renderer *renderer, const RenderSettings *settings,
                   uint32_t light_count);

// Writes PREFIX.color.npy, PREFIX.t.npy and so on, each number as it was computed; a scene without lights has
// no PREFIX.shadow.npy. False with a message if one could not be written.
bool layers_save(const AccuracyLayers *layers, const char *prefix, MessageList *messages);
