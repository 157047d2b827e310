// Text over the image.
#pragma once

#include <SDL.h>
#include <stdbool.h>

typedef struct Caption Caption;

typedef enum { CAPTION_TOP, CAPTION_BOTTOM } CaptionPlace;

// In a fixed-width font of the system, `scale` times the usual size. NULL where there is none: then nothing
// is drawn.
Caption *caption_open(SDL_Renderer *target, float scale);
void caption_close(Caption *caption);
// Leaves rows of pixels free at the bottom of the image. Accepts NULL.
void caption_reserve(Caption *caption, int height);
// Returns the width and height of the rest of the image.
SDL_Point caption_room(const Caption *caption);
// Draws lines of text on a dark ground at the left of the image, in a smaller font where they do not fit and
// wrapped where they do not fit in that.
void caption_draw(Caption *caption, CaptionPlace place, const char *text);

// The size of a character of the usual size, in pixels; 0 without a font.
SDL_Point caption_character(Caption *caption);
// Draws one line without a ground, from its top left.
void caption_draw_line(Caption *caption, int x, int y, const char *text);
// The ground of a caption.
void caption_draw_ground(const Caption *caption, SDL_Rect place);
