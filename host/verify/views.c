// Images by cameras with extreme or incomplete numbers.
#include "host/base/array.h"
#include "host/verify/run.h"
#include <math.h>

enum { SIDE = 65 };

static Scene *tiled_scene(VerifyRun *run, Vector3 place)
{
    Scene *scene =
        verify_scene(run, "ambient: [1, 1, 1]\nbackground: [0.2, 0.3, 0.4]\n"
                          "lights:\n  - directional: {direction: [0.3, -1, 0.2]}\n"
                          "materials:\n"
                          "  tiles: {checker: {colors: [[1, 1, 1], [0.5, 0.5, 0.5]], size: 1}, diffuse: 0}\n"
                          "objects:\n  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: tiles}\n"
                          "  - sphere: {center: [0, 0, 0], radius: 0.5}\n");
    scene->objects.items[0].as.plane.point = place;
    scene->objects.items[1].as.sphere.center = place;
    return scene;
}

static Film view_render(VerifyRun *run, Vector3 place, Vector3 eye, Vector3 look_at, Vector3 up, double fov)
{
    Scene *scene = tiled_scene(run, place);
    scene->camera = verify_camera(eye, look_at, fov);
    scene->camera.up = up;
    return verify_render(run, scene, false, SIDE, SIDE);
}

static void check_same(VerifyRun *run, const Film *a, const Film *b)
{
    for (size_t i = 0; i < film_pixel_count(a); i++) {
        run->result->differing += a->object[i] != b->object[i] || a->t[i] != b->t[i];
        run->result->differing +=
            !vectors_equal(vector_from(&a->color[3 * i]), vector_from(&b->color[3 * i]));
    }
}

// Checks that the world axis least aligned with the view replaces an `up` that is zero or parallel to it.
static void check_views_without_up(VerifyRun *run)
{
    static const struct {
        Vector3 eye, look_at, axis;
    } views[] = {{{0.3, 5, 0.4}, {0.3, 0, 0.4}, {1, 0, 0}}, {{2, 4, 6}, {0, 0, 0}, {1, 0, 0}}};
    const Vector3 here = {0, 0, 0};
    for (size_t k = 0; k < COUNT_OF(views); k++) {
        Vector3 toward = vector_subtract(views[k].look_at, views[k].eye);
        Film expected = view_render(run, here, views[k].eye, views[k].look_at, views[k].axis, 40);
        const Vector3 ups[] = {toward, vector_scale(toward, -0.5), {0, 0, 0}};
        for (size_t i = 0; i < COUNT_OF(ups); i++) {
            Film image = view_render(run, here, views[k].eye, views[k].look_at, ups[i], 40);
            check_same(run, &image, &expected);
        }
        if (k == 0) {
            // an `up` that is nearly parallel to the view is valid
            Film image = view_render(run, here, views[k].eye, views[k].look_at, (Vector3){1e-7, 1, 0}, 40);
            check_same(run, &image, &expected);
        }
    }
}

// Checks a view straight down on the tiles, where each pixel must have the color of its tile.
static void check_tiles(VerifyRun *run)
{
    const Vector3 here = {0, 0, 0}, eye = {0.3, 5, 0.4}, below = {0.3, 0, 0.4}, up = {0, 1, 0};
    Film image = view_render(run, here, eye, below, up, 60);
    size_t counts[2] = {0};
    for (size_t i = 0; i < film_pixel_count(&image); i++) {
        if (image.object[i] != 0) continue;
        const double *d = image.ray + 3 * i;
        double x = eye.x - eye.y * d[0] / d[1], z = eye.z - eye.y * d[2] / d[1];
        if (fmin(fabs(x - round(x)), fabs(z - round(z))) < 1e-5) continue;
        bool even = fmod(floor(x) + floor(z), 2) == 0, white = image.color[3 * i] > 0.75;
        // which color comes first is up to the plane
        counts[white == even]++;
    }
    run->result->wrong += counts[0] < counts[1] ? counts[0] : counts[1];
    run->result->wrong += counts[0] + counts[1] == 0;
}

// Checks fields of view from nearly 0 to nearly 180 degrees, a view far from the origin, and a single pixel.
static void check_extremes(VerifyRun *run)
{
    const Vector3 here = {0, 0, 0}, far = {1e7, -1e7, 2e7}, up = {0, 1, 0}, eye = {2, 4, 6};
    static const double fovs[] = {1e-3, 179.9};
    const size_t middle = (SIDE * SIDE - 1) / 2;
    for (size_t i = 0; i < COUNT_OF(fovs); i++) {
        Film image = view_render(run, here, eye, here, up, fovs[i]);
        run->result->wrong += image.object[middle] != 1 || !(image.color[3 * middle] > 0);
    }
    Film near = view_render(run, here, eye, here, up, 40);
    Film away = view_render(run, far, vector_add(far, eye), far, up, 40);
    for (size_t i = 0; i < film_pixel_count(&near); i++)
        run->result->differing += near.object[i] != away.object[i] || near.t[i] != away.t[i];
    Scene *scene = tiled_scene(run, here);
    scene->camera = verify_camera(eye, here, 40);
    Film one = verify_render(run, scene, true, 1, 1);
    run->result->wrong += one.object[0] != 1 || !(one.color[0] > 0);
}

void verify_degenerate_views(VerifyRun *run)
{
    check_views_without_up(run);
    check_tiles(run);
    check_extremes(run);
}
