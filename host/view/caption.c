#include "host/view/caption.h"

#include "host/base/memory.h"
#include <SDL_ttf.h>
#include <fontconfig/fontconfig.h>
#include <stdlib.h>

static const float FONT_SIZE = 15, FONT_SIZE_MIN = 9;
enum { PADDING = 8 };

struct Caption {
    SDL_Renderer *target;
    TTF_Font *font;
    int usual_size, least_size; // of the font, in pixels
    int size;                   // now
    int reserved;               // rows at the bottom
};

// Returns the file of the user's font for fixed-width text, or NULL. The caller frees it.
static char *font_path(void)
{
    FcConfig *config = FcInitLoadConfigAndFonts();
    FcPattern *wanted = FcNameParse((const FcChar8 *)"monospace");
    FcConfigSubstitute(config, wanted, FcMatchPattern);
    FcDefaultSubstitute(wanted);
    FcResult result;
    FcPattern *found = FcFontMatch(config, wanted, &result);
    FcChar8 *file = NULL;
    char *path = NULL;
    if (found && FcPatternGetString(found, FC_FILE, 0, &file) == FcResultMatch)
        path = memory_copy_text((const char *)file);
    if (found) FcPatternDestroy(found);
    FcPatternDestroy(wanted);
    FcConfigDestroy(config);
    FcFini();
    return path;
}

static void font_size_set(Caption *caption, int size)
{
    if (size != caption->size) TTF_SetFontSize(caption->font, size);
    caption->size = size;
}

Caption *caption_open(SDL_Renderer *target, float scale)
{
    OWNED char *path = font_path();
    const int size = (int)(FONT_SIZE * scale);
    const bool has_library = path && TTF_Init() == 0;
    TTF_Font *font = has_library ? TTF_OpenFont(path, size) : NULL;
    if (!font) {
        if (has_library) TTF_Quit();
        return NULL;
    }
    Caption *caption = memory_allocate_zeroed(1, sizeof *caption);
    *caption = (Caption){target, font, size, (int)(FONT_SIZE_MIN * scale), size, 0};
    return caption;
}

void caption_close(Caption *caption)
{
    if (!caption) return;
    TTF_CloseFont(caption->font);
    TTF_Quit();
    free(caption);
}

void caption_reserve(Caption *caption, int height)
{
    if (caption) caption->reserved = height;
}

SDL_Point caption_room(const Caption *caption)
{
    SDL_Point room = {0, 0};
    SDL_GetRendererOutputSize(caption->target, &room.x, &room.y);
    room.y -= caption->reserved;
    return room;
}

// Returns the number of characters of the longest line, and the number of lines.
static SDL_Point extent_of(const char *text)
{
    SDL_Point extent = {0, 1};
    int column = 0;
    for (; *text; text++) {
        const bool is_continuation = (*text & 0xC0) == 0x80; // of a character in UTF-8
        column = *text == '\n' ? 0 : column + !is_continuation;
        extent.y += *text == '\n';
        extent.x = SDL_max(extent.x, column);
    }
    return extent;
}

// Returns the size of a character in the font's current size.
static SDL_Point character_size(const Caption *caption)
{
    SDL_Point size = {0, TTF_FontLineSkip(caption->font)};
    TTF_SizeUTF8(caption->font, "0", &size.x, NULL);
    return size;
}

SDL_Point caption_character(Caption *caption)
{
    if (!caption) return (SDL_Point){0, 0};
    font_size_set(caption, caption->usual_size);
    return character_size(caption);
}

// Sets the largest font in which the extent fits. Returns the text's width, at most `room.x`.
static int font_size_fit(Caption *caption, SDL_Point extent, SDL_Point room)
{
    for (int size = caption->usual_size;; size--) {
        font_size_set(caption, size);
        const SDL_Point character = character_size(caption);
        const int width = extent.x * character.x;
        if (size <= caption->least_size || (width <= room.x && extent.y * character.y <= room.y))
            return SDL_min(width, room.x);
    }
}

void area_fill(SDL_Renderer *target, SDL_Rect area, SDL_Color color)
{
    SDL_SetRenderDrawBlendMode(target, SDL_BLENDMODE_BLEND);
    SDL_SetRenderDrawColor(target, color.r, color.g, color.b, color.a);
    SDL_RenderFillRect(target, &area);
}

static void surface_draw(const Caption *caption, SDL_Surface *surface, int x, int y, int width)
{
    SDL_Texture *texture = SDL_CreateTextureFromSurface(caption->target, surface);
    if (!texture) return;
    const SDL_Rect part = {0, 0, width, surface->h}, place = {x, y, width, surface->h};
    SDL_RenderCopy(caption->target, texture, &part, &place);
    SDL_DestroyTexture(texture);
}

static const SDL_Color white = {255, 255, 255, 255};

void caption_draw(Caption *caption, CaptionPlace place, const char *text)
{
    if (!caption || text[0] == '\0') return;
    SDL_Point room = caption_room(caption);
    room = (SDL_Point){room.x - 2 * PADDING, room.y - 2 * PADDING};
    if (room.x <= 0) return;
    const int width = font_size_fit(caption, extent_of(text), room);
    SDL_Surface *surface = TTF_RenderUTF8_Blended_Wrapped(caption->font, text, white, (Uint32)room.x);
    if (!surface) return;
    SDL_Rect ground = {0, 0, width + 2 * PADDING, surface->h + 2 * PADDING};
    if (place == CAPTION_BOTTOM) ground.y = SDL_max(0, room.y + 2 * PADDING - ground.h);
    area_fill(caption->target, ground, CAPTION_GROUND);
    surface_draw(caption, surface, PADDING, ground.y + PADDING, SDL_min(width, surface->w));
    SDL_FreeSurface(surface);
}

void caption_draw_line(Caption *caption, int x, int y, const char *text)
{
    if (!caption) return;
    font_size_set(caption, caption->usual_size);
    SDL_Surface *surface = TTF_RenderUTF8_Blended(caption->font, text, white);
    if (!surface) return;
    surface_draw(caption, surface, x, y, surface->w);
    SDL_FreeSurface(surface);
}
