// Images of Phong's highlights, from dull to a thousandth of a radian wide.
#include "host/base/array.h"
#include "host/verify/checks.h"
#include <math.h>

// Returns the point of the unit sphere where the highlight appears.
static Vector3 highlight_middle(Vector3 eye, Vector3 to_light)
{
    Vector3 middle = vector_normalize(vector_add(vector_normalize(eye), to_light));
    for (int i = 0; i < 60; i++) {
        Vector3 to_eye = vector_normalize(vector_subtract(eye, middle));
        middle = vector_normalize(vector_add(to_eye, to_light));
    }
    return middle;
}

void verify_highlights(VerifyRun *run)
{
    static const double powers[] = {0, 1, 10, 100, 1e3, 1e4, 1e5, 1e6};
    // the tier's bound, and the power up to which it holds; beyond it the normal's own rounding shows
    static const double bounds[] = {[TIER_B] = 2e-3, [TIER_C] = 1e-4, [TIER_D] = 1e-8};
    const double power_max = run->tier == TIER_B ? 1e4 : 1e6;
    const Vector3 eye = {0.4, -0.3, 5}, light_near_eye = {-0.3, -0.2, -1}, light_behind = {1, 0.1, 0.3};
    for (size_t k = 0; k < 2 * COUNT_OF(powers); k++) {
        const double power = powers[k / 2];
        const bool closely = k % 2;
        Scene *scene =
            verify_scene(run,
                         "lights:\n  - directional: {direction: [0, 0, 1]}\n"
                         "materials:\n  shiny: {diffuse: 0, specular: 1, ambient: 0, shininess: %.17g}\n"
                         "objects:\n  - sphere: {center: [0, 0, 0], radius: 1, material: shiny}\n",
                         power);
        // the whole sphere is lit from the side and partly behind, the close-up from next to the eye
        Vector3 direction = vector_normalize(closely ? light_near_eye : light_behind);
        scene->lights.items[0].direction = direction;
        const Vector3 center = {0, 0, 0};
        scene->camera = verify_camera(eye, center, 30);
        if (closely) {
            scene->camera.look_at = highlight_middle(eye, vector_scale(direction, -1));
            scene->camera.half_tangent = fmin(0.25, 0.6 / sqrt(power + 1));
        }
        Film image = verify_render(run, scene, false, 96, 96);
        Quad3 to_light = quad3_unit(quad3(verify_rounded_vector(run, vector_scale(direction, -1))));
        size_t seen = 0;
        double brightest = 0;
        for (size_t i = 0; i < film_pixel_count(&image); i++) {
            double value = image.color[3 * i];
            run->result->wrong += !(value >= 0 && value <= 1 + 0x1p-20); // a NaN is wrong
            seen += image.object[i] == 0;
            brightest = fmax(brightest, value);
            if (run->tier == TIER_A || image.object[i] != 0 || power > power_max) continue;
            Quad3 normal = quad3_unit(quad3(vector_from(image.normal + 3 * i)));
            Quad3 ray = quad3_unit(quad3(vector_from(image.ray + 3 * i)));
            Quad facing = quad3_dot(normal, to_light);
            // whether grazing light reaches the surface is for the shadow tests
            if (quad_absolute(facing) < 16 * verify_roundoff(run)) continue;
            Quad exact = reference_highlight(normal, to_light, quad3_scale(ray, -1), power);
            verify_record(run, (double)quad_absolute(value - exact), bounds[run->tier], "of 1");
        }
        // in the close-up the highlight is in the middle of the image
        run->result->wrong += seen == 0 || (closely && brightest < 0.99);
    }
}
