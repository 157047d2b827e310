// Renders images whose every value is known in closed form and that are not among the hard cases.
// run_tests: sanitize-long-only
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

static Scene scene_of(const char *text)
{
    return scene_of_text("image.yaml", text);
}

// The case that a failing check belongs to.
static char place[160];

#define check(condition)                                                                                     \
    do {                                                                                                     \
        if (!(condition)) fail_msg("%s: not so: %s (line %d)", place, #condition, __LINE__);                 \
    } while (0)

static Film render(const Scene *scene, uint32_t width, uint32_t height, Precision precision, unsigned aovs)
{
    RenderSettings settings = film_settings(width, height, precision);
    settings.extra_features = FEATURE_ALL; // one build for all of this file's scenes
    Film film = film_render(&probe_compute, scene, &settings, aovs);
    check(film_count_faulty(&film) == 0);
    return film;
}

typedef void (*Check)(Precision precision);

static void at_precision(Check run, Precision precision)
{
    snprintf(place, sizeof place, "%s", precision_names[precision]);
    run(precision);
}

static void at_each_precision(Check run)
{
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++)
        if (probe_has(precision)) at_precision(run, precision);
}

static void run_at_each_precision(void **state)
{
    at_each_precision(*(const Check *)*state);
}

#define TEST_AT_EACH_PRECISION(name)                                                                         \
    static void name(Precision precision);                                                                   \
    TEST_CASE(name, run_at_each_precision, &(Check){name})                                                   \
    static void name(Precision precision)

static bool near(double value, double expected, double tolerance)
{
    return fabs(value - expected) <= tolerance;
}

static Vector3 vector_at(const double *vectors, size_t pixel)
{
    const double *v = vectors + 3 * pixel;
    return (Vector3){v[0], v[1], v[2]};
}

// Returns the world position of what a pixel shows.
static Vector3 film_place(const Film *film, const Scene *scene, size_t pixel)
{
    return vector_add(vector_at(film->position, pixel), scene->camera.position);
}

// Float holds all numbers exactly, so that the answer is exact at every precision.
TEST_AT_EACH_PRECISION(background_and_ambient)
{
    OwnedScene scene =
        scene_of("camera: {position: [0, 0, -4], look_at: [0, 0, 0], fov: 90}\n"
                 "background: [0.125, 0.25, 2]\nambient: [0.5, 0.25, 1]\n"
                 "objects: [{sphere: {center: [0, 0, 0], radius: 1, material: {color: [0.5, 1, 0.25], "
                 "ambient: 0.75}}}]\n");
    OwnedFilm film = render(&scene, 31, 31, precision, AOV_OBJECT | AOV_T);
    size_t seen = 0;
    for (size_t i = 0; i < (size_t)31 * 31; i++) {
        const double *color = film.color + 3 * i;
        if (film.object[i] == UINT32_MAX) {
            check(isinf(film.t[i]));
            check(color[0] == 0.125 && color[1] == 0.25 && color[2] == 2);
        } else {
            seen++;
            check(film.object[i] == 0);
            check(color[0] == 0.5 * 0.75 * 0.5 && color[1] == 0.25 * 0.75 && color[2] == 0.75 * 0.25);
        }
    }
    // the sphere's outline has the half-angle asin(1/4): a circle of radius 15.5 tan(asin(1/4)) pixels
    double radius = 15.5 * 0.25 / sqrt(15.0 / 16);
    check(near((double)seen, M_PI * radius * radius, 4));
}

