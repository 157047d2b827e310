// Shadows on which a faster search once went wrong.
#include "tests/frame.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

// A veil's light is taken once, also in a tile whose shadow rays run to different sides, which then search
// the hierarchy in several turns: the light hangs over the corner of a tile.
static void takes_a_veils_light_once(void **state)
{
    (void)state;
    Scene scene = scene_of_text(
        "veil.yaml", "camera: {position: [0, 9, 0.01], look_at: [0, 0, 0], up: [0, 0, 1], fov: 40}\n"
                     "background: [0, 0, 0]\n"
                     "lights: [{point: {position: [0.013, 5, 0.017]}}]\n"
                     "materials: {veil: {diffuse: 0, transmission: 0.5, ior: 1}}\n"
                     "objects:\n"
                     "  - box: {min: [-8, -1, -8], max: [8, 0, 8]}\n"
                     "  - disc: {center: [0, 2, 0], normal: [0, 1, 0], radius: 0.5, material: veil}\n"
                     "  - disc: {center: [0, 6, 0], normal: [0, 1, 0], radius: 0.001, material: veil}\n");
    RenderSettings settings = frame_settings(101, 101, PRECISION_STRICT);
    settings.lanes = 1;
    settings.bvh = BVH_OFF;
    Frame expected = frame_render(&probe_compute, &scene, &settings, 0);
    static const uint32_t lanes[] = {1, 4, 8, 16};
    for (size_t i = 0; i < sizeof lanes / sizeof *lanes; i++) {
        settings.lanes = lanes[i];
        for (BvhChoice bvh = BVH_ON; bvh <= BVH_OFF; bvh++) {
            settings.bvh = bvh;
            Frame frame = frame_render(&probe_compute, &scene, &settings, 0);
            frame_assert_same(&frame, &expected, bvh_choice_names[bvh]);
            frame_free(&frame);
        }
    }
    frame_free(&expected);
    scene_free(&scene);
}

// Squares of distances to the light times squares of sizes are beyond a float's range.
static void darkens_an_eclipse_in_meters(void **state)
{
    (void)state;
    Scene scene = scene_of_text(
        "eclipse.yaml", "camera: {position: [1.4998e11, 0, -3e7], look_at: [1.4998e11, 0, 0], fov: 60}\n"
                        "background: [0, 0, 0]\n"
                        "lights: [{point: {position: [0, 0, 0]}}]\n"
                        "objects:\n"
                        "  - sphere: {center: [1.496e11, 0, 0], radius: 2e7}\n"
                        "  - sphere: {center: [1.4998e11, 0, 0], radius: 1e7}\n");
    for (Precision precision = PRECISION_FAST; precision <= PRECISION_STRICT; precision++) {
        RenderSettings settings = frame_settings(64, 64, precision);
        Frame frame = frame_render(&probe_compute, &scene, &settings, AOV_OBJECT | AOV_SHADOW);
        size_t seen = 0, lit = 0;
        for (size_t i = 0; i < (size_t)frame.width * frame.height; i++) {
            if (frame.object[i] == UINT32_MAX) continue;
            seen++;
            lit += frame.shadow[i] == 0;
        }
        assert_true(seen > 500);
        assert_int_equal(lit, 0);
        frame_free(&frame);
    }
    scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(takes_a_veils_light_once),
        cmocka_unit_test(darkens_an_eclipse_in_meters),
    };
    return cmocka_run_group_tests(tests, probe_open, probe_close);
}
