// Compares the reference itself with roots known by hand or from certified interval arithmetic.
#include "host/base/ulp.h"
#include "host/compile/camera_basis.h"
#include "host/verify/certify.h"
#include "tests/check.h"
#include "tests/random_ray.h"
#include "tests/reference.h"
#include "tests/scene_reading.h"

#define MISS NAN

typedef struct {
    const char *name;
    Object object;
    Vector3 origin, direction;
    double t; // MISS: none
} Known;

static Object sphere(Vector3 center, double radius)
{
    return (Object){.type = SHAPE_SPHERE, .as.sphere = {center, radius, false}};
}

static Object cylinder(Vector3 from, Vector3 axis, double radius, bool finite, bool caps)
{
    return (Object){.type = SHAPE_CYLINDER, .as.cylinder = {from, axis, radius, finite, caps, false}};
}

static Object frustum(double first, double second, bool caps)
{
    return (Object){.type = SHAPE_CONE,
                    .as.cone = {{0, 0, 0}, {0, 0, 2}, {first, second}, 0, true, caps, false}};
}

static Object infinite_cone(double slope)
{
    return (Object){.type = SHAPE_CONE, .as.cone = {.axis = {0, 0, 1}, .slope = slope}};
}

static Object triangle(double side)
{
    return (Object){.type = SHAPE_TRIANGLE, .as.triangle.vertices = {{0, 0, 0}, {side, 0, 0}, {0, side, 0}}};
}

static void check(const Known *known, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        Object object = reference_round_object(&known[i].object);
        ReferenceRay ray = reference_ray_rounded(known[i].origin, known[i].direction);
        ReferenceHit hit = reference_hit_object(&object, &ray);
        double t = hit.found ? (double)hit.t : MISS;
        bool right = isnan(known[i].t) ? !hit.found : fabs(t - known[i].t) <= 2e-13 * known[i].t;
        if (!right) fail_msg("%s, row %zu: t = %.17g, not %.17g", known[i].name, i, t, known[i].t);
        if (!hit.found) continue;
        Quad3 n = hit.normal;
        assert_true(fabs((double)(n.x * n.x + n.y * n.y + n.z * n.z - 1)) < 1e-28);
        assert_true(n.x * ray.direction.x + n.y * ray.direction.y + n.z * ray.direction.z <= 0);
    }
}

TEST(knows_spheres)
{
    const Object unit = sphere((Vector3){0, 0, 0}, 1), tiny = sphere((Vector3){0.3, 0.2, 5}, 1e-4);
    const Object ground = sphere((Vector3){0, -1e6, 0}, 1e6);
    const Vector3 z = {0, 0, 1}, zero = {0, 0, 0}, eye = {0, 1, 0};
    const Known known[] = {
        {"far", unit, {0.6, 0, -100}, z, 100 - 0.7999999821186064},
        {"far", unit, {0.6, 0, -1e6}, z, 1e6 - 0.7999999821186064},
        {"tiny", tiny, zero, {0.3, 0.2, 5}, 0.9999800517985821},
        {"tiny", tiny, zero, {0.3 + 9.9e-5, 0.2, 5}, 0.9999957319126598},
        {"tiny", tiny, zero, {0.3 + 1.01e-4, 0.2, 5}, MISS},
        {"ground", ground, eye, {0, -1, 0}, 1},
        {"ground", ground, eye, {sqrt(0.75), -0.5, 0}, 2.0000030000089},
        {"ground", ground, eye, {sqrt(1 - 0.00141 * 0.00141), -0.00141, 0}, MISS},
        {"tangent", unit, {1 - 0x1p-20, 0, -5}, z, 4.9986189323973},
        {"tangent", unit, {1 - 0x1p-24, 0, -5}, z, 4.9996547330221},
        {"tangent", unit, {1 + 0x1p-23, 0, -5}, z, MISS},
        {"inside", unit, {0.5, 0, 0}, {1, 0, 0}, 0.5},
        {"inside", unit, {0.999999, 0, 0}, {1, 0, 0}, 1.0132789611816e-6},
        {"inside", unit, {0.999999, 0, 0}, {0, 1, 0}, 0.0014235718793335},
        {"on it", unit, {0, 0, -1}, z, 2},
        {"on it", unit, {0, 0, 1}, z, MISS},
        {"behind", unit, {0, 0, 5}, z, MISS},
    };
    check(known, COUNT_OF(known));
}

