// Scenes changed in ways that change their pictures in a known way only.
#pragma once

#include "host/scene/scene.h"

// Every length times a factor; with a power of two the picture is the same bit for bit.
void scene_scale(Scene *scene, double factor);
// A copy so changed, which shares with the scene what has no length and must not outlive it. Free with
// scene_scaled_free.
Scene scene_scaled(const Scene *scene, double factor);
void scene_scaled_free(Scene *scaled);
// x becomes -x, and the picture its mirror image. Not for scenes with meshes, as the next.
void scene_mirror(Scene *scene);
// x becomes y, y becomes z, z becomes x; the picture stays, but for rounding.
void scene_turn_axes(Scene *scene);
