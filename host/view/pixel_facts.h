// Describes in words what a pixel sees.
#pragma once

#include "host/render/renderer.h"
#include "host/view/camera_moves.h"

typedef struct {
    Renderer *renderer; // of the scene, with its camera
    const Scene *scene;
    const char *scene_path;
    ImageSize size;
    const RenderSettings *settings; // whose bounces and minimum contribution are used
} PixelView;

// Traces the ray through the center of a pixel and its tree of reflected and refracted rays. Returns a line
// per ray with the object, its place in the scene's file, its material and t. The first ray has a second line
// with the hit point and the normal. A failure of the device ends the text. The caller frees it.
char *pixel_facts(const PixelView *view, uint32_t x, uint32_t y);