TEST(sees_only_insides)
{
    Object ball = sphere((Vector3){0, 0, 0}, 1),
           tube = cylinder((Vector3){0, 0, -1}, (Vector3){0, 0, 2}, 1, true, false);
    Object cup = frustum(1, 0.5, false);
    ball.as.sphere.only_inside = tube.as.cylinder.only_inside = cup.as.cone.only_inside = true;
    const Vector3 x = {1, 0, 0};
    const Known known[] = {
        {"ball", ball, {-5, 0, 0}, x, 6},   {"ball", ball, {0, 0, 0}, x, 1},
        {"ball", ball, {1, 0, 0}, x, MISS}, {"tube", tube, {-5, 0, 0}, x, 6},
        {"tube", tube, {0, 0, 0}, x, 1},    {"tube", tube, {-5, 0, 2}, x, MISS},
        {"cup", cup, {-5, 0, 1}, x, 5.75},  {"cup", cup, {0, 0, 1}, x, 0.75},
    };
    check(known, COUNT_OF(known));
}

TEST(knows_flat_shapes)
{
    const Object plane = {.type = SHAPE_PLANE, .as.plane = {{0, 0, 0}, {0, 1, 0}}};
    const Object disc = {.type = SHAPE_DISC, .as.disc = {{0, 0, 2}, {0, 0, 3}, 0.5}};
    const Object box = {.type = SHAPE_BOX, .as.box = {{-1, -1, -1}, {1, 1, 1}}};
    const Object plate = {.type = SHAPE_BOX, .as.box = {{0, 0, 0}, {1, 1, 1e-6}}};
    const Vector3 z = {0, 0, 1};
    const Known known[] = {
        {"horizon", plane, {0, 1.7, 0}, {0, -0x1p-1, 1}, 1.7000000476837158 * 0x1p1},
        {"horizon", plane, {0, 1.7, 0}, {0, -0x1p-23, 1}, 14260634},
        {"horizon", plane, {0, 1.7, 0}, {0, 0x1p-23, 1}, MISS},
        {"horizon", plane, {0, 1.7, 0}, {0, 0, 1}, MISS},
        {"horizon", plane, {0, 1.7, 0}, {0, -0.0, 1}, MISS},
        {"disc", disc, {0.5, 0, 0}, z, 2},
        {"disc", disc, {0.5 + 0x1p-20, 0, 0}, z, MISS},
        {"disc", disc, {0, 0, 2}, {1, 0, 0}, MISS},
        {"face", box, {1, 0, -5}, z, 4},
        {"face", box, {-1, -1, -5}, {-0.0, -0.0, 1}, 4},
        {"face", box, {1 + 0x1p-23, 0, -5}, z, MISS},
        {"face", box, {1, 0, 0}, z, 1},
        {"inside", box, {0.25, 0, 0}, {1, 0, 0}, 0.75},
        {"plate", plate, {0.5, 0.5, 10}, {0, 0, -1}, 9.999999000000002},
        {"triangle", triangle(2e-4), {2e-4 / 3, 2e-4 / 3, -1}, z, 1},
        {"triangle", triangle(0x1p40), {0x1p40 / 3, 0x1p40 / 3, -0x1p40}, z, 0x1p40},
        {"triangle", triangle(1), {0.5, 0.51, -1}, z, MISS},
    };
    check(known, COUNT_OF(known));
}

