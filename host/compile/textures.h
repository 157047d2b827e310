// Pictures on surfaces, as the kernels have them.
#pragma once

#include "host/compile/flatten.h"

// Reads the scene's pictures, makes them linear (display values are taken as sRGB; a scene of display colors
// takes all values as they are) and halves them level by level, each texel the mean of those it stands for:
// FLAT_TEXTURE_LEVELS and FLAT_TEXELS. Tells the materials, and lays the pictures onto planes, discs and
// meshes. False, with the place in the scene file, where a picture cannot be read.
bool textures_load(CompiledScene *flat, const Scene *scene, const FlattenSettings *settings,
                   MessageList *messages);

// A picture's full size.
typedef struct {
    uint32_t width, height;
} TextureSize;

// Where the pictures lie: on planes and discs, on the triangles of meshes, and how dense their texels are.
// `sizes`: of each picture of the scene.
void texture_mapping_fill(CompiledScene *flat, const Scene *scene, const TextureSize *sizes,
                          const FlattenSettings *settings);
