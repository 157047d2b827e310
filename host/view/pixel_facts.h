// What a pixel sees, in words.
#pragma once

#include "host/render/renderer.h"
#include "host/view/camera_moves.h"

typedef struct {
    Renderer *renderer; // of the scene, with its camera
    const Scene *scene;
    const char *scene_path;
    ImageSize size;
    uint32_t bounce_count;
} PixelView;

// Traces the ray through the center of a pixel, and the tree of the rays that it is reflected and refracted
// into, as an image of the size has them: a line for each with the object, its place in the scene's file, its
// material, t and, of the first, hit point and normal. The device's failure ends the text. Caller frees.
char *pixel_facts(const PixelView *view, uint32_t x, uint32_t y);