TEST(knows_cylinders)
{
    const Vector3 zero = {0, 0, 0}, x = {1, 0, 0}, z = {0, 0, 1};
    const Object infinite = cylinder(zero, z, 1, false, false);
    const Object capped = cylinder(zero, (Vector3){0, 0, 2}, 1, true, true);
    const Object open = cylinder(zero, (Vector3){0, 0, 2}, 1, true, false);
    const Object wire = cylinder((Vector3){-1e4, 0, 0}, (Vector3){2e4, 0, 0}, 1e-3, true, true);
    const Known known[] = {
        {"parallel", infinite, {0.5, 0, -3}, z, MISS},
        {"parallel", infinite, {2, 0, -3}, z, MISS},
        {"parallel", capped, {0.5, 0, -3}, z, 3},
        {"parallel", capped, {0.5, 0, 1}, z, 1},
        {"parallel", capped, {2, 0, -3}, z, MISS},
        {"parallel", open, {0.5, 0, -3}, z, MISS},
        {"through the opening", open, {0, 0, -1}, {0.5, 0, 1}, 2},
        {"past the end", capped, {-5, 0, 2.25}, x, MISS},
        {"nearly parallel", infinite, zero, {0x1p-20, 0, 1}, 0x1p20},
        {"nearly parallel", infinite, {0.25, 0, 0}, {0x1p-10, 0, 1}, 768},
        {"wire", wire, {0, 5e-4, -10}, z, 9.9991339745551},
        {"tangent", infinite, {-1e3, 0.5, 0}, x, 999.13397459622},
        {"tangent", infinite, {-1e3, 0.99999, 0}, x, 999.99552483963},
        {"tangent", infinite, {-1e3, 1.00001, 0}, x, MISS},
        {"tangent", infinite, {-1e5, 0.99, 0}, x, 99999.858932707},
    };
    check(known, COUNT_OF(known));
}

TEST(knows_cones)
{
    const Object half = infinite_cone(0.5), right = infinite_cone(1);
    const Object tip = frustum(1, 0, true), cup = frustum(0.5, 1, false);
    const Vector3 x = {1, 0, 0}, z = {0, 0, 1};
    const Known known[] = {
        {"apex", half, {5, 0, 0x1p-20}, {-1, 0, 0}, 4.9999995231628},
        {"apex", half, {0, 0, -5}, z, 5},
        {"apex", half, {5, 0x1p-20, 0x1p-20}, {-1, 0, 0}, MISS},
        {"along a generator", right, {3, 0.5, 1}, {-1, 0, 1}, 1.03125},
        {"along a generator", right, {3, 0.5, 1}, {-1, 0, 1 + 0x1p-23}, 1.0312499375723},
        {"along a generator", right, {3, 0.5, 1}, {-1, 0, 1 - 0x1p-24}, 1.0312500312139},
        {"either nappe", half, {5, 0, -2}, {-1, 0, 0}, 4},
        {"either nappe", half, {5, 0, 2}, {-1, 0, 0}, 4},
        {"tip", tip, {-5, 0, 1}, x, 4.5},
        {"tip", tip, {0.25, 0, 5}, {0, 0, -1}, 3.5},
        {"base", tip, {0.25, 0, -1}, z, 1},
        {"mirror nappe", tip, {-5, 0, 3}, x, MISS},
        {"inside", tip, {0, 0, 1}, x, 0.5},
        {"cup", cup, {0.75, 0, 5}, {0, 0, -1}, 4},
        {"through the cup", cup, {0.25, 0, 5}, {0, 0, -1}, MISS},
    };
    check(known, COUNT_OF(known));
}

