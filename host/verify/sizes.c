// Shapes far larger or smaller than their distance from the eye, which test the rounding of their numbers.
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/verify/checks.h"
#include <math.h>
#include <string.h>

// The eye is about this far above the origin, where every shape has a point of its surface.
static const Vector3 eye = {0.3, 1.75, 0.2};

typedef struct {
    const char *case_name;
    const char *text; // of the object
    // Sets the object's numbers for a size. All are exact in double, but not in float.
    void (*resize)(Object *object, double size);
    // Hit or miss of a flat shape is uncertain along the shape, of another shape around its tangents.
    bool is_flat;
} SizedShape;

static void sphere_resize(Object *object, double size)
{
    object->as.sphere.center = (Vector3){0.1, -size, 0.1};
    object->as.sphere.radius = size;
}

static void plane_resize(Object *object, double size)
{
    object->as.plane.point = (Vector3){2 * size, -size, 0};
}

static void disc_resize(Object *object, double size)
{
    object->as.disc.center = (Vector3){2 * size, -size, 0};
    object->as.disc.radius = 3 * size;
}

static void rim_resize(Object *object, double size)
{
    object->as.disc.center = (Vector3){-size, 0, 0.1};
    object->as.disc.radius = size;
}

static void box_resize(Object *object, double size)
{
    object->as.box.min = (Vector3){-size, -2 * size, -size};
    object->as.box.max = (Vector3){2 * size, 0, size};
}

static void cylinder_resize(Object *object, double size)
{
    object->as.cylinder.from = (Vector3){0.1, -size, 0.1};
    object->as.cylinder.radius = size;
}

// Places an end of the cylinder below the eye.
static void end_resize(Object *object, double size)
{
    object->as.cylinder.from = (Vector3){size / 2, 0, size / 4};
    object->as.cylinder.axis = (Vector3){0, -size, 0};
    object->as.cylinder.radius = size;
}

// Places the middle of the side below the eye.
static void tilted_cylinder_resize(Object *object, double size)
{
    object->as.cylinder.from = (Vector3){-3 * size, -size, -4 * size};
    object->as.cylinder.axis = (Vector3){6 * size, 0, 8 * size};
    object->as.cylinder.radius = size;
}

static void cone_resize(Object *object, double size)
{
    object->as.cone.from = (Vector3){0.1, -size, 0.1};
    object->as.cone.axis = (Vector3){3 * size, 0, 4 * size};
    object->as.cone.radius[0] = size;
    object->as.cone.radius[1] = size / 4;
}

static void infinite_cone_resize(Object *object, double size)
{
    object->as.cone.from = (Vector3){-2 * size, -size, 0.1};
    object->as.cone.slope = 0.5;
}

// Makes a flat cone, with the eye beyond its tip.
static void flat_cone_resize(Object *object, double size)
{
    object->as.cone.from = (Vector3){0.1, 0, 0.1};
    object->as.cone.axis = (Vector3){size, -2 * size, size / 2};
    object->as.cone.radius[0] = 0;
    object->as.cone.radius[1] = 7 * size;
}

// Places the plate's plane below the eye. If the plate is large, both ends are rounded to one point.
static void plate_resize(Object *object, double size)
{
    object->as.cylinder.from = (Vector3){1.5 * size, size / 2, 0};
    object->as.cylinder.axis = (Vector3){0x1p-8, -3 * 0x1p-8, 0x1p-9};
    object->as.cylinder.radius = 3 * size;
}

static void paraboloid_resize(Object *object, double size)
{
    object->as.paraboloid.apex = (Vector3){0.1, -2 * size, -size};
    object->as.paraboloid.focal_length = size;
    object->as.paraboloid.height = 4 * size;
}

// Places the outside of the tube below the eye.
static void torus_resize(Object *object, double size)
{
    object->as.torus.center = (Vector3){0.1, -3 * size, 0.1};
    object->as.torus.major = 2 * size;
    object->as.torus.minor = size;
}

