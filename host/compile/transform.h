// Transforms of scenes whose effect on the image is known.
#pragma once

#include "host/scene/scene.h"

// Multiplies every length; the image is the same, bit for bit where the factor is a power of two.
void scene_scale(Scene *scene, double factor);
// Returns a scaled copy that shares what has no length with the scene, which must outlive it. Free it with
// scene_scaled_free.
Scene scene_scaled(const Scene *scene, double factor);
void scene_scaled_free(Scene *scaled);
// Negates x, which mirrors the image unless its frame is shifted. Leaves meshes and images unchanged.
void scene_mirror(Scene *scene);
// Turns x into y, y into z and z into x, except in meshes. The image changes by rounding only.
void scene_turn_axes(Scene *scene);
