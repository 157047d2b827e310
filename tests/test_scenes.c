// Checks that every scene in scenes/ is read without a warning and renders to an image that is not blank.
// Where tests are long, each scene has the kernel that glint builds for it.
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"
#include <glob.h>

enum { WIDTH = 64, HEIGHT = 36, COLORS_MIN = 16, SCENES_MIN = 12 };

// Returns a color in 8 bits per channel.
static uint32_t color_number(const double *color)
{
    uint32_t number = 0;
    for (size_t channel = 0; channel < 3; channel++)
        number = number << 8 | (uint32_t)(255 * fmin(color[channel], 1));
    return number;
}

static int number_compare(const void *a, const void *b)
{
    const uint32_t first = *(const uint32_t *)a, second = *(const uint32_t *)b;
    return (first > second) - (first < second);
}

static size_t color_count(const Film *film)
{
    uint32_t numbers[WIDTH * HEIGHT];
    for (size_t i = 0; i < WIDTH * HEIGHT; i++)
        numbers[i] = color_number(film->color + 3 * i);
    qsort(numbers, WIDTH * HEIGHT, sizeof *numbers, number_compare);
    size_t count = 1;
    for (size_t i = 1; i < WIDTH * HEIGHT; i++)
        count += numbers[i] != numbers[i - 1];
    return count;
}

TEST(scenes_render)
{
    glob_t scenes;
    assert_int_equal(glob("scenes/*.*", 0, NULL, &scenes), 0);
    assert_true(scenes.gl_pathc >= SCENES_MIN);
    for (size_t i = 0; i < scenes.gl_pathc; i++) {
        OwnedScene scene = scene_of_file(scenes.gl_pathv[i]);
        const RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
        OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
        const size_t faulty = film_count_faulty(&film), colors = color_count(&film);
        if (faulty > 0 || colors < COLORS_MIN)
            fail_msg("%s: %zu faulty pixels, %zu colors", scenes.gl_pathv[i], faulty, colors);
    }
    globfree(&scenes);
}

TEST_MAIN(probe_open, probe_close)
