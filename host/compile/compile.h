// A Scene compiled into the flat arrays that the kernels read (kernels/types.h).
#pragma once

#include "host/base/message.h"
#include "host/compile/compiled_scene.h"
#include "host/compile/settings.h"

// Compiles a scene. Rounds each of its numbers to the kernel's precision once, after subtracting the eye's
// position in double, and derives axes, slopes and squares of a checker from the rounded numbers. Returns
// false with a message, and nothing to free, if the scene is too large, if a number or a light's distance
// does not fit the precision, or if `certified` has no error bound for a feature.
bool scene_compile(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                   MessageList *messages);
// Recompiles for another camera, size, samples or bounces. All else in `scene` and `settings` must be what
// the scene was compiled with. Takes a fraction of the time because it keeps the BVH's tree, unless
// compiled->unit was or becomes other than 1. Returns false with messages on failure. `compiled` then belongs
// to no scene until a move succeeds or, with such a unit, remains that of the earlier camera.
bool scene_move(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                MessageList *messages);

// Returns the largest channel that a pixel of the compiled scene can have with that many bounces, by its
// lights, materials, textures and background, or infinity if it overflows.
double scene_color_max(const CompiledScene *compiled, const Scene *scene, uint32_t bounces);
