// Reads `.cfg` scenes. Tests every block's values, and the tolerances.
#include "tests/check.h"
#include "tests/scene_reading.h"

#define CAMERA "=>camera :\n{\n\tposition 0 0 5\n\tlook_at 0 0 -1\n}\n"
#define LIGHT  "=>light :\n{\n\tposition 0 9 0\n\tintensity 1 1 1\n}\n"
#define SPHERE "=>sphere :\n{\n\tradius 1\n\tcenter 0 0 0\n\tcolor 0 0 0\n\tdiffuse 1 1 1\n\tspecular 0\n}\n"

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

TEST(sphere)
{
    const Object *sphere = &complete.objects.items[0];
    assert_int_equal(sphere->type, SHAPE_SPHERE);
    assert_vector(sphere->as.sphere.center, 0, -3, -5);
    assert_number(sphere->as.sphere.radius, 2.5);
    assert_vector(material_of(sphere)->color, 1, 0.4, 0);
    assert_number(material_of(sphere)->ambient, 1);
    assert_vector(material_of(sphere)->diffuse, 0.5, 0.6, 0.7);
    assert_number(material_of(sphere)->specular.largest, 1);
    assert_number(material_of(sphere)->shininess, 30);
}

TEST(plane)
{
    const Object *plane = &complete.objects.items[1];
    assert_int_equal(plane->type, SHAPE_PLANE);
    assert_vector(plane->as.plane.point, 0, -6, 0);
    assert_vector(plane->as.plane.normal, 0, 1, 0);
    assert_vector(material_of(plane)->color, 0, 0, 1);
}

TEST(cylinder)
{
    const Object *cylinder = &complete.objects.items[2];
    assert_int_equal(cylinder->type, SHAPE_CYLINDER);
    assert_false(cylinder->as.cylinder.finite);
    assert_vector(cylinder->as.cylinder.from, 3, 0, -9);
    assert_vector(cylinder->as.cylinder.axis, 0, 2, 0);
    assert_number(cylinder->as.cylinder.radius, 1);
    assert_number(material_of(cylinder)->specular.largest, 0.25);
}

TEST(cone)
{
    const Object *cone = &complete.objects.items[3];
    assert_int_equal(cone->type, SHAPE_CONE);
    assert_false(cone->as.cone.finite);
    assert_vector(cone->as.cone.from, -3, 0, -9);
    assert_vector(cone->as.cone.axis, 1, 1, 0);
    assert_number(cone->as.cone.slope, tan(0.5)); // the angle is in radians
}

TEST(any_order_and_blanks)
{
    assert_messages(
        "s.cfg", SPHERE "\r\n\n" LIGHT "=> camera:\r\n\n{\r\n\n  look_at 0 0 1\r\n\tposition 0\t0 0\r\n}\r\n",
        "");
}

TEST(text_between_blocks_is_skipped)
{
    assert_messages("s.cfg", CAMERA "transfo 1 2 3\n" LIGHT SPHERE, "6:1: warning: skipped 'transfo'\n");
}

TEST(no_lights_no_objects)
{
    assert_messages("s.cfg", CAMERA, "warning: s.cfg: no objects\nwarning: s.cfg: no lights\n");
}

TEST_MAIN(set_up, complete_close)
