// Tests the window's map of errors by hand.
#include "host/base/array.h"
#include "host/view/views.h"
#include "tests/check.h"

TEST(errors_that_are_not_finite)
{
    static const struct {
        double value, reference, error;
    } rows[] = {
        {0.25, 0.25, 0},         {0.25, 0.5, 0.25},         {INFINITY, INFINITY, 0},
        {INFINITY, 1, INFINITY}, {NAN, 1, INFINITY},        {1, NAN, INFINITY},
        {NAN, NAN, INFINITY},    {NAN, INFINITY, INFINITY}, {INFINITY, -INFINITY, INFINITY},
    };
    for (size_t i = 0; i < COUNT_OF(rows); i++) {
        Film film = film_allocate(1, 1, 0, 0), reference = film_allocate(1, 1, 0, 0);
        uint8_t pixel[3];
        for (int channel = 0; channel < 3; channel++)
            film.color[channel] = reference.color[channel] = 0.5;
        film.color[1] = rows[i].value;
        reference.color[1] = rows[i].reference;
        assert_true(view_error(pixel, &film, &reference) == rows[i].error);
        const bool is_red = pixel[0] == 255 && pixel[1] == 0 && pixel[2] == 0;
        assert_int_equal(is_red, isinf(rows[i].error));
        film_free(&film);
        film_free(&reference);
    }
}

TEST_MAIN(NULL, NULL)
