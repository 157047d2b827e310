#include "host/view/caption.h"

#include "host/base/memory.h"
#include <SDL_ttf.h>
#include <fontconfig/fontconfig.h>
#include <stdlib.h>

static const float FONT_SIZE = 15;
enum { PADDING = 8 };

struct Caption {
    SDL_Renderer *target;
    TTF_Font *font;
};

// The file of the font that the user has chosen for fixed-width text. Caller frees; NULL: none.
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

Caption *caption_open(SDL_Renderer *target, float scale)
{
    char *path = font_path();
    TTF_Font *font = path && TTF_Init() == 0 ? TTF_OpenFont(path, (int)(FONT_SIZE * scale)) : NULL;
    free(path);
    if (!font) return NULL;
    Caption *caption = memory_allocate_zeroed(1, sizeof *caption);
    *caption = (Caption){target, font};
    return caption;
}

void caption_close(Caption *caption)
{
    if (!caption) return;
    TTF_CloseFont(caption->font);
    TTF_Quit();
    free(caption);
}

void caption_draw(const Caption *caption, CaptionPlace place, const char *text)
{
    if (!caption || text[0] == '\0') return;
    const SDL_Color white = {255, 255, 255, 255};
    int width = 0, height = 0;
    SDL_GetRendererOutputSize(caption->target, &width, &height);
    if (width <= 2 * PADDING) return;
    SDL_Surface *surface =
        TTF_RenderUTF8_Blended_Wrapped(caption->font, text, white, (Uint32)(width - 2 * PADDING));
    SDL_Texture *texture = surface ? SDL_CreateTextureFromSurface(caption->target, surface) : NULL;
    if (texture) {
        SDL_Rect ground = {0, 0, surface->w + 2 * PADDING, surface->h + 2 * PADDING};
        if (place == CAPTION_BOTTOM) ground.y = height - ground.h;
        SDL_Rect words = {PADDING, ground.y + PADDING, surface->w, surface->h};
        SDL_SetRenderDrawBlendMode(caption->target, SDL_BLENDMODE_BLEND);
        SDL_SetRenderDrawColor(caption->target, 0, 0, 0, 176);
        SDL_RenderFillRect(caption->target, &ground);
        SDL_RenderCopy(caption->target, texture, NULL, &words);
        SDL_DestroyTexture(texture);
    }
    SDL_FreeSurface(surface);
}
