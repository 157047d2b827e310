// The light of the sky, from all directions.
#pragma once

#include "host/scene/scene.h"

// Returns the mean of the colors of the sky's image, which must be decoded, over all directions.
Color sky_mean(const Scene *scene);

// Sets sky.cells and adds the sky as a directional light, whose direction differs in each of a pixel's
// samples. A black sky adds none. Its image, if it has one, must be decoded.
void scene_add_sky_light(Scene *scene);
