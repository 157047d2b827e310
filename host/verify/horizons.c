// Images of ground up to its horizon.
#include "host/base/array.h"
#include "host/verify/checks.h"
#include <math.h>

// Returns the first row from the bottom whose pixel in the column hits nothing; counts hits above as wrong.
static uint32_t column_horizon(VerifyRun *run, const Film *image, uint32_t column)
{
    uint32_t row = image->height;
    while (row > 0 && verify_pixel_found(image, (size_t)(row - 1) * image->width + column))
        row--;
    for (uint32_t above = 0; above < row; above++)
        run->result->wrong += verify_pixel_found(image, (size_t)above * image->width + column);
    return row;
}

// Checks that the ground's distance never decreases from the bottom up to the horizon, and that the horizon
// is where the exact one is.
void verify_ground_horizon(VerifyRun *run)
{
    static const struct {
        double fov;  // in degrees
        double rise; // slope of the view direction; the horizon's is -sqrt(2e-6)
    } views[] = {{60, 0}, {0.5, 0}, {0.02, -0.0014142}};
    Scene *scene = verify_scene(run, "objects:\n  - sphere: {center: [0, -1e6, 0], radius: 1e6}\n");
    const Vector3 eye = {0, 1, 0};
    for (size_t k = 0; k < COUNT_OF(views); k++) {
        scene->camera = verify_camera(eye, (Vector3){0, 1 + views[k].rise, 1}, views[k].fov);
        Film image = verify_render(run, scene, false, 128, 512);
        VerifyTarget ground = verify_target(run, &scene->objects.items[0], eye);
        for (uint32_t column = 0; column < image.width; column++) {
            uint32_t horizon = column_horizon(run, &image, column), exact = image.height;
            for (uint32_t row = image.height - 1; row > horizon; row--) {
                size_t pixel = (size_t)row * image.width + column;
                run->result->wrong += image.t[pixel - image.width] < image.t[pixel];
            }
            while (exact > 0) {
                size_t pixel = (size_t)(exact - 1) * image.width + column;
                if (!verify_pixel_hit(&ground, &image, pixel).found) break;
                exact--;
            }
            verify_record(run, fabs((double)horizon - (double)exact), 1, "rows");
        }
    }
}

// Checks that a plane seen horizontally ends at the image's middle in every column, whether the middle lies
// on a row of pixels or between two.
void verify_plane_horizon(VerifyRun *run)
{
    Scene *scene = verify_scene(run, "objects:\n  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n");
    const Vector3 eye = {0, 1.7, 0}, ahead = {0, 1.7, 1};
    scene->camera = verify_camera(eye, ahead, 60);
    for (uint32_t height = 511; height <= 512; height++) {
        Film image = verify_render(run, scene, false, 512, height);
        for (uint32_t column = 0; column < image.width; column++)
            run->result->wrong += column_horizon(run, &image, column) != (height + 1) / 2;
    }
}
