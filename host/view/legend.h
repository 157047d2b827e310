// The scale of the heat map of errors.
#pragma once

#include "host/view/caption.h"

// Draws it in the lower right corner, with the image's largest error; not in a window less than twice as
// large.
void legend_draw(Caption *caption, SDL_Renderer *target, double largest_error);
