// Compares small images with the reference: reflection, refraction, total reflection and light through glass.
// run_tests: sanitize-long-only
#include "host/verify/reference_color.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

enum { PIXELS_MAX = 64 * 48, BLURRED_COUNT = 12, OPEN_AT_MOST = 10 };

static unsigned width = 48, height = 36; // of the images

// In units of roundoff: an error that needs no excuse, and the blur whose effect is one. Surfaces put the
// rays that leave them up to 40 u of the size of their numbers away.
#define PLAIN_ERROR 64
#define BLUR        64

typedef struct {
    const char *name, *text;
    unsigned bounce_count;
} Trial;

#define STAGE                                                                                                \
    "background: [0.25, 0.375, 0.5]\n"                                                                       \
    "ambient: [0.25, 0.25, 0.25]\n"                                                                          \
    "lights:\n"                                                                                              \
    "  - point: {position: [4, 8, 6], color: [0.75, 0.75, 0.5]}\n"                                           \
    "  - directional: {direction: [1, -2, -1], color: [0.25, 0.25, 0.5]}\n"                                  \
    "materials:\n"                                                                                           \
    "  tiles: {checker: {colors: [[1, 1, 1], [0.25, 0.125, 0]], size: 1}, diffuse: 0.75}\n"                  \
    "  red: {color: [1, 0.25, 0.125], diffuse: 0.75, specular: 0.25, shininess: 8}\n"                        \
    "  mirror: {color: [0.5, 0.5, 0.5], ambient: 0.25, diffuse: 0.25, specular: 0.5, shininess: 16, "        \
    "reflection: 0.75}\n"                                                                                    \
    "  glass: {color: [1, 1, 1], ambient: 0, diffuse: 0.125, specular: 0.25, reflection: 0.125, "            \
    "transmission: 0.75,"                                                                                    \
    " ior: 1.5}\n"                                                                                           \
    "  clear: {color: [1, 1, 1], ambient: 0.25, diffuse: 0.125, transmission: 0.875, ior: 1.5}\n"            \
    "  water: {color: [0.5, 1, 1], ambient: 0.25, diffuse: 0.125, transmission: 0.75, ior: 1.25}\n"

#define CAMERA "camera: {position: [0.5, 2.25, 6], look_at: [0, 1, 0], up: [0, 1, 0], fov: 40}\n"
#define FLOOR                                                                                                \
    "objects:\n"                                                                                             \
    "  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: tiles}\n"