// The numbers are those of interval arithmetic.
TEST(knows_tori)
{
    const Object ring = {.type = SHAPE_TORUS, .as.torus = {{0, 0, 0}, {0, 0, 3}, 1, 0.25}};
    const Object wire = {.type = SHAPE_TORUS, .as.torus = {{0, 0, 0}, {0, 0, 1}, 1, 1e-3}};
    const Object spindle = {.type = SHAPE_TORUS, .as.torus = {{0, 0, 0}, {0, 0, 1}, 1, 2}};
    const Vector3 x = {1, 0, 0}, z = {0, 0, 1}, down = {0, 0, -1};
    const Known known[] = {
        {"far", ring, {0.9, 0, -1000}, z, 999.77087122566},
        {"hole", ring, {0, 0, 10}, down, MISS},
        {"hole", ring, {0.74, 0, 10}, down, MISS},
        {"inner wall", ring, {0.76, 0, 10}, down, 9.9300000326974},
        {"equator", ring, {-5, 0, 0}, x, 3.75},
        {"equator", ring, {-1, 0, 0}, x, 0.25},
        {"equator", ring, {0, 0, 0}, x, 0.75},
        {"equator", ring, {-5, 0.75, 0}, x, 4},
        {"equator", ring, {-5, 1, 0}, x, 4.25},
        {"top", ring, {-5, 0, 0.25 - 0x1p-26}, x, 3.9999136832555},
        {"top", ring, {-5, 0, 0.25 + 0x1p-25}, x, MISS},
        {"wire", wire, {1.0005, 0, -10}, z, 9.9991339536194},
        {"wire", wire, {1.0011, 0, -10}, z, MISS},
        // The solid alone counts: from outside, from the tube, from where it lies in itself, across a dimple.
        {"spindle", spindle, {-5, 0, 0}, x, 2},
        {"spindle", spindle, {-2, 0, 0}, x, 5},
        {"spindle", spindle, {0, 0, 0}, x, 3},
        {"spindle", spindle, {0.25, 0, 0}, z, 1.8540496217739157},
        {"spindle", spindle, {0.25, 0, 5}, down, 3.1459503782260843},
        {"spindle", spindle, {-1, 0, 1.875}, x, 0.6959705453537527},
        {"spindle", spindle, {-0.125, 0, 1.875}, x, 0.4290294546462473},
    };
    check(known, COUNT_OF(known));
}

static Scene one_object(Object *object, Material *material, Light *lights, size_t light_count)
{
    Scene scene = {.background = {0.1, 0.2, 0.3}, .ambient = {0.5, 0.5, 0.5}};
    scene.objects.items = object;
    scene.objects.count = 1;
    scene.materials.items = material;
    scene.materials.count = 1;
    scene.lights.items = lights;
    scene.lights.count = light_count;
    return scene;
}

static double red(const Scene *scene, Vector3 origin, Vector3 direction)
{
    ReferenceRay ray = reference_ray(origin, direction);
    return reference_color(scene, &ray).color.x;
}

TEST(shades_as_phong)
{
    Object floor = {.type = SHAPE_PLANE, .as.plane = {{0, 0, 0}, {0, 1, 0}}};
    Material material = {.color = {0.8, 0, 0},
                         .ambient = 0.5,
                         .diffuse = {0.5, 0, 0},
                         .specular.largest = 0.25,
                         .shininess = 2};
    Light light = {.type = LIGHT_POINT, .color = {2, 2, 2}, .position = {3, 4, 0}};
    Scene scene = one_object(&floor, &material, &light, 1);

    // At the origin N.L = 4/5; seen from straight above, R.V is the same.
    double expected = 0.5 * 0.5 * 0.8 + 2 * (0.5 * 0.8 * 0.8 + 0.25 * 0.64);
    assert_near(red(&scene, (Vector3){0, 2, 0}, (Vector3){0, -1, 0}), expected, 1e-15);
    assert_near(red(&scene, (Vector3){0, 2, 0}, (Vector3){0, 1, 0}), 0.1, 0);
    // From below, the light is behind the surface.
    assert_near(red(&scene, (Vector3){0, -2, 0}, (Vector3){0, 1, 0}), 0.2, 1e-16);

    light = (Light){.type = LIGHT_DIRECTIONAL, .color = {2, 2, 2}, .direction = {-3, -4, 0}};
    assert_near(red(&scene, (Vector3){0, 2, 0}, (Vector3){0, -1, 0}), expected, 1e-15);

    // Half-way between full light and none in 1 - cos, the smooth step is a half.
    double outer = 1 - cos(60 * acos(-1) / 180), inner = 1 - cos(20 * acos(-1) / 180);
    double halfway = acos(1 - (outer + inner) / 2);
    light = (Light){.type = LIGHT_SPOT,
                    .color = {2, 2, 2},
                    .position = {0, 4, 0},
                    .spot.half_angle = 60,
                    .spot.penumbra = 40,
                    .direction = {sin(halfway), -cos(halfway), 0}};
    assert_near(red(&scene, (Vector3){0, 2, 0}, (Vector3){0, -1, 0}), 0.2 + (0.4 + 0.25), 1e-15);
    light.direction = (Vector3){1, -0.5, 0};
    assert_near(red(&scene, (Vector3){0, 2, 0}, (Vector3){0, -1, 0}), 0.2, 1e-16);
}

