// The scale of the heat map of errors.
#pragma once

#include "host/view/caption.h"

// Draws the scale and the image's largest error in the lower right corner, unless that would take more than
// half of the window's width or height.
void legend_draw(Caption *caption, SDL_Renderer *target, double largest_error);
