#include "host/view/preview.h"

enum { DIVISOR_MAX = 16, DIVISOR_FIRST = 4 };

// A finer frame must fit well: where it just does, the divisor would change with every frame.
static const double MARGIN = 0.75;

uint32_t preview_divisor(const Preview *preview, uint32_t width, uint32_t height)
{
    if (preview->divisor == 0) return DIVISOR_FIRST;
    for (uint32_t divisor = 1; divisor < DIVISOR_MAX; divisor++) {
        double pixels = (double)width / divisor * height / divisor;
        double seconds = preview->fixed_seconds + pixels * preview->seconds_of_pixel;
        if (seconds <= PREVIEW_SECONDS * (divisor < preview->divisor ? MARGIN : 1)) return divisor;
    }
    return DIVISOR_MAX;
}

void preview_note(Preview *preview, uint32_t divisor, double move_seconds, double render_seconds,
                  double pixels)
{
    *preview = (Preview){move_seconds, render_seconds / pixels, divisor};
}