static Trial trials[] = {
    {"mirror sphere",
     STAGE CAMERA FLOOR "  - sphere: {center: [0, 1, 0], radius: 1, material: mirror}\n"
                        "  - sphere: {center: [-1.5, 0.5, 1], radius: 0.5, material: red}\n",
     4},
    {"glass sphere",
     STAGE CAMERA FLOOR "  - sphere: {center: [0, 1, 0], radius: 1, material: glass}\n"
                        "  - sphere: {center: [1, 0.5, -2], radius: 0.5, material: red}\n",
     5},
    {"sphere in glass",
     STAGE CAMERA FLOOR "  - sphere: {center: [0, 1.25, 0], radius: 1.25, material: clear}\n"
                        "  - sphere: {center: [0, 1.25, 0], radius: 0.75, material: red}\n",
     4},
    {"bubble in glass",
     STAGE CAMERA FLOOR "  - sphere: {center: [0, 1.25, 0], radius: 1.25, material: clear}\n"
                        "  - sphere: {center: [0.25, 1.25, 0], radius: 0.5, material: water}\n",
     8},
    {"glass box",
     STAGE CAMERA FLOOR "  - box: {min: [-1, 0.125, -0.5], max: [1, 1.75, 0.75], material: clear}\n"
                        "  - sphere: {center: [0.5, 0.75, -2], radius: 0.75, material: red}\n",
     8},
    {"prism",
     STAGE CAMERA FLOOR
     "  - sphere: {center: [-0.5, 3, 0.5], radius: 0.75, material: red}\n"
     // From the front the slope behind reflects all upward.
     "  - triangle: {vertices: [[-1, 0.5, 1], [1, 0.5, 1], [1, 2, 1]], material: clear}\n"
     "  - triangle: {vertices: [[-1, 0.5, 1], [1, 2, 1], [-1, 2, 1]], material: clear}\n"
     "  - triangle: {vertices: [[-1, 2, 1], [1, 2, 1], [1, 2, -0.5]], material: clear}\n"
     "  - triangle: {vertices: [[-1, 2, 1], [1, 2, -0.5], [-1, 2, -0.5]], material: clear}\n"
     "  - triangle: {vertices: [[-1, 0.5, 1], [-1, 2, -0.5], [1, 2, -0.5]], material: clear}\n"
     "  - triangle: {vertices: [[-1, 0.5, 1], [1, 2, -0.5], [1, 0.5, 1]], material: clear}\n"
     "  - triangle: {vertices: [[-1, 0.5, 1], [-1, 2, 1], [-1, 2, -0.5]], material: clear}\n"
     "  - triangle: {vertices: [[1, 0.5, 1], [1, 2, -0.5], [1, 2, 1]], material: clear}\n",
     8},
    {"mirror in mirror",
     STAGE CAMERA FLOOR "  - plane: {point: [0, 0, -2], normal: [0, 0, 1], material: mirror}\n"
                        "  - plane: {point: [0, 0, 7], normal: [0, 0, 2], material: mirror}\n"
                        "  - sphere: {center: [-0.5, 0.75, 0], radius: 0.5, material: red}\n",
     16},
    {"glassware",
     STAGE CAMERA FLOOR
     "  - cylinder: {from: [-2, 0.25, 0], to: [-1.5, 1.75, 0.25], radius: 0.5, material: clear}\n"
     "  - cone: {from: [0, 0.25, 0.5], to: [0, 1.75, 0], radius: [0.75, 0.25], material: clear}\n"
     "  - torus: {center: [1.75, 1.25, 0], axis: [0, 0.5, 1], major: 0.75, minor: 0.25, material: water}\n"
     "  - disc: {center: [0.5, 2.5, 0], normal: [0, 0.25, 1], radius: 0.5, material: mirror}\n",
     6},
    // Listed before the floor, so that at the same distance the glass would go first.
    {"glass on the floor",
     STAGE CAMERA
     "objects:\n"
     "  - box: {min: [-1.5, 0, -0.5], max: [-0.25, 1, 0.75], material: clear}\n"
     "  - cylinder: {from: [0.75, 0, 0.5], to: [0.75, 1.25, 0.5], radius: 0.5, material: glass}\n"
     "  - cone: {from: [2, 0, 0], to: [2, 1.25, 0], radius: [0.5, 0.25], material: water}\n"
     "  - sphere: {center: [0.25, 0.5, 1.75], radius: 0.5, material: glass}\n"
     "  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: tiles}\n",
     6},
    // More than the bound on the error of the glass, less than twice that.
    {"glass just over the floor",
     STAGE CAMERA FLOOR "  - box: {min: [-1.5, 0.000003, -0.5], max: [-0.25, 1, 0.75], material: clear}\n"
                        "  - box: {min: [0.5, 0.000003, -1], max: [1.75, 1.5, 0], material: water}\n",
     6},
    {"glass on a mirror that is tilted",
     STAGE CAMERA "objects:\n"
                  "  - cylinder: {from: [-0.75, 0.75, 0], to: [-0.9375, 1.5, 0.75], radius: 0.5, "
                  "material: clear}\n"
                  "  - cone: {from: [0.25, 1, 0], to: [0.0625, 1.75, 0.75], radius: [0.375, 0.25], "
                  "material: water}\n"
                  "  - plane: {point: [-0.75, 0.75, 0], normal: [-0.1875, 0.75, 0.75], material: mirror}\n",
     6},
    {"glass between walls",
     STAGE CAMERA FLOOR "  - triangle: {vertices: [[-1, 0.5, 1], [1, 0.5, 1], [1, 2, 1]], material: clear}\n"
                        "  - triangle: {vertices: [[-1, 0.5, 1], [1, 2, 1], [-1, 2, 1]], material: clear}\n"
                        "  - box: {min: [-1, 0.5, 0], max: [0, 2, 1], material: red}\n"
                        "  - box: {min: [1, 0.5, -1], max: [2, 1.5, 0], material: clear}\n"
                        "  - box: {min: [1, 0.5, -2], max: [2, 1.75, -1], material: red}\n"
                        "  - box: {min: [2, 0.5, -1.5], max: [2.5, 2, 0.5], material: mirror}\n",
     6},
    {"eye in glass",
     STAGE "camera: {position: [0.25, 1.25, 0.5], look_at: [0, 0.5, -4], up: [0, 1, 0], fov: 60}\n" FLOOR
           "  - sphere: {center: [0, 1.25, 0], radius: 1, material: clear}\n"
           "  - sphere: {center: [0.5, 0.5, -4], radius: 0.75, material: red}\n",
     8},
};
enum { TRIAL_COUNT = COUNT_OF(trials) };

