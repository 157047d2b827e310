// Reads `.cfg` scenes. Tests every block's values. test_wild.py has what is tolerated.
#include "tests/check.h"
#include "tests/scene_reading.h"

static int set_up(void **state)
{
    (void)state;
    return complete_open("tests/scenes/complete.cfg");
}

TEST(scene)
{
    assert_vector(complete.camera.position, 0, 0, 5);
    assert_vector(complete.camera.look_at, 0, 0, -1);
    assert_vector(complete.camera.up, 0, 1, 0);
    assert_int_equal(complete.camera.field_axis, FIELD_HORIZONTAL);
    assert_number(complete.camera.half_tangent, 0.25);
    assert_number(complete.camera.frame_aspect, 0);
    assert_vector(complete.ambient, 0.2, 0.2, 0.2);
    assert_vector(complete.background, 0, 0, 0);
    assert_int_equal(complete.color_meaning, COLORS_DISPLAY);
}

TEST(light)
{
    assert_int_equal(complete.lights.count, 1);
    assert_int_equal(complete.lights.items[0].type, LIGHT_POINT);
    assert_vector(complete.lights.items[0].position, 1, 2, 3);
    assert_vector(complete.lights.items[0].color, 0.5, 0.6, 0.7);
}

TEST(shapes)
{
    const Object expected[] = {
        {SHAPE_SPHERE, .as.sphere = {{0, -3, -5}, 2.5}},
        {SHAPE_PLANE, .as.plane = {{0, -6, 0}, {0, 1, 0}}},
        {SHAPE_CYLINDER, .as.cylinder = {{3, 0, -9}, {0, 2, 0}, 1}},
        {SHAPE_CONE, .as.cone = {{-3, 0, -9}, {1, 1, 0}, .slope = tan(0.5)}}, // the angle is in radians
    };
    assert_int_equal(complete.objects.count, COUNT_OF(expected));
    check_shapes(complete.objects.items, expected, COUNT_OF(expected));
}

TEST(materials)
{
    const Object *objects = complete.objects.items;
    const Material *sphere = material_of(&objects[0]);
    assert_vector(sphere->color, 1, 0.4, 0);
    assert_number(sphere->ambient, 1);
    assert_vector(sphere->diffuse, 0.5, 0.6, 0.7);
    assert_number(sphere->specular.largest, 1);
    assert_number(sphere->shininess, 30);
    assert_vector(material_of(&objects[1])->color, 0, 0, 1);
    assert_number(material_of(&objects[2])->specular.largest, 0.25);
}

TEST_MAIN(set_up, complete_close)