static void triangle_resize(Object *object, double size)
{
    object->as.triangle.vertices[0] = (Vector3){2 * size, -size, 0};
    object->as.triangle.vertices[1] = (Vector3){-3 * size, 0, size};
    object->as.triangle.vertices[2] = (Vector3){size, size, -size};
}

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
    verify_record_error(run, off / verify_ulp(run, distance), 4);
    const bool is_lit = is_ground && exact.normal.y > (Quad)0.25 && distance < 8 * eye.y;
    run->result->wrong += is_lit && !(image->color[3 * pixel] > 0);
}

static void check_sizes(VerifyRun *run, const SizedShape *shape)
{
    Scene scene = verify_scene(shape->text);
    Object *object = &scene.objects.items[0];
    const int largest = QUAD_BITS - (verify_is_double(run) ? DBL_MANT_DIG : FLT_MANT_DIG) - 8;
    for (int exponent = -20; exponent <= (largest < 60 ? largest : 60); exponent += 8) {
        const double size = ldexp(0x8ccccccd, exponent - 31); // 1.1 in 32 bits
        const bool is_ground = exponent > 3;
        shape->resize(object, size);
        const ReferenceSurface whole = reference_surface(object, quad3(eye));
        const Vector3 ahead = vector_add(eye, (Vector3){0.1, -1, 1});
        scene.camera = verify_camera(eye, is_ground ? ahead : whole.center,
                                     is_ground ? 100 : atan(size / eye.y) * (150 / M_PI));
        const double band = eye.y + (shape->is_flat ? size : sqrt(2 * eye.y * size));
        Film image = verify_render(run, &scene, false, 32, 32);
        for (size_t pixel = 0; run->tier != TIER_A && pixel < film_pixel_count(&image); pixel++)
            check_pixel(run, object, band, is_ground, &image, pixel);
        film_free(&image);
    }
    scene_free(&scene);
}

#define LIGHT_ABOVE "lights:\n  - directional: {direction: [0, -1, 0]}\nobjects:\n  - "

static const SizedShape shapes[] = {
    {"S7", LIGHT_ABOVE "sphere: {center: [0, 0, 0], radius: 1}\n", sphere_resize, false},
    {"P8", LIGHT_ABOVE "plane: {point: [0, 0, 0], normal: [1, 2, 3]}\n", plane_resize, true},
    {"P8", LIGHT_ABOVE "disc: {center: [0, 0, 0], normal: [1, 2, 3], radius: 1}\n", disc_resize, true},
    {"P8", LIGHT_ABOVE "disc: {center: [0, 0, 0], normal: [0, 1, 0], radius: 1}\n", rim_resize, false},
    {"P8", LIGHT_ABOVE "box: {min: [-1, -1, -1], max: [1, 1, 1]}\n", box_resize, true},
    {"C8", LIGHT_ABOVE "cylinder: {point: [0, 0, 0], axis: [3, 0, 4], radius: 1}\n", cylinder_resize, false},
    {"C8", LIGHT_ABOVE "cylinder: {from: [0, 0, 0], to: [3, 0, 4], radius: 1}\n", tilted_cylinder_resize,
     false},
    {"C8", LIGHT_ABOVE "cylinder: {from: [0, 0, 0], to: [0, -1, 0], radius: 1}\n", end_resize, true},
    {"C8", LIGHT_ABOVE "cylinder: {from: [0, 0, 0], to: [0, -1, 0], radius: 1}\n", plate_resize, true},
    {"C8", LIGHT_ABOVE "cone: {from: [0, 0, 0], to: [3, 0, 4], radius: [1, 2]}\n", cone_resize, false},
    {"C8", LIGHT_ABOVE "cone: {from: [0, 0, 0], to: [0, -1, 0], radius: [0, 1]}\n", flat_cone_resize, true},
    {"C8", LIGHT_ABOVE "cone: {apex: [0, 0, 0], axis: [1, 0, 0], angle: 1}\n", infinite_cone_resize, false},
    {"T7", LIGHT_ABOVE "torus: {center: [0, 0, 0], axis: [3, 0, 4], major: 2, minor: 1}\n", torus_resize,
     false},
    {"Q4", LIGHT_ABOVE "paraboloid: {apex: [0, 0, 0], axis: [0, 0, 1], focal_length: 1, height: 1}\n",
     paraboloid_resize, false},
    {"M7", LIGHT_ABOVE "triangle: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}\n", triangle_resize, true},
};

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