// A light straight above a plane, seen from above, gives kd C I N.L, and with ks the whole highlight in the
// middle.
TEST_AT_EACH_PRECISION(light_above_plane)
{
    OwnedScene scene =
        scene_of("camera: {position: [0, 2, 0], look_at: [0, 0, 0], up: [0, 0, 1], fov: 90}\n"
                 "lights: [{point: {position: [0, 4, 0], color: [1, 0.5, 0.25], intensity: 0.5}}]\n"
                 "objects: [{plane: {point: [0, 0, 0], normal: [0, 3, 0], material: {color: [0.5, 1, 0.5], "
                 "diffuse: [0.5, 0.25, 1]}}}]\n");
    OwnedFilm film = render(&scene, 33, 33, precision, AOV_POSITION);
    double tolerance = precision == PRECISION_DOUBLE ? 1e-14 : 3e-7;
    for (size_t i = 0; i < (size_t)33 * 33; i++) {
        Vector3 p = film_place(&film, &scene, i);
        // one pixel spans 4/33 on the plane
        check(near(fabs(p.x), fabs((double)(i % 33) - 16) * 4 / 33, 1e-5));
        check(near(p.y, 0, 1e-6));
        double facing = 4 / sqrt(16 + p.x * p.x + p.z * p.z);
        check(near(film.color[3 * i], 0.125 * facing, tolerance));
        check(near(film.color[3 * i + 1], 0.0625 * facing, tolerance));
        check(near(film.color[3 * i + 2], 0.0625 * facing, tolerance));
    }
    size_t middle = 16 * 33 + 16;
    check(film.color[3 * middle] == 0.125);

    scene.materials.items[scene.objects.items[0].material].specular.largest = 0.75;
    OwnedFilm shiny = render(&scene, 33, 33, precision, 0);
    check(near(shiny.color[3 * middle], 0.125 + 0.5 * 0.75, tolerance));
    check(near(shiny.color[3 * middle + 1], 0.0625 + 0.25 * 0.75, tolerance));
}

// A spot shines straight down on a plane from height 5. The cone of 30 degrees intersects it in a circle of
// radius 5 tan 30, full within 5 tan 20 if the penumbra is 10 degrees wide.
TEST_AT_EACH_PRECISION(spot_cone)
{
    OwnedScene scene =
        scene_of("camera: {position: [0.3, 6, -0.4], look_at: [0.2, 0, 0.1], up: [0, 0, 1], fov: 70}\n"
                 "lights: [{spot: {position: [0, 5, 0], look_at: [0, 0, 0], angle: 30, penumbra: 10}}]\n"
                 "objects: [{plane: {point: [0, 0, 0], normal: [0, 1, 0]}}]\n");
    const double outer = 5 * tan(M_PI / 6), inner = 5 * tan(M_PI / 9);
    const double versine_outer = 1 - cos(M_PI / 6), versine_inner = 1 - cos(M_PI / 9);
    OwnedFilm soft = render(&scene, 160, 160, precision, AOV_POSITION);
    scene.lights.items[0].spot.penumbra = 0;
    OwnedFilm hard = render(&scene, 160, 160, precision, AOV_POSITION);
    size_t between = 0;
    for (size_t i = 0; i < (size_t)160 * 160; i++) {
        Vector3 p = film_place(&soft, &scene, i);
        double distance = hypot(p.x, p.z), facing = 5 / hypot(5, distance);
        double x = (versine_outer - (1 - facing)) / (versine_outer - versine_inner);
        double strength = x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x);
        check(near(soft.color[3 * i], facing * strength, 2e-5));
        if (distance < inner * (1 - 1e-5)) check(near(soft.color[3 * i], facing, 1e-5));
        if (distance < outer * (1 - 1e-5)) check(near(hard.color[3 * i], facing, 1e-5));
        if (distance > outer * (1 + 1e-5)) check(soft.color[3 * i] == 0 && hard.color[3 * i] == 0);
        between += strength > 0 && strength < 1;
    }
    check(between > 1000);
}

// The eye and a light are inside a closed shape, all of which is seen and lit.
TEST_AT_EACH_PRECISION(inside)
{
    static const char *const shapes[] = {
        "sphere: {center: [0, 0, 0], radius: 2}",
        "box: {min: [-1.5, -1, -2], max: [1, 1.25, 1.5]}",
        "cylinder: {from: [-0.3, -2, 0.2], to: [0.4, 2, 0], radius: 1.5}",
        "cylinder: {point: [0, 0, 0], axis: [0.2, 1, 0.1], radius: 1.5}",
        "cone: {from: [0, -2, 0], to: [0.1, 3, 0.2], radius: [2, 0]}",
        "cone: {from: [0, -2, 0], to: [0.1, 3, 0.2], radius: [2, 1.5]}",
    };
    for (size_t i = 0; i < COUNT_OF(shapes); i++) {
        snprintf(place, sizeof place, "%s, inside %s", precision_names[precision], shapes[i]);
        OwnedScene scene =
            scene_of(formatted("camera: {position: [0.1, 0.2, 0.3], look_at: [1, -0.4, 0.5], fov: 100}\n"
                               "lights: [{point: {position: [-0.2, 0.1, -0.1]}}]\nobjects: [{%s}]\n",
                               shapes[i]));
        OwnedFilm film = render(&scene, 96, 96, precision, AOV_OBJECT | AOV_SHADOW);
        for (size_t pixel = 0; pixel < (size_t)96 * 96; pixel++) {
            check(film.object[pixel] == 0);
            check(film.shadow[pixel] == 0);
            check(film.color[3 * pixel] > 0);
        }
    }
}

