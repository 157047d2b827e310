// Decodes the images of a scene's materials and sky.
#pragma once

#include "host/import/load.h"

// Decodes the images, removes cutouts by opaque images, and sets up an ambient light that comes from the sky
// and a sky that is a light. Reports images that cannot be read or used, and warns of alpha that is not
// shown and of cutouts that are removed.
void textures_decode(Scene *scene, Report *report, const SceneOptions *options);
