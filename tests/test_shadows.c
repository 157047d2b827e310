// Tests shadows that faster traversals, or surfaces much larger than the objects on them, once got wrong.
// run_tests: sanitize-long-only
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/reference.h"
#include "tests/scene_reading.h"

// A veil's light is taken once, even in a tile whose shadow rays run to different sides and so traverse the
// BVH in several packets, since the light is above the corner of a tile.
TEST(takes_a_veils_light_once)
{
    OwnedScene scene = scene_of_text(
        "veil.yaml", "camera: {position: [0, 9, 0.01], look_at: [0, 0, 0], up: [0, 0, 1], fov: 40}\n"
                     "background: [0, 0, 0]\n"
                     "lights: [{point: {position: [0.013, 5, 0.017]}}]\n"
                     "materials: {veil: {diffuse: 0, transmission: 0.5, ior: 1}}\n"
                     "objects:\n"
                     "  - box: {min: [-8, -1, -8], max: [8, 0, 8]}\n"
                     "  - disc: {center: [0, 2, 0], normal: [0, 1, 0], radius: 0.5, material: veil}\n"
                     "  - disc: {center: [0, 6, 0], normal: [0, 1, 0], radius: 0.001, material: veil}\n");
    RenderSettings settings = film_settings(101, 101, PRECISION_STRICT);
    settings.lanes = 1;
    settings.bvh = BVH_OFF;
    OwnedFilm expected = film_render(&probe_compute, &scene, &settings, 0);
    for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
        settings.lanes = *lanes;
        for (BvhChoice bvh = BVH_ON; bvh <= BVH_OFF; bvh++) {
            settings.bvh = bvh;
            OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
            film_assert_same(&film, &expected, bvh_choice_names[bvh]);
        }
    }
}

// A filter's blocked channels stay black, whether it is tested before or after another transparent object.
TEST(blocked_channels_stay_black_in_any_order)
{
    for (int filter = 0; filter < 2; filter++) {
        OwnedScene scene = scene_of_text(
            "filter.yaml",
            formatted("camera: {position: [0, 9, 0.01], look_at: [0, 0, 0], up: [0, 0, 1], fov: 5}\n"
                      "background: [0, 0, 0]\nambient: [0, 0, 0]\n"
                      "lights: [{point: {position: [3, 6, 0], color: [16, 16, 16]}}]\n"
                      "materials:\n"
                      "  filter: {diffuse: 0, transmission: [1, 0, 0.5], ior: 1}\n"
                      "  clear: {diffuse: 0, transmission: 0.5, ior: 1}\n"
                      "objects:\n"
                      "  - box: {min: [-8, -1, -8], max: [8, 0, 8]}\n"
                      "  - disc: {center: [1.5, 3, 0], normal: [0, 1, 0], radius: 1, material: %s}\n"
                      "  - disc: {center: [2, 4, 0], normal: [0, 1, 0], radius: 1, material: %s}\n",
                      filter == 0 ? "filter" : "clear", filter == 1 ? "filter" : "clear"));
        RenderSettings settings = film_settings(8, 8, PRECISION_SINGLE);
        settings.bvh = BVH_OFF;
        OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
        for (size_t i = 0; i < film_pixel_count(&film); i++) {
            assert_true(film.color[3 * i] > 0 && film.color[3 * i + 2] > 0);
            assert_true(film.color[3 * i + 1] == 0);
        }
    }
}

// Squares of distances to the light times squares of sizes are beyond a float's range.
TEST(darkens_an_eclipse_in_meters)
{
    OwnedScene scene = scene_of_text(
        "eclipse.yaml", "camera: {position: [1.4998e11, 0, -3e7], look_at: [1.4998e11, 0, 0], fov: 60}\n"
                        "background: [0, 0, 0]\n"
                        "lights: [{point: {position: [0, 0, 0]}}]\n"
                        "objects:\n"
                        "  - sphere: {center: [1.496e11, 0, 0], radius: 2e7}\n"
                        "  - sphere: {center: [1.4998e11, 0, 0], radius: 1e7}\n");
    for (Precision precision = PRECISION_SINGLE; precision <= PRECISION_STRICT; precision++) {
        RenderSettings settings = film_settings(64, 64, precision);
        OwnedFilm film = film_render(&probe_compute, &scene, &settings, AOV_OBJECT | AOV_SHADOW);
        size_t seen = 0, lit = 0;
        for (size_t i = 0; i < (size_t)film.width * film.height; i++) {
            if (film.object[i] == UINT32_MAX) continue;
            seen++;
            lit += film.shadow[i] == 0;
        }
        assert_true(seen > 500);
        assert_int_equal(lit, 0);
    }
}

