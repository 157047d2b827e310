// Text over the image.
#pragma once

#include <SDL.h>
#include <stdbool.h>

typedef struct Caption Caption;

typedef enum { CAPTION_TOP, CAPTION_BOTTOM } CaptionPlace;

// Opens a fixed-width font of the system, `scale` times the usual size. Returns NULL, with which nothing is
// drawn, if there is none.
Caption *caption_open(SDL_Renderer *target, float scale);
void caption_close(Caption *caption);
// Leaves rows of pixels free at the bottom of the image. Accepts NULL.
void caption_reserve(Caption *caption, int height);
// Returns the width and height of the rest of the image.
SDL_Point caption_room(const Caption *caption);
// Draws lines of text on a dark background at the left of the image. Text that does not fit gets a smaller
// font, and is wrapped if it does not fit in that either.
void caption_draw(Caption *caption, CaptionPlace place, const char *text);

// Returns the size of a character in the usual font size, in pixels, or 0 without a font.
SDL_Point caption_character(Caption *caption);
// Draws one line with no background, from its top left.
void caption_draw_line(Caption *caption, int x, int y, const char *text);
// Draws a rectangle over what is there. Captions have a ground of CAPTION_GROUND.
void area_fill(SDL_Renderer *target, SDL_Rect area, SDL_Color color);
#define CAPTION_GROUND ((SDL_Color){0, 0, 0, 176})
