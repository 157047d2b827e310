// Counts the rays of the Standard Procedural Databases and compares them with the published numbers (Haines,
// Standard Procedural Databases 3.14, README, Database analysis), which all classical ray tracers should
// match within 10%. The test is skipped where the scenes are not there.
// run_tests: sanitize-long-only
#include "kernels/types.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

#define SPD "../shared/corpus/spd"

enum { EYE_HITS, REFLECTED, REFRACTED, SHADOW, COLUMN_COUNT };

static const char *const column_names[COLUMN_COUNT] = {"eye rays that hit", "reflected", "refracted",
                                                       "shadow"};
static const int column_rays[COLUMN_COUNT] = {RAYS_CAMERA_HITS, RAYS_REFLECTED, RAYS_REFRACTED, RAYS_SHADOW};

static const struct {
    const char *name;
    uint64_t rays[COLUMN_COUNT];
} published[] = {
    {"balls", {263169, 175095, 0, 954368}},      {"gears", {245086, 304643, 207564, 2246955}},
    {"mount", {173125, 354769, 354769, 412922}}, {"rings", {263169, 315236, 0, 1085002}},
    {"teapot", {161120, 225248, 0, 407656}},     {"tetra", {49788, 0, 0, 46112}},
    {"tree", {169836, 0, 0, 1097419}},
};

static bool band_ignore(void *context, const Film *band)
{
    (void)context;
    (void)band;
    return true;
}

// Makes what transmits reflect a little, without which glint sends no reflected ray. The published tracer
// always sends one (README, Testing procedures, 8), even from gears of glass with a Ks of 0, where it adds
// nothing.
static void glass_reflect(Scene *scene)
{
    for (size_t i = 0; i < scene->materials.count; i++) {
        Material *material = &scene->materials.items[i];
        if (material->transmission.largest > 0 && material->reflection.largest == 0)
            material->reflection.largest = 1e-6;
    }
}

// Counts rays, with 513 by 513 camera rays through the corners of 512 by 512 pixels. Ray trees are 5 deep,
// including the camera ray.
static void rays_count(const char *name, uint64_t counts[COLUMN_COUNT])
{
    OwnedScene scene = scene_of_file(formatted(SPD "/%s.nff", name));
    glass_reflect(&scene);
    scene.camera.half_tangent *= 513.0 / 512;
    RenderSettings settings = film_settings(513, 513, PRECISION_SINGLE);
    settings.bounce_count = 4;
    settings.counting = true;
    Renderer *renderer = probe_renderer(&scene, &settings);
    assert_true(renderer_render(renderer, 0, band_ignore, NULL));
    for (size_t i = 0; i < COLUMN_COUNT; i++)
        counts[i] = renderer_report(renderer)->rays[column_rays[i]];
    renderer_close(renderer);
}

TEST(counts)
{
    if (access(SPD, F_OK) != 0) {
        print_message("no " SPD ": skipped\n");
        skip();
    }
    size_t wrong_count = 0;
    for (size_t k = 0; k < COUNT_OF(published); k++) {
        uint64_t counts[COLUMN_COUNT];
        rays_count(published[k].name, counts);
        for (size_t i = 0; i < COLUMN_COUNT; i++) {
            double expected = (double)published[k].rays[i], off = (double)counts[i] - expected;
            print_message("%-8s%-19s%10lu%10lu%+7.1f%%\n", i ? "" : published[k].name, column_names[i],
                          (unsigned long)counts[i], (unsigned long)published[k].rays[i],
                          100 * off / fmax(expected, 1));
            wrong_count += fabs(off) > 0.1 * expected;
        }
    }
    assert_int_equal(wrong_count, 0);
}

TEST_MAIN(probe_open, probe_close)