// Returns a ball of 12 x 8 quadrilaterals with the normals of a sphere.
static Mesh coarse_ball(void)
{
    enum { ROUND = 12, HIGH = 8 };
    const double pi = 3.14159265358979323846;
    Mesh mesh = {.vertices = memory_allocate(ROUND * (HIGH + 1), sizeof *mesh.vertices),
                 .normals = memory_allocate(ROUND * (HIGH + 1), sizeof *mesh.normals),
                 .triangles = memory_allocate(2 * ROUND * HIGH, sizeof *mesh.triangles)};
    for (uint32_t row = 0; row <= HIGH; row++)
        for (uint32_t column = 0; column < ROUND; column++) {
            const double down = pi * row / HIGH, round = 2 * pi * column / ROUND;
            const Vector3 at = {sin(down) * cos(round), cos(down), sin(down) * sin(round)};
            mesh.normals[mesh.vertex_count] = mesh.vertices[mesh.vertex_count] = at;
            const uint32_t here = (uint32_t)mesh.vertex_count++, next = row * ROUND + (column + 1) % ROUND;
            if (row == 0) continue;
            const uint32_t parts[2][3] = {{here, here - ROUND, next}, {next, here - ROUND, next - ROUND}};
            memcpy(mesh.triangles[mesh.triangle_count], parts, sizeof parts);
            mesh.triangle_count += 2;
        }
    return mesh;
}

// The flat triangles of a smooth ball do not shade it where its normals face the light. Only a small ball
// near it does.
TEST(smooth_meshes_do_not_shade_themselves)
{
    for (Precision precision = PRECISION_SINGLE; precision <= PRECISION_STRICT; precision++) {
        OwnedScene scene =
            scene_of_text("ball.yaml", "camera: {position: [0, 0.6, 4.2], look_at: [0, 0, 0], fov: 32}\n"
                                       "lights: [{directional: {direction: [-1, -0.25, 0.15]}}]\n"
                                       "objects: [{sphere: {center: [1.5, 0.5, 0], radius: 0.35}}]\n");
        array_push(scene.meshes, coarse_ball());
        array_push(scene.objects, ((Object){.type = SHAPE_MESH}));
        const RenderSettings settings = film_settings(160, 120, precision);
        OwnedFilm film = film_render(&probe_compute, &scene, &settings, AOV_NORMAL | AOV_SHADOW | AOV_OBJECT);
        const Vector3 to_light = vector_normalize((Vector3){1, 0.25, -0.15});
        size_t lit = 0, dark = 0;
        for (size_t i = 0; i < (size_t)film.width * film.height; i++) {
            if (film.object[i] == UINT32_MAX || film.object[i] == 0) continue;
            const Vector3 normal = {film.normal[3 * i], film.normal[3 * i + 1], film.normal[3 * i + 2]};
            if (vector_dot(normal, to_light) < 1e-4) continue;
            lit += film.shadow[i] == 0;
            dark += film.shadow[i] != 0;
        }
        assert_true(lit >= 2000 && lit <= 5000);
        assert_true(dark >= 20 && dark <= 100); // by the small ball
    }
}

// The features of the grounds below. A kernel with injected errors and every feature takes four times as
// long to build.
#define GROUND_FEATURES                                                                                      \
    (FEATURE_SPHERES | FEATURE_PLANES | FEATURE_DISCS | FEATURE_CYLINDERS | FEATURE_CONES |                  \
     FEATURE_TRIANGLES | FEATURE_POINT_LIGHTS | FEATURE_DIRECTIONAL_LIGHTS)