static double unit_roundoff(Precision precision)
{
    return precision == PRECISION_DOUBLE ? 0x1p-53 : 0x1p-24;
}

static double largest_difference(Color a, Color b)
{
    return error_max(fabs(a.x - b.x), error_max(fabs(a.y - b.y), fabs(a.z - b.z)));
}

static Color path_color(const Scene *scene, const ReferenceRay *ray, const ReferencePath *path)
{
    return reference_pixel(&(ReferenceScene){*scene, NULL}, ray, path, NULL).color;
}

// Returns how far the pixel's color moves if its rays move.
static double sensitivity(const Scene *scene, const ReferenceRay *ray, const Trial *trial, double u,
                          Color color)
{
    double largest = 0;
    for (uint64_t seed = 1; seed <= BLURRED_COUNT; seed++) {
        const ReferencePath path = {.bounce_count = trial->bounce_count, .blur = BLUR * u, .seed = seed};
        largest = error_max(largest, largest_difference(path_color(scene, ray, &path), color));
    }
    return largest;
}

static void compare(const Trial *trial, const Scene *scene, const Color *expected, Precision precision)
{
    if (!probe_has(precision)) return;
    RenderSettings settings = film_settings(width, height, precision);
    settings.bounce_count = trial->bounce_count;
    OwnedFilm film = film_render(&probe_compute, scene, &settings, 0);
    const double u = unit_roundoff(precision);
    size_t wrong = 0, open = 0;
    for (unsigned i = 0; i < width * height; i++) {
        Color seen = {film.color[3 * i], film.color[3 * i + 1], film.color[3 * i + 2]};
        double error = largest_difference(seen, expected[i]);
        if (error <= PLAIN_ERROR * u) continue;
        ReferenceRay ray = reference_camera_ray(&scene->camera, width, height, i % width, i / width);
        double excuse = sensitivity(scene, &ray, trial, u, expected[i]);
        // Here the result depends on the last bits.
        open += excuse > 0x1p-7;
        if (error <= PLAIN_ERROR * u + 2 * excuse) continue;
        if (wrong++ == 0)
            print_message(
                "%s, %s: pixel %u,%u is off by %g, of which %g is excused: %g %g %g, not %g %g %g\n",
                trial->name, precision_names[precision], i % width, i / width, error, excuse, seen.x, seen.y,
                seen.z, expected[i].x, expected[i].y, expected[i].z);
    }
    assert_int_equal(wrong, 0);
    assert_true(open < OPEN_AT_MOST);
}

static void shows_what_the_reference_shows(void **state)
{
    const Trial *trial = *state;
    OwnedScene scene = scene_of_text("bounces.yaml", trial->text);
    static Color expected[PIXELS_MAX];
    const ReferencePath path = {.bounce_count = trial->bounce_count};
    for (unsigned i = 0; i < width * height; i++) {
        ReferenceRay ray = reference_camera_ray(&scene.camera, width, height, i % width, i / width);
        expected[i] = path_color(&scene, &ray, &path);
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
    for (size_t i = 0; i < TRIAL_COUNT; i++)
        test_register(
            &(struct CMUnitTest){trials[i].name, shows_what_the_reference_shows, NULL, NULL, &trials[i]});
    return tests_run(argument_count, arguments, probe_open, probe_close);
}