TEST(casts_shadows)
{
    // The shadow of a unit sphere that stands on a plane under a light ten high ends at 10 / sqrt 80.
    Object objects[] = {{.type = SHAPE_PLANE, .as.plane = {{0, 0, 0}, {0, 1, 0}}},
                        sphere((Vector3){0, 1, 0}, 1)};
    Material material = {.diffuse = {1, 1, 1}, .color = {1, 1, 1}};
    Light light = {.type = LIGHT_POINT, .color = {1, 1, 1}, .position = {0, 10, 0}};
    Scene scene = one_object(objects, &material, &light, 1);
    scene.objects.count = COUNT_OF(objects);
    const double edge = 10 / sqrt(80);
    for (int side = -1; side <= 1; side += 2) {
        double x = edge * (1 + side * 1e-9);
        ReferenceRay ray = reference_ray((Vector3){x + 2, 3, 0}, (Vector3){-2, -3, 0});
        ReferenceColor seen = reference_color(&scene, &ray);
        assert_int_equal(seen.color.x > 0, side > 0);
        assert_true(seen.margin > 1e-10 && seen.margin < 1e-8);
    }
}

TEST(lays_checkers)
{
    Object floor = {.type = SHAPE_PLANE, .as.plane = {{0, 0, 0}, {0, 1, 0}}};
    Material material = {.ambient = 1,
                         .checker.is_on = true,
                         .checker.size = 2,
                         .checker.colors = {{1, 1, 1}, {0.5, 0.5, 0.5}}};
    Scene scene = one_object(&floor, &material, NULL, 0);
    const Vector3 down = {0, -1, 0};
    // The floor's own axes are x and -z.
    assert_near(red(&scene, (Vector3){1, 1, -1}, down), 0.5, 0);
    assert_near(red(&scene, (Vector3){3, 1, -1}, down), 0.25, 0);
    assert_near(red(&scene, (Vector3){3, 1, -3}, down), 0.5, 0);
    assert_near(red(&scene, (Vector3){-1, 1, -1}, down), 0.25, 0);
    assert_near(red(&scene, (Vector3){-1, 1, 1}, down), 0.5, 0);
    floor = (Object){.type = SHAPE_BOX, .as.box = {{-4, -1, -4}, {4, 1, 4}}};
    assert_near(red(&scene, (Vector3){1, 5, 1}, down), 0.5, 0);
    assert_near(red(&scene, (Vector3){-1, 5, 1}, down), 0.25, 0);
}

