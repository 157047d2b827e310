// Reads `.nff` scenes. Tests every element's values, and what is tolerated in files in the wild.
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

#define VIEW     "v\nfrom 0 0 -5\nat 0 0 0\nup 0 1 0\nangle 45\n"
#define LIT      VIEW "l 0 9 0\n"
#define MATERIAL "f 1 1 1 1 0 1 0 0\n"
#define SPHERE   "s 0 0 0 1\n"

static int set_up(void **state)
{
    return complete_open("tests/scenes/complete.nff") + probe_open(state);
}

static int tear_down(void **state)
{
    return complete_close(state) + probe_close(state);
}

TEST(view)
{
    assert_int_equal(complete.width, 640);
    assert_int_equal(complete.height, 480);
    assert_int_equal(complete.color_meaning, COLORS_DISPLAY);
    assert_vector(complete.background, 0.1, 0.2, 0.3);
    assert_vector(complete.camera.position, 0, 1, -5);
    assert_vector(complete.camera.look_at, 0, 1, 0);
    assert_vector(complete.camera.up, 0, 1, 0);
    assert_int_equal(complete.camera.field_axis, FIELD_VERTICAL);
    assert_number(complete.camera.half_tangent, tan(M_PI / 6));
    assert_number(complete.camera.frame_aspect, 0);
}

// Four lights: each without a color has the intensity sqrt(4) / 8.
TEST(lights)
{
    assert_int_equal(complete.lights.count, 4);
    const Light *lights = complete.lights.items;
    assert_int_equal(lights[0].type, LIGHT_POINT);
    assert_vector(lights[0].position, 1, 2, 3);
    assert_vector(lights[0].color, 0.25, 0.25, 0.25);
    assert_vector(lights[1].color, 0.5, 0, 0.25);
    assert_vector(lights[2].position, -1, -2, -3);
    assert_vector(lights[3].color, 0.25, 0.25, 0.25);
    assert_vector(complete.ambient, 0.25, 0.25, 0.25);
}

TEST(materials)
{
    assert_int_equal(complete.materials.count, 2);
    const Material *matte = &complete.materials.items[0], *glass = matte + 1;
    assert_vector(matte->color, 1, 0.5, 0.25);
    assert_number(matte->ambient, 0.8);
    assert_vector(matte->diffuse, 0.8, 0.8, 0.8);
    assert_number(matte->specular.largest, 0.3);
    assert_number(matte->shininess, 20);
    assert_number(matte->reflection.largest, 0.3);
    assert_number(matte->transmission.largest, 0);
    assert_number(glass->transmission.largest, 0.9);
    assert_number(glass->ior, 1.5);
    assert_int_equal(glass->shadow, SHADOW_FULL);
    assert_int_equal(complete.objects.items[1].material, 0);
    assert_int_equal(complete.objects.items[2].material, 1);
}

TEST(round_shapes)
{
    static const Object expected[] = {
        {SHAPE_SPHERE, .as.sphere = {{1, 2, 3}, 4}},
        {SHAPE_SPHERE, .as.sphere = {{1, 2, 3}, 4, .only_inside = true}},
        {SHAPE_CYLINDER, .as.cylinder = {{0, 0, 0}, {0, 3, 0}, 2, .finite = true}},
        {SHAPE_CONE, .as.cone = {{0, 0, 0}, {0, 3, 0}, {2, 0.5}, .finite = true}},
        {SHAPE_CYLINDER, .as.cylinder = {{0, 0, 0}, {0, 3, 0}, 2, .finite = true, .only_inside = true}},
        {SHAPE_CONE, .as.cone = {{0, 0, 0}, {0, 3, 0}, {0, 1}, .finite = true, .only_inside = true}},
    };
    check_shapes(complete.objects.items, expected, COUNT_OF(expected));
}

