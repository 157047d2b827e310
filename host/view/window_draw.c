// Draws the frame, and text over it.
#include "host/view/window_state.h"

#include "host/view/keys.h"
#include "host/view/legend.h"

static const double STAGE_SECONDS = 0.3; // shorter stages are not shown

static void title_set(const Window *window)
{
    const uint32_t count =
        window->wanted.view == VIEW_COLOR ? window->options->frames.settings.sample_count : 1;
    OwnedText title = {0};
    // only ASCII, because in the C locale SDL sets no other title
    text_appendf(&title, "%s, %s, %s, %ux%u", scene_name(window), view_names[window->wanted.view],
                 precision_names[window->wanted.precision], window->wanted.size.width,
                 window->wanted.size.height);
    if (has_time_line(window))
        text_appendf(&title, ", frame %u of 0-%u", window->wanted.scene_frame, window->scene.frame_count - 1);
    if (!window->frame.pixels || window->frame.number < window->image_request)
        text_appendf(&title, ", preparing");
    else if (window->frame.samples < count)
        text_appendf(&title, ", %u of %u samples", window->frame.samples, count);
    else
        text_appendf(&title, ", %u %s", count, count == 1 ? "sample" : "samples");
    text_appendf(&title, " - glint (H: help)");
    SDL_SetWindowTitle(window->screen.window, text_c(&title));
}

void frame_show(Window *window)
{
    const Frame *frame = &window->frame;
    Screen *screen = &window->screen;
    int width = 0, height = 0;
    if (screen->texture) SDL_QueryTexture(screen->texture, NULL, NULL, &width, &height);
    if (width != (int)frame->width || height != (int)frame->height) {
        if (screen->texture) SDL_DestroyTexture(screen->texture);
        screen->texture =
            SDL_CreateTexture(screen->renderer, SDL_PIXELFORMAT_RGB24, SDL_TEXTUREACCESS_STREAMING,
                              (int)frame->width, (int)frame->height);
    }
    if (screen->texture) SDL_UpdateTexture(screen->texture, NULL, frame->pixels, 3 * (int)frame->width);
    window->redraws = true;
}

void stage_show(Window *window)
{
    Text text = {0};
    double seconds;
    if (frame_loop_stage(window->frames, &text, &seconds) && seconds >= STAGE_SECONDS)
        text_appendf(&text, ", %.0f s", seconds);
    else
        text_free(&text);
    window->redraws |= text.count > 0 || window->stage.count > 0;
    text_free(&window->stage);
    window->stage = text;
}

static void help_draw(const Window *window)
{
    OwnedText help = {0};
#define HELP_LINE(input, effect) text_appendf(&help, "%s%-12s  %s", help.count ? "\n" : "", input, effect);
    VIEW_KEY_LIST(HELP_LINE)
#undef HELP_LINE
    caption_draw(window->screen.caption, CAPTION_TOP, text_c(&help));
}

// Draws the times and what the pixel under the cursor sees.
static void facts_draw(const Window *window)
{
    OwnedText text = {0};
    if (window->shows_times && window->frame.summary) text_appendf(&text, "%s", window->frame.summary);
    if (text.count > 0 && window->frame.largest_error >= 0)
        text_appendf(&text, "\nlargest error against double: %.3g", window->frame.largest_error);
    if (window->facts.are_shown && window->facts.text)
        text_appendf(&text, "%s%s", text.count > 0 ? "\n" : "", window->facts.text);
    caption_draw(window->screen.caption, CAPTION_TOP, text_c(&text));
}

// Draws the message and what keeps the next frame waiting.
static void message_draw(const Window *window)
{
    OwnedText text = {0};
    if (window->message) text_appendf(&text, "%s", window->message);
    if (text.count > 0 && text.items[text.count - 1] != '\n') text_appendf(&text, "\n");
    text_appendf(&text, "%s", text_c(&window->stage));
    if (text.count > 0 && text.items[text.count - 1] == '\n') text.items[text.count - 1] = '\0';
    caption_draw(window->screen.caption, CAPTION_BOTTOM, text_c(&text));
}

void window_draw(Window *window)
{
    const Screen *screen = &window->screen;
    SDL_SetRenderDrawColor(screen->renderer, 0, 0, 0, 255);
    SDL_RenderClear(screen->renderer);
    if (screen->texture) SDL_RenderCopy(screen->renderer, screen->texture, NULL, NULL);
    caption_reserve(screen->caption, time_line_height(window));
    if (window->frame.pixels && window->frame.largest_error >= 0)
        legend_draw(screen->caption, screen->renderer, window->frame.largest_error);
    if (window->shows_help)
        help_draw(window);
    else
        facts_draw(window);
    message_draw(window);
    time_line_draw(window);
    SDL_RenderPresent(screen->renderer);
    title_set(window);
    window->redraws = false;
}