TEST(aims_cameras)
{
    Camera camera = {.position = {1, 2, 3}, .look_at = {1, 2, -1}, .up = {0, 5, 0}, .half_tangent = 0.5};
    ReferenceRay ray = reference_camera_ray(&camera, 4, 2, 0, 0);
    // Forward -z, half a pixel up from the middle, one and a half to the left; a pixel is 1/2 wide.
    assert_true(ray.direction.x == -(Quad)0.75 && ray.direction.y == (Quad)0.25 && ray.direction.z == -1);
    camera.field_axis = FIELD_HORIZONTAL;
    ray = reference_camera_ray(&camera, 4, 2, 3, 1);
    assert_true(ray.direction.x == (Quad)0.375 && ray.direction.y == -(Quad)0.125 && ray.direction.z == -1);
    // The frame, 1 wide, moves by a half to the left and a quarter up.
    camera.shift[0] = -0.5;
    camera.shift[1] = 0.25;
    ray = reference_camera_ray(&camera, 4, 2, 3, 1);
    assert_true(ray.direction.x == -(Quad)0.125 && ray.direction.y == (Quad)0.125 && ray.direction.z == -1);
    camera.shift[0] = camera.shift[1] = 0;
    // Looking along `up`, the first axis square to the view stands in: here x is the way up.
    camera.up = (Vector3){0, 0, 2};
    ray = reference_camera_ray(&camera, 1, 2, 0, 0);
    assert_true(ray.direction.x == (Quad)0.5 && ray.direction.y == 0);
}

TEST(aims_panoramas)
{
    const Camera camera = {.look_at = {0, 0, -1},
                           .up = {0, 1, 0},
                           .field_axis = FIELD_HORIZONTAL,
                           .half_tangent = M_PI,
                           .projection = PROJECTION_EQUIRECTANGULAR};
    static const struct {
        unsigned column, row; // of 8 by 3
        double x, y, z;       // longitudes from 7/8 of a half-turn to the left on, latitudes of 60, 0 and -60
    } pixels[] = {{0, 1, -0.38268343236508977, 0, 0.92387953251128674},
                  {3, 1, -0.38268343236508977, 0, -0.92387953251128674},
                  {5, 0, 0.46193976625564337, 0.8660254037844386, -0.19134171618254489},
                  {7, 2, 0.19134171618254489, -0.8660254037844386, 0.46193976625564337}};
    for (size_t i = 0; i < COUNT_OF(pixels); i++) {
        const ReferenceRay ray = reference_camera_ray(&camera, 8, 3, pixels[i].column, pixels[i].row);
        const Vector3 expected = {pixels[i].x, pixels[i].y, pixels[i].z};
        assert_true(reference_distance(expected, ray.direction) < 4 * DBL_EPSILON);
    }
}

// The camera's vectors in double are those of quadruple precision but for rounding.
TEST(rounds_cameras)
{
    Random random = {7};
    for (int i = 0; i < 50; i++) {
        const Camera camera = {.position = vector_scale(random_unit_vector(&random), 5),
                               .look_at = random_unit_vector(&random),
                               .up = random_unit_vector(&random),
                               .half_tangent = 4};
        const CameraBasis basis = camera_basis(&camera, 8, 8);
        const Quad3 forward = quad3_unit(quad3_subtract(quad3(camera.look_at), quad3(camera.position)));
        const Quad3 across = quad3_cross(forward, quad3(camera.up)), right = quad3_unit(across);
        const double steepness = (double)(1 / quad3_length(across));
        assert_true(reference_distance(basis.forward, forward) < 4 * DBL_EPSILON);
        assert_true(reference_distance(vector_scale(basis.right, 2), right) < 4 * DBL_EPSILON * steepness);
        assert_true(reference_distance(vector_scale(basis.up, 2), quad3_cross(right, forward)) <
                    4 * DBL_EPSILON * steepness);
    }
}