// Returns whether a ray from the eye at (0, 1, 0) hits the surface y = -1e6 + sqrt((1e6 + slope x)^2 - z^2).
static bool hits_ground(const double *direction, double slope)
{
    const long double radius = 1e6L, above = 1e6L + 1;
    long double x = direction[0], y = direction[1], z = direction[2];
    long double a = y * y + z * z - slope * slope * x * x, b = above * y - radius * slope * x;
    return b < 0 && b * b >= a * (above * above - radius * radius);
}

// The horizon of ground that is a cylinder or a cone is within a row of the exact one in every column. Next
// to the side the plain discriminant tears it (S4 has the sphere's).
TEST_AT_EACH_PRECISION(ground_horizon)
{
    static const struct {
        const char *view;
        double slope;
    } grounds[] = {
        {"camera: {position: [0, 1, 0], look_at: [0, 1, 1], fov: 0.5}\n"
         "objects: [{cylinder: {from: [-1e6, -1e6, 0], to: [1e6, -1e6, 0], radius: 1e6}}]\n",
         0},
        {"camera: {position: [0, 1, 0], look_at: [0, 1, 1], fov: 0.5}\n"
         "objects: [{cone: {from: [-1e6, -1e6, 0], to: [1e6, -1e6, 0], radius: [1.25e6, 0.75e6]}}]\n",
         -0.25},
    };
    const uint32_t side = 256;
    for (size_t k = 0; k < COUNT_OF(grounds); k++) {
        OwnedScene scene = scene_of(grounds[k].view);
        OwnedFilm film = render(&scene, side, side, precision, AOV_OBJECT | AOV_RAY);
        for (uint32_t column = 0; column < side; column++) {
            uint32_t horizon = 0, exact = 0;
            while (horizon < side && film.object[horizon * side + column] == UINT32_MAX)
                horizon++;
            while (exact < side && !hits_ground(film.ray + 3 * (exact * side + column), grounds[k].slope))
                exact++;
            check(near(horizon, exact, 1));
            for (uint32_t row = horizon; row < side; row++)
                check(film.object[row * side + column] == 0);
        }
    }
}

// Between two parallel panes that reflect and transmit all light each hit adds the ambient light, 1/512, and
// leaves one pending ray to the background, which is also 1/512.
#define PANES                                                                                                \
    "camera: {position: [0, 0, 0], look_at: [0, 0, 1], up: [0, 1, 0], fov: 0.001}\n"                         \
    "background: [0.001953125, 0.001953125, 0.001953125]\n"                                                  \
    "ambient: [0.001953125, 0.001953125, 0.001953125]\n"                                                     \
    "materials: {pane: {color: [1, 1, 1], ambient: 1, diffuse: 0, reflection: 1%s}}\n"                       \
    "objects:\n"                                                                                             \
    "  - plane: {point: [0, 0, 1], normal: [0, 0, -1], material: pane}\n"                                    \
    "  - plane: {point: [0, 0, -1], normal: [0, 0, 1], material: pane}\n"

static uint64_t panes_render(bool transparent, Precision precision, uint32_t lanes, uint32_t bounces)
{
    OwnedScene scene = scene_of(formatted(PANES, transparent ? ", transmission: 1, ior: 1.5" : ""));
    RenderSettings settings = film_settings(5, 3, precision);
    settings.extra_features = 0;
    settings.lanes = lanes;
    settings.bounce_count = bounces;
    Renderer *renderer = probe_renderer(&scene, &settings);
    OwnedFilm film;
    check(renderer_render_film(renderer, 0, &film));
    const double expected = (transparent ? 2 * bounces + 1 : bounces + 1) / 512.0;
    for (size_t i = 0; i < 3 * film_pixel_count(&film); i++)
        check(near(film.color[i], expected, 0));
    uint64_t hash = renderer_report(renderer)->kernel_hash;
    renderer_close(renderer);
    return hash;
}

