// Shapes far larger or smaller than their distance from the eye, which test the rounding of their numbers.
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/verify/checks.h"
#include <math.h>
#include <string.h>

// The eye is about this far above the origin, where every shape has a point of its surface.
static const Vector3 eye = {0.3, 1.75, 0.2};

// An object whose numbers are `start` + size `growth`. All are exact in double, but not in float.
typedef struct {
    const char *case_name;
    // Hit or miss of a flat shape is uncertain along the shape, of another shape around its tangents.
    bool is_flat;
    Object start, growth;
} SizedShape;

static const SizedShape shapes[] = {
    {"S7", false, {.type = SHAPE_SPHERE, .as.sphere.center = {0.1, 0, 0.1}}, {.as.sphere = {{0, -1, 0}, 1}}},
    {"P8", true, {.type = SHAPE_PLANE, .as.plane.normal = {1, 2, 3}}, {.as.plane.point = {2, -1, 0}}},
    {"P8",
     true,
     {.type = SHAPE_DISC, .as.disc.normal = {1, 2, 3}},
     {.as.disc = {.center = {2, -1, 0}, .radius = 3}}},
    // the rim is below the eye
    {"P8",
     false,
     {.type = SHAPE_DISC, .as.disc = {{0, 0, 0.1}, {0, 1, 0}, 0}},
     {.as.disc = {.center = {-1, 0, 0}, .radius = 1}}},
    {"P8", true, {.type = SHAPE_BOX}, {.as.box = {{-1, -2, -1}, {2, 0, 1}}}},
    {"C8",
     false,
     {.type = SHAPE_CYLINDER, .as.cylinder = {{0.1, 0, 0.1}, {3, 0, 4}, 0}},
     {.as.cylinder = {.from = {0, -1, 0}, .radius = 1}}},
    // the middle of the side is below the eye
    {"C8",
     false,
     {.type = SHAPE_CYLINDER, .as.cylinder = {.finite = true, .caps = true}},
     {.as.cylinder = {{-3, -1, -4}, {6, 0, 8}, 1}}},
    // an end is below the eye
    {"C8",
     true,
     {.type = SHAPE_CYLINDER, .as.cylinder = {.finite = true, .caps = true}},
     {.as.cylinder = {{0.5, 0, 0.25}, {0, -1, 0}, 1}}},
    // a plate, whose plane is below the eye; if it is large, both ends are rounded to one point
    {"C8",
     true,
     {.type = SHAPE_CYLINDER,
      .as.cylinder = {.axis = {0x1p-8, -3 * 0x1p-8, 0x1p-9}, .finite = true, .caps = true}},
     {.as.cylinder = {.from = {1.5, 0.5, 0}, .radius = 3}}},
    {"C8",
     false,
     {.type = SHAPE_CONE, .as.cone = {.from = {0.1, 0, 0.1}, .finite = true, .caps = true}},
     {.as.cone = {{0, -1, 0}, {3, 0, 4}, {1, 0.25}}}},
    // flat, with the eye beyond the tip
    {"C8",
     true,
     {.type = SHAPE_CONE, .as.cone = {.from = {0.1, 0, 0.1}, .finite = true, .caps = true}},
     {.as.cone = {.axis = {1, -2, 0.5}, .radius = {0, 7}}}},
    {"C8",
     false,
     {.type = SHAPE_CONE, .as.cone = {.from = {0, 0, 0.1}, .axis = {1, 0, 0}, .slope = 0.5}},
     {.as.cone.from = {-2, -1, 0}}},
    {"T7",
     false,
     {.type = SHAPE_TORUS, .as.torus = {.center = {0.1, 0, 0.1}, .axis = {3, 0, 4}}},
     {.as.torus = {.center = {0, -3, 0}, .major = 2, .minor = 1}}},
    {"Q4",
     false,
     {.type = SHAPE_PARABOLOID,
      .as.paraboloid = {.apex = {0.1, 0, 0}, .axis = {0, 0, 1}, .finite = true, .caps = true}},
     {.as.paraboloid = {.apex = {0, -2, -1}, .focal_length = 1, .height = 4}}},
    {"M7", true, {.type = SHAPE_TRIANGLE}, {.as.triangle.vertices = {{2, -1, 0}, {-3, 0, 1}, {1, 1, -1}}}},
};

// Checks a pixel against the object as the scene has it, whose numbers need not fit the precision at work:
// hit or miss, the hit's distance from the surface, and that light from above reaches the ground.
static void check_pixel(VerifyRun *run, const Object *object, double band, bool is_ground, const Film *image,
                        size_t pixel)
{
    const Quad3 direction = quad3(vector_from(&image->ray[3 * pixel]));
    const ReferenceRay ray = {quad3(eye), direction, 0, DBL_MAX};
    const ReferenceHit exact = reference_hit_object(object, &ray);
    const bool found = verify_pixel_found(image, pixel);
    if (exact.margin <= 16 * verify_roundoff(run) * band) return;
    run->result->wrong += found != exact.found;
    if (!found || !exact.found) return;
    const double distance = image->t[pixel] * (double)quad3_length(direction);
    const ReferenceSurface surface = reference_surface(object, reference_point(&ray, image->t[pixel]));
    const double off = (double)reference_surface_distance(&surface);
    verify_record_ulps(run, off, distance, 4);
    const bool is_lit = is_ground && exact.normal.y > (Quad)0.25 && distance < 8 * eye.y;
    run->result->wrong += is_lit && !(image->color[3 * pixel] > 0);
}

static void check_sizes(VerifyRun *run, const SizedShape *shape)
{
    Scene *scene = verify_scene(run, "lights:\n  - directional: {direction: [0, -1, 0]}\nobjects: []\n");
    const Material material = material_default();
    scene_add_object(scene, shape->start, &material);
    Object *object = &scene->objects.items[0];
    const int largest = QUAD_BITS - (verify_is_double(run) ? DBL_MANT_DIG : FLT_MANT_DIG) - 8;
    for (int exponent = -20; exponent <= (largest < 60 ? largest : 60); exponent += 8) {
        const double size = ldexp(0x8ccccccd, exponent - 31); // 1.1 in 32 bits
        const bool is_ground = exponent > 3;
        reference_grow_object(object, &shape->start, &shape->growth, size);
        const ReferenceSurface whole = reference_surface(object, quad3(eye));
        const Vector3 ahead = vector_add(eye, (Vector3){0.1, -1, 1});
        scene->camera = verify_camera(eye, is_ground ? ahead : whole.center,
                                      is_ground ? 100 : atan(size / eye.y) * (150 / M_PI));
        const double band = eye.y + (shape->is_flat ? size : sqrt(2 * eye.y * size));
        Film image = verify_render(run, scene, false, 32, 32);
        for (size_t pixel = 0; run->tier != TIER_A && pixel < film_pixel_count(&image); pixel++)
            check_pixel(run, object, band, is_ground, &image, pixel);
    }
}

void verify_sizes(VerifyRun *run)
{
    size_t shape_count = 0;
    for (size_t i = 0; i < COUNT_OF(shapes); i++) {
        if (strcmp(shapes[i].case_name, run->result->name) != 0) continue;
        check_sizes(run, &shapes[i]);
        shape_count++;
    }
    if (shape_count == 0) fault("case %s has no shape to resize", run->result->name);
}
