// Draws the time line of an animation along the lower edge of the window, and plays its frames.
#include "host/view/window_state.h"

#include "host/base/clock.h"
#include "host/base/text.h"

static const double FRAME_RATE_DEFAULT = 24;
enum { MARGIN = 2, INDENT = 8, MARK_WIDTH = 3 };

bool has_time_line(const Window *window)
{
    return window->scene.frame_count > 1;
}

static void play_start(Window *window)
{
    window->play.start_seconds = clock_seconds();
    window->play.start_frame = window->wanted.scene_frame;
}

void scene_frame_show(Window *window, int64_t frame)
{
    const int64_t count = has_time_line(window) ? window->scene.frame_count : 1;
    window->wanted.scene_frame = (uint32_t)((frame % count + count) % count);
    window->redraws = true;
    play_start(window);
}

void play_toggle(Window *window)
{
    window->play.is_running = !window->play.is_running && has_time_line(window);
    play_start(window);
}

void play(Window *window)
{
    if (window->mouse.drag == DRAG_TIME) play_start(window);
    if (window->frame.number != window->request || window->wanted.scene_frame != window->sent.scene_frame)
        return;
    const double rate = window->scene.frame_rate > 0 ? window->scene.frame_rate : FRAME_RATE_DEFAULT;
    const double frames = rate * (clock_seconds() - window->play.start_seconds);
    window->wanted.scene_frame =
        (uint32_t)((window->play.start_frame + (uint64_t)frames) % window->scene.frame_count);
}

int time_line_height(const Window *window)
{
    return has_time_line(window) ? caption_character(window->screen.caption).y + 2 * MARGIN : 0;
}

bool is_in_time_line(const Window *window, const double at[2])
{
    return at[1] >= (double)window->wanted.size.height - time_line_height(window);
}

void time_line_follow(Window *window, const double at[2])
{
    const double frame = floor(at[0] / window->wanted.size.width * window->scene.frame_count);
    scene_frame_show(window, (int64_t)fmax(0, fmin(frame, window->scene.frame_count - 1.0)));
}

void time_line_draw(const Window *window)
{
    if (!has_time_line(window)) return;
    SDL_Renderer *target = window->screen.renderer;
    const int width = (int)window->wanted.size.width, height = time_line_height(window);
    const int top = (int)window->wanted.size.height - height;
    const int at = (int)((window->wanted.scene_frame + 0.5) / window->scene.frame_count * width);
    area_fill(target, (SDL_Rect){0, top, width, height}, CAPTION_GROUND);
    area_fill(target, (SDL_Rect){0, top, at, height}, (SDL_Color){255, 255, 255, 48});
    area_fill(target, (SDL_Rect){at - MARK_WIDTH / 2, top, MARK_WIDTH, height},
              (SDL_Color){96, 160, 255, 255});
    char text[64];
    snprintf(text, sizeof text, "frame %u of 0-%u", window->wanted.scene_frame,
             window->scene.frame_count - 1);
    caption_draw_line(window->screen.caption, INDENT, top + MARGIN, text);
}