static double triangle_area(const Object *triangle)
{
    const Vector3 *v = triangle->as.triangle.vertices;
    return vector_cross(vector_subtract(v[1], v[0]), vector_subtract(v[2], v[0])).z / 2;
}

TEST(polygons)
{
    assert_int_equal(complete.objects.count, 6 + 1 + 3 + 1);
    const Object *triangles = complete.objects.items + 6;
    for (size_t i = 0; i < 5; i++)
        assert_int_equal(triangles[i].type, SHAPE_TRIANGLE);
    assert_number(triangle_area(&triangles[0]), 0.5);
    assert_false(triangles[0].as.triangle.smooth);
    double area = 0;
    for (size_t i = 1; i < 4; i++)
        area += triangle_area(&triangles[i]);
    assert_number(area, 2.5);
    assert_number(triangle_area(&triangles[4]), 0.5);
    assert_true(triangles[4].as.triangle.smooth);
    for (size_t i = 0; i < 3; i++) {
        Vector3 vertex = triangles[4].as.triangle.vertices[i], normal = triangles[4].as.triangle.normals[i];
        assert_vector(normal, vertex.x / 2, vertex.y / 2, 1);
    }
}

TEST(tolerated)
{
    assert_messages("s.nff", LIT MATERIAL SPHERE, "");
    assert_messages("s.nff", "\xEF\xBB\xBF" LIT MATERIAL SPHERE, "");
    assert_messages("s.nff",
                    "v from 0 0 -5 \r\n at\t0 0 0\r\nangle 45\r\nup 0 1 0 # no hither\r\nl 0 9 0\r\n" MATERIAL
                    "s 0 0\r\n0 1\r\n",
                    "");
    assert_messages("s.nff", LIT SPHERE SPHERE,
                    "7:1: warning: no material precedes this object; it is white\n");
    assert_messages("s.nff", LIT MATERIAL "p 3\n0 0 0\n1 1 1\n2 2 2\n" SPHERE,
                    "8:1: warning: the polygon has no area and is never hit\n");
    assert_messages("s.nff", LIT MATERIAL "p 4\n0 0 0\n4 4 0\n4 0 0\n0 3 0\n",
                    "8:1: warning: the polygon intersects itself; only parts of it are filled\n");
    assert_messages("s.nff", LIT, "warning: the scene has no objects, so only the background is shown\n");
    assert_messages("s.nff", VIEW MATERIAL SPHERE,
                    "warning: the scene has no lights, so only ambient light and emission are shown\n");
}

static void check_sides(const char *shape, double reach, bool only_inside)
{
    const TraceRay rays[] = {{{0, 0, -5}, {0, 0, 1}, 0, INFINITY}, {{0, 0, 0}, {0, 0, 1}, 0, INFINITY}};
    OwnedScene scene = scene_of_text("s.nff", formatted(LIT MATERIAL "%s\n", shape));
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        if (!probe_has(precision)) continue;
        TraceHit hits[2] = {0};
        assert_true(probe_trace(&scene, precision, 0, rays, 2, hits));
        assert_int_equal(hits[0].object, 0);
        assert_true(fabs(hits[0].t - (only_inside ? 5 + reach : 5 - reach)) < 1e-5);
        assert_int_equal(hits[1].object, 0);
        assert_true(fabs(hits[1].t - reach) < 1e-6);
    }
}

// Rays along the z axis, from outside and from inside. What is seen only from inside is hit at its far side
// by both.
TEST(only_inside)
{
    check_sides("s 0 0 0 1", 1, false);
    check_sides("s 0 0 0 -1", 1, true);
    check_sides("c 0 -1 0 1 0 1 0 1", 1, false);
    check_sides("c 0 -1 0 -1 0 1 0 -1", 1, true);
    check_sides("c 0 -1 0 1 0 1 0 0", 0.5, false);
    check_sides("c 0 -1 0 -1 0 1 0 0", 0.5, true);
}

TEST_MAIN(set_up, tear_down)
