// Text over the image.
#pragma once

#include <SDL.h>
#include <stdbool.h>

typedef struct Caption Caption;

typedef enum { CAPTION_TOP, CAPTION_BOTTOM } CaptionPlace;

// In a fixed-width font of the system, `scale` times the usual size. NULL where there is none.
Caption *caption_open(SDL_Renderer *target, float scale);
void caption_close(Caption *caption);
// Draws lines of text on a dark ground at the left of the image. Nothing without a font.
void caption_draw(const Caption *caption, CaptionPlace place, const char *text);
