// A Scene compiled into the flat arrays that the kernels read (kernels/types.h).
#pragma once

#include "host/base/message.h"
#include "host/compile/compiled_scene.h"
#include "host/compile/settings.h"

// Every number of the scene is rounded to the kernel's precision once, after the eye's position was
// subtracted in double; what is derived from numbers (axes, slopes, squares of a checker) is derived from the
// rounded ones. Returns false with a message, and nothing to free, where the scene is too large, a number or
// a light's distance does not fit the precision, or a texture cannot be read.
bool scene_compile(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                   MessageList *messages);
// Takes another camera, size, samples or bounces; all else in `scene` and `settings` is what the scene was
// compiled with. The BVH keeps its tree, so that this takes a fraction of the time. Returns false with
// messages if it fails; `compiled` then belongs to no scene until a move succeeds.
bool scene_move(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                MessageList *messages);

// Returns the largest channel that a pixel of the compiled scene can have with that many bounces, by its
// lights, materials, textures and background; infinite where it overflows.
double scene_color_max(const CompiledScene *compiled, const Scene *scene, uint32_t bounces);