TEST(rounds_every_number)
{
    const Vector3 third = {1.0 / 3, 1.0 / 3, 1.0 / 3};
    const double rounded = (double)(1.0f / 3);
    Object object = {.type = SHAPE_BOX, .as.box = {third, third}};
    object = reference_round_object(&object);
    const double numbers[] = {object.as.box.min.x, object.as.box.min.y, object.as.box.min.z,
                              object.as.box.max.x, object.as.box.max.y, object.as.box.max.z};
    for (size_t i = 0; i < COUNT_OF(numbers); i++)
        assert_near(numbers[i], rounded, 0);
    object = frustum(1.0 / 3, 1.0 / 3, true);
    object.as.cone.from = object.as.cone.axis = third;
    object = reference_round_object(&object);
    assert_near(object.as.cone.from.z + object.as.cone.axis.z, (double)(2.0f / 3), 0);
    assert_near(object.as.cone.radius[1], rounded, 0);
}

TEST(finds_the_nearest)
{
    Object objects[] = {sphere((Vector3){0, 0, 9}, 1), sphere((Vector3){0, 0, 5}, 1),
                        sphere((Vector3){0, 0, 6}, 2)};
    Scene scene = one_object(objects, NULL, NULL, 0);
    scene.objects.count = COUNT_OF(objects);
    ReferenceRay ray = reference_ray((Vector3){0, 0, 0}, (Vector3){0, 0, 1});
    ReferenceHit hit = reference_hit(&scene, &ray);
    assert_int_equal(hit.object, 1);
    assert_true(hit.t == 4 && hit.margin == 0);
    ray.tmin = 4;
    assert_true(reference_hit(&scene, &ray).t == 6);
    assert_near(ulp_of(1, 24), 0x1p-23, 0);
    assert_near(ulp_of(-3, 53), 0x1p-51, 0);
}

// A ray from a distance of 1 hits a shape of size 1e-6 within 1e-31 of its surface.
TEST(finds_small_shapes_exactly)
{
    enum { SHAPES = 5 };
    Random random = {1};
    size_t found[SHAPES] = {0};
    for (int i = 0; i < 1000; i++) {
        const Vector3 at = {0.1, -0.3, -1}, axis = random_unit_vector(&random);
        const double size = 1e-6;
        const Vector3 half = vector_scale(axis, size);
        const Object objects[SHAPES] = {
            sphere(at, size),
            cylinder(at, vector_scale(axis, 2 * size), size, true, true),
            {.type = SHAPE_CONE,
             .as.cone = {at, vector_scale(axis, size), {0, 7 * size}, 0, true, true, false}},
            {.type = SHAPE_PARABOLOID,
             .as.paraboloid =
                 {.apex = at, .axis = axis, .focal_length = size, .height = size, .finite = true}},
            {.type = SHAPE_SUPERELLIPSOID,
             .as.superellipsoid = {at, {{size, 0, 0}, {0, size, 0}, {0, 0.5 * size, size}}, 6}}};
        const Object *object = &objects[i % SHAPES];
        const Vector3 aim = vector_add(vector_add(at, half), vector_scale(random_unit_vector(&random), size));
        const ReferenceRay ray = reference_ray_rounded((Vector3){0, 0, 0}, aim);
        const ReferenceHit hit = reference_hit_object(object, &ray);
        if (!hit.found) continue;
        found[i % SHAPES]++;
        const ReferenceSurface surface = reference_surface(object, reference_point(&ray, hit.t));
        const double off = (double)reference_surface_distance(&surface);
        if (off > 1e-31) fail_msg("shape %d: %g off the surface", i % SHAPES, off);
    }
    for (int i = 0; i < SHAPES; i++)
        assert_true(found[i] > 50);
}

