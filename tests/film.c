#include "tests/film.h"
#include "tests/check.h"

#include "host/render/arithmetic.h"

bool tests_are_long(void)
{
    const char *value = getenv("GLINT_LONG_TESTS");
    return value && strcmp(value, "1") == 0;
}

const uint32_t *tested_lanes(const Device *device)
{
    static uint32_t lanes[LANES_MAX];
    const unsigned usual = device_lanes(device, false, 0);
    const unsigned few = usual > 1 || (device->type & CL_DEVICE_TYPE_GPU) ? usual : 4;
    size_t count = 0;
    for (unsigned requested = 1; requested <= LANES_MAX; requested *= requested == 1 ? 4 : 2) {
        const bool is_tested = requested == 1 || requested == few || tests_are_long();
        if (is_tested && device_lanes(device, false, requested) == requested) lanes[count++] = requested;
    }
    lanes[count] = 0;
    return lanes;
}

FeatureSet film_features(Precision precision)
{
    if (tests_are_long()) return 0;
    return precision == PRECISION_CERTIFIED ? CERTIFIED_FEATURES : FEATURE_ALL;
}

RenderSettings film_settings(uint32_t width, uint32_t height, Precision precision)
{
    RenderSettings settings = settings_of_image(width, height, precision);
    settings.bounce_count = 5;
    settings.extra_features = film_features(precision);
    settings.shift_to_eye = true;
    return settings;
}

bool arithmetic_is_refused(Compute *compute, const RenderSettings *settings)
{
    const bool needs_double = settings->precision >= PRECISION_DOUBLE;
    if (needs_double && !compute_in_double(compute)->device->fp64) return false; // has no passport
    RenderSettings usual = *settings;
    usual.lanes = 0; // as test_passport, which fails where these are refused wrongly
    OwnedMessageList messages = {0};
    const bool is_refused = !arithmetic_suits(compute, &usual, &messages) && messages.count > 0;
    message_list_print(&messages, stderr);
    return is_refused;
}

void skip_if_refused(Compute *compute, const RenderSettings *settings)
{
    if (arithmetic_is_refused(compute, settings)) skip();
}

Film film_render(Compute *compute, const Scene *scene, const RenderSettings *settings, unsigned aovs)
{
    skip_if_refused(compute, settings);
    OwnedMessageList messages = {0};
    Renderer *renderer = renderer_open(compute, scene, settings, &messages);
    message_list_print(&messages, stderr);
    assert_non_null(renderer);
    Film film;
    assert_true(renderer_render_film(renderer, aovs, &film));
    renderer_close(renderer);
    return film;
}

Film film_cut(const Film *film, uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    Film cut = film_allocate(width, height, 0, 0);
    for (uint32_t row = 0; row < height; row++)
        memcpy(cut.color + 3 * (size_t)row * width, film->color + 3 * ((size_t)(y + row) * film->width + x),
               3 * width * sizeof *cut.color);
    return cut;
}

Film film_flipped(const Film *film)
{
    Film flipped = film_allocate(film->width, film->height, 0, 0);
    for (size_t pixel = 0; pixel < (size_t)film->width * film->height; pixel++) {
        size_t column = pixel % film->width, row_start = pixel - column;
        memcpy(flipped.color + 3 * pixel, film->color + 3 * (row_start + film->width - 1 - column),
               3 * sizeof *film->color);
    }
    return flipped;
}

static double value_at(const void *values, size_t i, LayerType type)
{
    return type == LAYER_TYPE_INTEGER ? ((const uint32_t *)values)[i] : ((const double *)values)[i];
}

static void layer_assert_same(const Film *film, const Film *expected, Layer layer, const char *what)
{
    const void *values = film->layers[layer], *wanted = expected->layers[layer];
    if (!values) return;
    assert_non_null(wanted);
    const LayerType type = layer_types[layer];
    const size_t components = film_components(film, layer), count = components * film_pixel_count(film);
    size_t differing = 0, first = 0;
    for (size_t i = count; i-- > 0;) {
        double value = value_at(values, i, type), other = value_at(wanted, i, type);
        if (value == other || (isnan(value) && isnan(other))) continue;
        differing++;
        first = i;
    }
    if (differing == 0) return;
    size_t pixel = first / components;
    fail_msg("%s: %s: %zu of %zu values differ, first at pixel %zu,%zu component %zu: %.9g, expected %.9g",
             what, layer_names[layer], differing, count, pixel % film->width, pixel / film->width,
             first % components, value_at(values, first, type), value_at(wanted, first, type));
}

void film_assert_same(const Film *film, const Film *expected, const char *what)
{
    assert_int_equal(film->width, expected->width);
    assert_int_equal(film->height, expected->height);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        layer_assert_same(film, expected, layer, what);
}

size_t film_count_faulty(const Film *film)
{
    size_t count = 0;
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        bool faulty = false;
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            faulty |= !isfinite(film->color[k]) || film->color[k] < 0;
            if (film->normal) faulty |= !isfinite(film->normal[k]);
            if (film->position) faulty |= !isfinite(film->position[k]);
        }
        if (film->t) faulty |= isnan(film->t[i]);
        count += faulty;
    }
    return count;
}
