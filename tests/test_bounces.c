// Compares small images of the scenes in tests/exact_scenes.txt with the reference, which tests/oracle.sh
// checks for the same scenes in exact arithmetic.
// run_tests: sanitize-long-only
#include "host/verify/reference_shading.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

enum { PIXELS_MAX = 64 * 48, LIGHTS_MAX = 3, BLURRED_COUNT = 12, OPEN_AT_MOST = 10 };

static unsigned width = 48, height = 36; // of the images

// In units of roundoff: an error that needs no excuse, and the blur whose effect is one. Surfaces put the
// rays that leave them up to 40 u of the size of their numbers away.
#define PLAIN_ERROR 64
#define BLUR        64

static double unit_roundoff(Precision precision)
{
    return precision == PRECISION_DOUBLE ? 0x1p-53 : 0x1p-24;
}

// What a pixel shows. At a miss, t and the normal are 0.
typedef struct {
    Color color, normal;
    double t;
    uint32_t object;
    bool shadows[LIGHTS_MAX];
} Shown;

static Shown reference_shown(const Scene *scene, const ReferenceRay *ray, const ReferencePath *path)
{
    Shown shown = {.t = 0};
    const ReferencePixel pixel = reference_pixel(&(ReferenceScene){*scene, NULL}, ray, path, shown.shadows);
    shown.color = pixel.color;
    shown.object = pixel.object;
    if (pixel.object == UINT32_MAX) return shown;
    // reference_pixel turns the ray by the first random numbers
    ReferenceRay turned = *ray;
    const Quad length = quad3_length(ray->direction);
    const Quad3 turn = random_offset(&(Random){path->seed}, path->blur * (double)length);
    turned.direction = quad3_add(ray->direction, turn);
    const ReferenceHit hit = reference_hit_object(&scene->objects.items[pixel.object], &turned);
    shown.t = (double)(hit.t * length);
    shown.normal = quad3_rounded(hit.shading_normal);
    return shown;
}

static Shown film_shown(const Film *film, size_t pixel)
{
    Shown shown = {vector_from(film->color + 3 * pixel), .object = film->object[pixel]};
    if (shown.object == UINT32_MAX) return shown;
    shown.t = film->t[pixel];
    shown.normal = vector_from(film->normal + 3 * pixel);
    for (uint32_t i = 0; i < film->light_count; i++)
        shown.shadows[i] = film->shadow[pixel * film->light_count + i] != 0;
    return shown;
}

static double color_difference(Color a, Color b)
{
    return error_max(fabs(a.x - b.x), error_max(fabs(a.y - b.y), fabs(a.z - b.z)));
}

// Returns the largest difference of a number, that of t relative to t, or 1 if more than numbers differs.
static double largest_difference(const Shown *a, const Shown *b)
{
    if (a->object != b->object || memcmp(a->shadows, b->shadows, sizeof a->shadows) != 0) return 1;
    const double far = b->t > 0 ? fabs(a->t - b->t) / b->t : 0;
    return error_max(far,
                     error_max(color_difference(a->color, b->color), color_difference(a->normal, b->normal)));
}

// Returns how far what the pixel shows moves if its rays move.
static double sensitivity(const Scene *scene, const ReferenceRay *ray, const ExactScene *trial, double u,
                          const Shown *expected)
{
    double largest = 0;
    for (uint64_t seed = 1; seed <= BLURRED_COUNT; seed++) {
        const ReferencePath path = {.bounce_count = trial->bounce_count, .blur = BLUR * u, .seed = seed};
        const Shown moved = reference_shown(scene, ray, &path);
        largest = error_max(largest, largest_difference(&moved, expected));
    }
    return largest;
}

static void shown_print(const char *what, const Shown *shown)
{
    print_message("%s: object %d, shadows %d%d%d, t %.9g, normal %.9g %.9g %.9g, color %.9g %.9g %.9g\n",
                  what, (int)shown->object, shown->shadows[0], shown->shadows[1], shown->shadows[2], shown->t,
                  shown->normal.x, shown->normal.y, shown->normal.z, shown->color.x, shown->color.y,
                  shown->color.z);
}

static void compare(const ExactScene *trial, const Scene *scene, const Shown *expected, Precision precision)
{
    if (!probe_has(precision)) return;
    RenderSettings settings = film_settings(width, height, precision);
    settings.bounce_count = trial->bounce_count;
    OwnedFilm film =
        film_render(&probe_compute, scene, &settings, AOV_T | AOV_NORMAL | AOV_OBJECT | AOV_SHADOW);
    const double u = unit_roundoff(precision);
    size_t wrong = 0, open = 0;
    for (unsigned i = 0; i < width * height; i++) {
        const Shown seen = film_shown(&film, i);
        double error = largest_difference(&seen, &expected[i]);
        if (error <= PLAIN_ERROR * u) continue;
        ReferenceRay ray = reference_camera_ray(&scene->camera, width, height, i % width, i / width);
        double excuse = sensitivity(scene, &ray, trial, u, &expected[i]);
        // Here the result depends on the last bits.
        open += excuse > 0x1p-7;
        if (error <= PLAIN_ERROR * u + 2 * excuse) continue;
        if (wrong++ > 0) continue;
        print_message("%s, %s: pixel %u,%u is off by %g, of which %g is excused\n", trial->name,
                      precision_names[precision], i % width, i / width, error, excuse);
        shown_print("seen", &seen);
        shown_print("expected", &expected[i]);
    }
    assert_int_equal(wrong, 0);
    assert_true(open < OPEN_AT_MOST);
}

static void shows_what_the_reference_shows(void **state)
{
    const ExactScene *trial = *state;
    OwnedScene scene = scene_of_text("bounces.yaml", text_c(&trial->text));
    assert_true(scene.lights.count <= LIGHTS_MAX);
    static Shown expected[PIXELS_MAX];
    const ReferencePath path = {.bounce_count = trial->bounce_count};
    for (unsigned i = 0; i < width * height; i++) {
        ReferenceRay ray = reference_camera_ray(&scene.camera, width, height, i % width, i / width);
        expected[i] = reference_shown(&scene, &ray, &path);
    }
    for (Precision precision = PRECISION_SINGLE; precision < ARITHMETIC_COUNT; precision++)
        compare(trial, &scene, expected, precision);
}

int main(int argument_count, char **arguments)
{
    if (tests_are_long()) {
        width = 64;
        height = 48;
    }
    static ExactScene trials[EXACT_SCENES_MAX];
    const size_t trial_count = exact_scenes_read(trials);
    for (size_t i = 0; i < trial_count; i++)
        test_register(
            &(struct CMUnitTest){trials[i].name, shows_what_the_reference_shows, NULL, NULL, &trials[i]});
    return tests_run(argument_count, arguments, probe_open, probe_close);
}