// A point off the surface along the exact normal is as far from it as it was moved, and the normal is there.
TEST(measures_distances)
{
    size_t measured = 0;
    ShapeForm forms[SHAPE_FORMS_MAX];
    const size_t form_count = shape_forms(forms);
    for (size_t type = 0; type < form_count; type++) {
        Random random = {type};
        RandomShape shape = random_shape(&forms[type], &random);
        for (int i = 0; i < 50; i++) {
            RandomRay given = random_ray(&shape, &random);
            ReferenceRay ray = reference_ray(given.origin, given.direction);
            ReferenceHit hit = reference_hit_object(&shape.object, &ray);
            double height = (i % 2 ? 1e-9 : -1e-9) * shape.radius;
            // near an edge another part of the surface may be nearer
            if (!hit.found || hit.margin < 1e-6 * shape.radius || hit.cosine < 1e-3) continue;
            Quad3 point = quad3_add(reference_point(&ray, hit.t), quad3_scale(hit.normal, height));
            ReferenceSurface surface = reference_surface(&shape.object, point);
            double distance = (double)reference_surface_distance(&surface);
            bool normal_found = false;
            for (int k = 0; k < surface.count; k++) {
                const ReferenceSheet *sheet = &surface.sheets[k];
                double turned = (double)quad3_length(quad3_cross(sheet->normal, hit.normal));
                normal_found |= sheet->distance <= 2 * fabs(height) && turned < 1e-7;
            }
            // to first order, of a paraboloid
            if (!(fabs(distance - fabs(height)) <= 1e-7 * fabs(height)) || !normal_found)
                fail_msg("%s: %g off the surface, not %g", forms[type].name, distance, height);
            measured++;
        }
    }
    assert_true(measured > 15 * form_count);
}

TEST(knows_highlights)
{
    const Quad3 normal = {0, 0, 1}, to_eye = {0, 0, 1};
    const double exponents[] = {0, 1, 10, 1e3, 1e6}, angles[] = {0, 1e-4, 1e-3, 0.1, 1};
    for (size_t i = 0; i < COUNT_OF(exponents); i++)
        for (size_t k = 0; k < COUNT_OF(angles); k++) {
            // the light mirrored lies at its own angle with the eye
            Quad3 to_light = {sinl(angles[k]), 0, cosl(angles[k])};
            double versine = 2 * sin(angles[k] / 2) * sin(angles[k] / 2);
            double expected = exp(exponents[i] * log1p(-versine));
            double value = (double)reference_highlight(normal, to_light, to_eye, exponents[i]);
            assert_near(value, expected, 1e-12);
        }
    assert_near((double)reference_highlight(normal, (Quad3){0, 0, -1}, to_eye, 0), 0, 0);
}

// Whichever channel it is, and whether the pixel's decisions are right or wrong.
TEST(nonfinite_colors_are_errors)
{
    uint32_t places[3][2] = {{0, 0}, {1, 0}, {2, 0}}, objects[3] = {0}, paths[3] = {0}, flags[3] = {0};
    ReferencePixel pixels[3];
    for (size_t i = 0; i < COUNT_OF(pixels); i++)
        pixels[i] = (ReferencePixel){.color = {0.5, 0.25, 0.125}, .margin = 1};
    double colors[9] = {0.5, 0.25, 0.25, 0.5, 0.25, 0.125, 0.5, 0.25, 0.125};
    CertifySample sample = {.width = 3, .height = 1, .count = 1, .places = places, .pixels = pixels};
    const Film film = {
        .width = 3, .height = 1, .object = objects, .path = paths, .color = colors, .flag = flags};
    assert_true(certify_compare(&sample, &film).wrong_color == 0.125);
    sample.count = 3;
    for (size_t channel = 0; channel < 3; channel++) {
        double *faulty = colors + 3 + channel;
        const double right = *faulty;
        *faulty = channel == 1 ? -INFINITY : NAN;
        const CertifyErrors errors = certify_compare(&sample, &film);
        assert_true(isinf(errors.wrong_color) && errors.right_color == 0);
        assert_int_equal(errors.worst[0], 1);
        paths[1] = 1;
        assert_true(isinf(certify_compare(&sample, &film).wrong_color));
        paths[1] = 0;
        *faulty = right;
    }
}

// A distance of 0 from a wrong normal or position would be within every bound.
TEST(distance_from_nan_is_nan)
{
    assert_true(isnan(reference_distance((Vector3){NAN, 0, 1}, quad3((Vector3){0, 0, 1}))));
}

TEST_MAIN(NULL, NULL)
