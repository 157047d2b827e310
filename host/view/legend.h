// The scale of the heat map of errors.
#pragma once

#include "host/view/caption.h"

// Draws it in the lower right corner, with the image's largest error, unless the window is less than twice
// as large.
void legend_draw(Caption *caption, SDL_Renderer *target, double largest_error);
