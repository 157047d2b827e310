#include "host/view/preview.h"

#include <math.h>
#include <string.h>

enum { DIVISOR_MAX = 16, DIVISOR_FIRST = 4 };

// A finer frame must fit with this margin. Otherwise the divisor would change with every frame.
static const double MARGIN = 0.75;

static double median_of_3(const double values[3])
{
    const double low = fmin(values[0], values[1]), high = fmax(values[0], values[1]);
    return fmax(low, fmin(high, values[2]));
}

uint32_t preview_divisor(const Preview *preview, uint32_t width, uint32_t height)
{
    if (preview->divisor == 0) return DIVISOR_FIRST;
    const double fixed = median_of_3(preview->fixed_seconds);
    const double seconds_of_pixel = median_of_3(preview->seconds_of_pixel);
    for (uint32_t divisor = 1; divisor < DIVISOR_MAX; divisor++) {
        double pixels = (double)width / divisor * height / divisor;
        double seconds = fixed + pixels * seconds_of_pixel;
        if (seconds <= PREVIEW_SECONDS * (divisor < preview->divisor ? MARGIN : 1)) return divisor;
    }
    return DIVISOR_MAX;
}

void preview_record(Preview *preview, uint32_t divisor, double move_seconds, double render_seconds,
                    double pixels)
{
    for (int i = preview->divisor == 0 ? 0 : 2; i < 3; i++) {
        memmove(preview->fixed_seconds, preview->fixed_seconds + 1, 2 * sizeof *preview->fixed_seconds);
        memmove(preview->seconds_of_pixel, preview->seconds_of_pixel + 1,
                2 * sizeof *preview->seconds_of_pixel);
        preview->fixed_seconds[2] = move_seconds;
        preview->seconds_of_pixel[2] = render_seconds / pixels;
    }
    preview->divisor = divisor;
}
