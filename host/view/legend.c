#include "host/view/legend.h"

#include "host/image/heatmap.h"
#include "host/view/views.h"
#include <math.h>
#include <stdio.h>

// Sizes in characters.
enum { LABEL_WIDTH = 6, BAR_WIDTH = 2, LEGEND_WIDTH = 17 };

static void bar_draw(SDL_Renderer *target, SDL_Rect place)
{
    for (int y = 0; y < place.h; y++) {
        float color[3];
        Uint8 bytes[3];
        heatmap_color(1 - (y + 0.5) / place.h, color);
        for (int channel = 0; channel < 3; channel++)
            bytes[channel] = (Uint8)lroundf(255 * color[channel]);
        area_fill(target, (SDL_Rect){place.x, place.y + y, place.w, 1},
                  (SDL_Color){bytes[0], bytes[1], bytes[2], 255});
    }
}

void legend_draw(Caption *caption, SDL_Renderer *target, double largest_error)
{
    const SDL_Point character = caption_character(caption);
    const int line = character.y, decade = 3 * line / 2, height = HEATMAP_DECADES * decade;
    SDL_Rect ground = {0, 0, LEGEND_WIDTH * character.x, height + 3 * line};
    if (character.x == 0) return;
    const SDL_Point room = caption_room(caption);
    if (ground.w > room.x / 2 || ground.h > room.y / 2) return;
    ground.x = room.x - ground.w;
    ground.y = room.y - ground.h;
    area_fill(target, ground, CAPTION_GROUND);
    const int left = ground.x + character.x, top = ground.y + line;
    char text[32];
    for (int i = 0; i <= HEATMAP_DECADES; i++) {
        snprintf(text, sizeof text, "1e%.0f", log10(VIEW_ERROR_WHITE) - i);
        caption_draw_line(caption, left, top + i * decade - line / 2, text);
    }
    bar_draw(target, (SDL_Rect){left + LABEL_WIDTH * character.x, top, BAR_WIDTH * character.x, height});
    snprintf(text, sizeof text, "largest %.2g", largest_error);
    caption_draw_line(caption, left, top + height + 3 * line / 4, text);
}
