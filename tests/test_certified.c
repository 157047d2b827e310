// Images at `certified` of scenes that nearly touch the rays of pixels: spheres and boxes that rays graze,
// edges of triangles and rims of discs through pixels' centers, faces that all but coincide, shadows of all
// of them. Each object, shadow and path must be the reference's, where `single` errs.
// run_tests: sanitize-long-only
#include "host/base/array.h"
#include "host/compile/random_shape.h"
#include "host/verify/certify.h"
#include "tests/film.h"
#include "tests/probe.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static Random random_state;

enum { WIDTH = 48, HEIGHT = 36, OBJECTS = 120, AOVS = AOV_OBJECT | AOV_SHADOW | AOV_PATH };

static const double half_tangent = 0.75, floor_y = -3;
static const Vector3 eye = {0.1, -0.7, 3.3}, light = {2, 9, 1};

static Vector3 random_pixel_direction(void)
{
    const double unit = half_tangent / WIDTH, column = (double)(random_bits(&random_state) % WIDTH),
                 row = (double)(random_bits(&random_state) % HEIGHT);
    return (Vector3){(2 * column + 1 - WIDTH) * unit, (HEIGHT - 1 - 2 * row) * unit, -1};
}

// Of a length, by 2^-20 to 2^-36 of it: within single's reach, not double's.
static double nudge(double value)
{
    const double part = random_power(&random_state, -10.8, -6);
    return value * (1 + (random_coin(&random_state) ? part : -part));
}

static Vector3 vector_nudge(Vector3 v)
{
    return (Vector3){nudge(v.x), nudge(v.y), nudge(v.z)};
}

// A point on a pixel's ray, or on the way to the light from where that ray meets the floor.
static Vector3 point_in_view(Vector3 *along)
{
    Vector3 direction = random_pixel_direction();
    const double t = random_between(&random_state, 1.5, 9);
    *along = direction;
    if (random_coin(&random_state) || direction.y > -0.1) return vector_add(eye, vector_scale(direction, t));
    Vector3 seen = vector_add(eye, vector_scale(direction, (floor_y - eye.y) / direction.y));
    *along = vector_subtract(light, seen);
    return vector_add(seen, vector_scale(*along, random_between(&random_state, 0.05, 0.9)));
}

static Object object_in_view(size_t index)
{
    Vector3 along;
    const Vector3 point = point_in_view(&along);
    const Vector3 aside = vector_normalize(vector_cross(along, random_unit_vector(&random_state)));
    const double size = random_power(&random_state, -1.5, -0.4);
    const Vector3 center = vector_add(point, vector_scale(aside, size));
    switch (index % 5) {
    case 0:
        return (Object){.kind = SHAPE_SPHERE, .as.sphere = {vector_nudge(center), nudge(size), false}};
    case 1: { // an edge through the point
        const Vector3 way = vector_scale(random_unit_vector(&random_state), size);
        return (Object){.kind = SHAPE_TRIANGLE,
                        .as.triangle.vertices = {vector_nudge(vector_add(point, way)),
                                                 vector_nudge(vector_subtract(point, way)),
                                                 vector_nudge(vector_add(center, way))}};
    }
    case 2: // a triangle seen nearly edge-on
        return (Object){.kind = SHAPE_TRIANGLE,
                        .as.triangle.vertices = {
                            vector_nudge(point), vector_nudge(vector_add(point, vector_scale(along, size))),
                            vector_nudge(vector_add(center, vector_scale(along, 0.5 * size)))}};
    case 3: { // a rim through the point
        const Vector3 normal = vector_cross(aside, random_unit_vector(&random_state));
        return (Object){.kind = SHAPE_DISC, .as.disc = {vector_nudge(center), normal, nudge(size)}};
    }
    default: // a corner at the point, whose edges the ray meets
        return (Object){
            .kind = SHAPE_BOX,
            .as.box = {vector_nudge(point), vector_add(point, (Vector3){size, 0.5 * size, size})}};
    }
}

static Scene scene_attacking(void)
{
    Scene scene = {.camera = {.position = eye,
                              .look_at = {eye.x, eye.y, eye.z - 1},
                              .up = {0, 1, 0},
                              .field_axis = FIELD_HORIZONTAL,
                              .half_tangent = half_tangent}};
    Material material = material_default();
    array_push(scene.materials, material);
    array_push(scene.lights, ((Light){.kind = LIGHT_POINT, .color = {0.5, 0.4, 0.3}, .position = light}));
    for (size_t i = 0; i < OBJECTS; i++) {
        Object object = object_in_view(i);
        if (object.kind == SHAPE_BOX && !(object.as.box.min.x < object.as.box.max.x)) continue;
        array_push(scene.objects, object);
    }
    array_push(scene.objects, ((Object){.kind = SHAPE_PLANE, .as.plane = {{0, floor_y, 0}, {0, 1, 0}}}));
    return scene;
}

typedef struct {
    size_t wrong;
    uint64_t undecided;
} Answer;

static Answer answer(const Scene *scene, const CertifySample *reference, const RenderSettings *settings)
{
    Renderer *renderer = probe_renderer(scene, settings);
    assert_non_null(renderer);
    Film film;
    assert_true(renderer_render_film(renderer, AOVS, &film));
    const CertifyErrors errors = certify_compare(reference, &film);
    const Answer counted = {errors.object + errors.shadow + errors.path,
                            renderer_report(renderer)->repeats.undecided};
    film_free(&film);
    renderer_close(renderer);
    return counted;
}

static void decisions_are_those_of_exact_arithmetic(void **state)
{
    (void)state;
    if (!probe_compute.device->fp64) skip();
    const size_t scene_count = tests_are_long() ? 200 : 3;
    size_t single_wrong = 0, compared = 0;
    for (size_t i = 0; i < scene_count; i++) {
        random_state.state = i + 1;
        Scene scene = scene_attacking();
        CertifySample reference;
        assert_true(certify_sample_open(&reference, &scene, WIDTH, HEIGHT, WIDTH * HEIGHT, 0, NULL));
        RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
        settings.extra_features = FEATURE_BVH; // the same kernels without it
        settings.bounce_count = 0;
        single_wrong += answer(&scene, &reference, &settings).wrong;
        settings.precision = PRECISION_CERTIFIED;
        for (unsigned run = 0; run < 3; run++) {
            settings.bvh = run == 1 ? BVH_OFF : BVH_ON;
            settings.perturb_seed = run == 2 ? 1 + (uint32_t)i : 0;
            if (run == 2 && !tests_are_long()) continue; // each seed takes three more kernels
            const Answer certified = answer(&scene, &reference, &settings);
            if (certified.wrong > certified.undecided)
                fail_msg("scene %zu, run %u: %zu pixels are wrong, %llu samples undecided", i, run,
                         certified.wrong, (unsigned long long)certified.undecided);
            assert_true(certified.undecided <= WIDTH * HEIGHT / 50);
        }
        compared += reference.count;
        certify_sample_close(&reference);
        scene_free(&scene);
    }
    print_message("%zu pixels, of which single has %zu wrong\n", compared, single_wrong);
    assert_true(single_wrong >= scene_count);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(decisions_are_those_of_exact_arithmetic)};
    return cmocka_run_group_tests(tests, probe_open, probe_close);
}