// A kernel keeps as many pending rays as the scene's depth needs, and none between mirrors.
static void depth_of_facing_panes(Precision precision)
{
    const uint64_t plain = panes_render(true, precision, 0, 5);
    check(panes_render(true, precision, 0, 8) == plain);
    check(panes_render(true, precision, 0, 9) != plain);
    panes_render(true, precision, 0, BOUNCES_MAX);
    panes_render(true, precision, 1, BOUNCES_MAX);
    check(panes_render(false, precision, 0, 5) == panes_render(false, precision, 0, BOUNCES_MAX));
}

TEST(facing_panes)
{
    if (tests_are_long())
        at_each_precision(depth_of_facing_panes);
    else
        at_precision(depth_of_facing_panes, PRECISION_SINGLE);
}

// The eye is the origin, so that the same scene 2^23 away has the same bits.
TEST(distance_from_origin_changes_nothing)
{
    Film films[2];
    for (size_t i = 0; i < 2; i++) {
        double far = i == 0 ? 0 : 0x1p23;
        snprintf(place, sizeof place, "moved by %g", far);
        OwnedScene scene = scene_of(
            formatted("camera: {position: [%.17g, 1.5, -4], look_at: [%.17g, 0.5, 0], fov: 45}\n"
                      "lights: [{point: {position: [%.17g, 5, -3]}}]\n"
                      "objects:\n  - sphere: {center: [%.17g, 0.75, 0.5], radius: 0.75}\n"
                      "  - plane: {point: [%.17g, 0, 0], normal: [0, 1, 0], material: {checker: {colors: "
                      "[[1, 1, 1], [0, 0, 0]], size: 0.5}}}\n",
                      far + 0.25, far + 0.25, far + 2, far + 0.5, far));
        films[i] = render(&scene, 64, 48, PRECISION_SINGLE, AOV_T | AOV_SHADOW | AOV_OBJECT);
    }
    film_assert_same(&films[1], &films[0], "2^23 from the origin");
    film_free(&films[0]);
    film_free(&films[1]);
}

// Plates so far away that both ends round to one point keep their form.
TEST_AT_EACH_PRECISION(plates_far_away)
{
    const char *const shapes[] = {"cylinder: {from: [0, 0, -2e7], to: [0, 0, -20000000.63], radius: 1e6}",
                                  "cone: {from: [0, 0, -2e7], to: [0, 0, -20000000.63], radius: [1e6, 9e5]}",
                                  ("cylinder: {from: [0, -2e7, -2e7], to: [0, -20000000.5, -20000000.5], "
                                   "radius: 1e6}")};
    for (size_t i = 0; i < COUNT_OF(shapes); i++) {
        OwnedScene scene = scene_of(formatted(
            "camera: {position: [0, 0, 0], look_at: [0, %d, -1], fov: 10}\nbackground: [0.25, 0.25, "
            "0.25]\nambient: [1, 1, 1]\nobjects:\n  - %s\n",
            i == 2 ? -1 : 0, shapes[i]));
        OwnedFilm film = render(&scene, 15, 15, precision, AOV_OBJECT);
        check(film.object[7 * 15 + 7] == 0);
        check(film.object[0] == UINT32_MAX && film.object[14 * 15 + 7] == UINT32_MAX);
    }
}

// A unit axis, and a unit direction across it.
static const Vector3 skew_axis = {2 / 7.0, -3 / 7.0, 6 / 7.0}, skew_across = {6 / 7.0, -2 / 7.0, -3 / 7.0};

// Returns a film of an object that lies in the direction of -skew_across and fills the view.
static Film render_next_to_eye(const char *object, Precision precision)
{
    OwnedScene scene = scene_of(formatted(
        "camera: {position: [0, 0, 0], look_at: [%.17g, %.17g, %.17g], fov: 40}\nobjects:\n  - %s\n",
        -skew_across.x, -skew_across.y, -skew_across.z, object));
    Film film = render(&scene, 32, 24, precision, AOV_POSITION | AOV_NORMAL | AOV_OBJECT);
    for (size_t i = 0; i < film_pixel_count(&film); i++)
        check(film.object[i] == 0);
    return film;
}

static void check_normal(const Film *film, size_t pixel, Vector3 outward, double u)
{
    const Vector3 normal = vector_at(film->normal, pixel), expected = vector_normalize(outward);
    check(vector_length(vector_subtract(normal, expected)) < 64 * u);
}