// Compares the image with the reference, except for pixels at an edge. At `single`, also compares an image
// with injected errors.
static void compare_with_reference(const Scene *scene, RenderSettings settings, double error,
                                   const char *what)
{
    OwnedFilm film = film_render(&probe_compute, scene, &settings, AOV_T | AOV_SHADOW), perturbed = {0};
    settings.perturb_seed = 1;
    if (!tests_are_long()) settings.extra_features = GROUND_FEATURES;
    if (settings.precision == PRECISION_SINGLE) perturbed = film_render(&probe_compute, scene, &settings, 0);
    unsigned open = 0, dark = 0;
    for (unsigned i = 0; i < film.width * film.height; i++) {
        unsigned x = i % film.width, y = i / film.width;
        ReferenceRay ray = reference_camera_ray(&scene->camera, film.width, film.height, x, y);
        ReferenceColor expected = reference_color(scene, &ray);
        bool at_edge = isfinite(film.t[i]) && expected.margin <= 0x1p-16 * film.t[i];
        const Film *films[] = {&film, &perturbed};
        for (unsigned k = 0; k < 2 && films[k]->color && !at_edge; k++) {
            double seen = films[k]->color[3 * (size_t)i];
            if (!(fabs(seen - expected.color.x) <= error))
                fail_msg("%s, %s%s: pixel %u,%u is %g, not %g", what, precision_names[settings.precision],
                         k == 1 ? " with injected errors" : "", x, y, seen, expected.color.x);
        }
        open += at_edge;
        dark += !at_edge && film.shadow[3 * (size_t)i] == 1;
    }
    assert_true(open <= film.width * film.height / 10);
    assert_true(dark > 20);
}

// Ground whose coordinates are a million times the size of the objects on it. Floats there are 0.5 apart.
typedef struct {
    const char *name, *shape;
    Precision from; // expected from this precision on
    double error;   // of a color
} Ground;

#define COLOR_ERROR 0x1p-17
// where a float's rounding puts places centimeters aside along the ground
#define ASIDE_ERROR 0x1p-10

static const Ground grounds[] = {
    {"planet", "sphere: {center: [0, -4194304, 0], radius: 4194304}", PRECISION_SINGLE, COLOR_ERROR},
    {"hollow planet", "sphere: {center: [0, 4194304, 0], radius: 4194304}", PRECISION_SINGLE, COLOR_ERROR},
    {"cylinder", "cylinder: {point: [0, -4194304, 0], axis: [0, 0, 1], radius: 4194304}", PRECISION_STRICT,
     COLOR_ERROR},
    {"cone", "cone: {from: [0, -4194304, -4194304], to: [0, -4194304, 4194304], radius: [4177920, 4210688]}",
     PRECISION_STRICT, COLOR_ERROR},
    {"disc", "disc: {center: [-2097152, 65536, 0], normal: [1, 32, 0], radius: 4194304}", PRECISION_STRICT,
     COLOR_ERROR},
    {"triangle", "triangle: {vertices: [[-4194304, 0, 4194304], [-4194304, 0, -4194304], [4194304, 0, 0]]}",
     PRECISION_STRICT, COLOR_ERROR},
    {"large triangle", "triangle: {vertices: [[-32768, 0, 32768], [-32768, 0, -32768], [32768, 0, 0]]}",
     PRECISION_SINGLE, ASIDE_ERROR},
    {"plane by a far point", "plane: {point: [4194304, 0, -4194304], normal: [0, 0.5, 0]}", PRECISION_SINGLE,
     COLOR_ERROR},
};

// Marbles of a centimeter keep their shadows, and the ground does not shadow itself under a sun a twentieth
// of a degree high.
static void keeps_small_shadows_on(const Ground *ground)
{
    OwnedScene scene = scene_of_text(
        "ground.yaml", formatted("camera: {position: [0, 2, 0], look_at: [0, 1, 2], fov: 60}\n"
                                 "lights:\n"
                                 "  - directional: {direction: [0.5, -0.75, 0.5], intensity: 0.5}\n"
                                 "  - directional: {direction: [-1, -0.001, 0.25], intensity: 0.5}\n"
                                 "  - point: {position: [1, 4, 1], intensity: 0.5}\n"
                                 "objects:\n"
                                 "  - %s\n"
                                 "  - sphere: {center: [-0.25, 0.0625, 2], radius: 0.01}\n"
                                 "  - sphere: {center: [0.25, 0.0625, 2.5], radius: 0.03125}\n"
                                 "  - sphere: {center: [0, 0.25, 4], radius: 0.25}\n",
                                 ground->shape));
    for (Precision precision = ground->from; precision < ARITHMETIC_COUNT; precision++) {
        if (precision < probe_sound_from() || !probe_has(precision)) continue;
        compare_with_reference(&scene, film_settings(128, 96, precision), ground->error, ground->name);
    }
}

TEST(keeps_small_shadows_on_huge_ground)
{
    if (!probe_has(probe_sound_from())) skip();
    for (size_t i = 0; i < COUNT_OF(grounds); i++)
        keeps_small_shadows_on(&grounds[i]);
}

TEST_MAIN(probe_open, probe_close)
