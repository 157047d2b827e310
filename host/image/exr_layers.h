// Finds the channels of an EXR file that are its image.
#pragma once

#include "host/image/codec.h"

#include <openexr.h>

// Makes a call unless an earlier one failed, and keeps the first failure.
#define EXR_STEP(code, call) ((code) = (code) ? (code) : (call))

typedef enum {
    EXR_COLORS,    // red, green, blue
    EXR_GRAY,      // luminance
    EXR_CHROMA,    // luminance, (R - Y) / Y and (B - Y) / Y
    EXR_DIRECTION, // X, Y, Z: no light
    EXR_NUMBERS,   // one channel of any other name: no light
    EXR_OTHER      // channels that form no image
} ExrForm;

typedef struct {
    int part;
    ExrForm form;
    int channels[4]; // indices in the part's channel list
    uint32_t channel_count;
    bool has_alpha; // in the channel after them
} ExrLayer;

// Finds the layer that `file->options.layer` names. If that is NULL, chooses the default layer, whose
// channels have no prefix, if it has light, else the only layer with light, else the default layer or the
// only one with numbers. Returns false with the names to choose from unless exactly one layer qualifies.
bool exr_layer_find(exr_const_context_t context, const ImageFile *file, ExrLayer *layer);