// A tube of radius r = 0.1 whose circle has the radius R = 10^6, seen from outside in its plane. Next to the
// eye the circle bends away from its tangent, at the distance s, by s^2 / 2 R. The turn s / R of its normals
// is left out.
TEST_AT_EACH_PRECISION(thin_torus_next_to_eye)
{
    const double major = 1e6, minor = 0.1, distance = 0.01,
                 u = precision == PRECISION_DOUBLE ? 1e-9 : 0x1p-24;
    const Vector3 center = vector_scale(skew_across, -(major + minor + distance)),
                  along = vector_cross(skew_axis, skew_across);
    OWNED char *object =
        text_format("torus: {center: [%.17g, %.17g, %.17g], axis: [2, -3, 6], major: 1e6, minor: 0.1}",
                    center.x, center.y, center.z);
    OwnedFilm film = render_next_to_eye(object, precision);
    for (size_t i = 0; i < film_pixel_count(&film); i++) {
        const Vector3 hit = vector_at(film.position, i);
        const double s = vector_dot(hit, along), height = vector_dot(hit, skew_axis),
                     away = vector_dot(hit, skew_across) + minor + distance + s * s / (2 * major);
        check(near(hypot(away, height), minor, 16 * u * minor));
        check_normal(&film, i, vector_add(vector_scale(skew_across, away), vector_scale(skew_axis, height)),
                     u);
    }
}

// Rays that leave a torus from a point on it do not hit it there. The first eye is on the outer equator. The
// second one is on the inner equator and sees the opposite side of the tube.
TEST_AT_EACH_PRECISION(torus_seen_from_its_surface)
{
    OwnedScene outside = scene_of("camera: {position: [3, 0, 0], look_at: [4, 0, 0], fov: 60}\n"
                                  "objects: [{torus: {center: [0, 0, 0], axis: [0, 1, 0], major: 2, "
                                  "minor: 1}}]\n");
    OwnedFilm nothing = render(&outside, 15, 15, precision, AOV_OBJECT);
    for (size_t i = 0; i < film_pixel_count(&nothing); i++)
        check(nothing.object[i] == UINT32_MAX);
    OwnedScene hole = scene_of("camera: {position: [1.5, 0, 0], look_at: [0, 0, 0], fov: 10}\n"
                               "objects: [{torus: {center: [0, 0, 0], axis: [0, 1, 0], major: 2, "
                               "minor: 0.5}}]\n");
    OwnedFilm opposite = render(&hole, 15, 15, precision, AOV_T);
    for (size_t i = 0; i < film_pixel_count(&opposite); i++)
        check(opposite.t[i] > 2.9 && opposite.t[i] < 3.1);
}

// A paraboloid with the focal length f, seen from outside at the height h = 10^6 above its apex, where its
// radius is 2 sqrt(f h).
static void check_deep_paraboloid(double distance, Precision precision)
{
    const double focal_length = 1e-6, height = 1e6, radius = 2,
                 u = precision == PRECISION_DOUBLE ? 1e-10 : 0x1p-24;
    const Vector3 foot = vector_scale(skew_across, -(radius + distance)),
                  apex = vector_subtract(foot, vector_scale(skew_axis, height));
    OWNED char *object = text_format(
        "paraboloid: {apex: [%.17g, %.17g, %.17g], axis: [2, -3, 6], focal_length: 1e-6, height: 2e6}",
        apex.x, apex.y, apex.z);
    OwnedFilm film = render_next_to_eye(object, precision);
    for (size_t i = 0; i < film_pixel_count(&film); i++) {
        const Vector3 from_foot = vector_subtract(vector_at(film.position, i), foot);
        const double above = vector_dot(from_foot, skew_axis);
        const Vector3 across = vector_subtract(from_foot, vector_scale(skew_axis, above));
        check(near(vector_length(across), 2 * sqrt(focal_length * (height + above)), 16 * u * radius));
        check_normal(&film, i, vector_subtract(across, vector_scale(skew_axis, 2 * focal_length)), u);
    }
}

TEST_AT_EACH_PRECISION(deep_paraboloid_next_to_eye)
{
    check_deep_paraboloid(0.01, precision);
    check_deep_paraboloid(1.5, precision);
}

TEST_MAIN(probe_open, probe_close)
