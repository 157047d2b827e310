// Reads `.rt` scenes. Tests every element's values. test_wild.py has more that is tolerated.
#include "host/compile/scene_bounds.h"
#include "tests/check.h"
#include "tests/scene_reading.h"

#define CAMERA "C 0,0,-5 0,0,1 60\n"
#define LIT    CAMERA "L 0,9,0 1\n"

static int set_up(void **state)
{
    (void)state;
    return complete_open("tests/scenes/complete.rt");
}

TEST(scene)
{
    assert_int_equal(complete.width, 640);
    assert_int_equal(complete.height, 480);
    assert_int_equal(complete.color_meaning, COLORS_DISPLAY);
    assert_vector(complete.ambient, 0.2, 0.1, 0);
    assert_vector(complete.background, 0, 0, 0);
    assert_vector(complete.camera.position, 0, 1, -5);
    Vector3 view = vector_normalize(vector_subtract(complete.camera.look_at, complete.camera.position));
    assert_vector(view, 0, 0, 1);
    assert_vector(complete.camera.up, 0, 1, 0);
    assert_int_equal(complete.camera.field_axis, FIELD_HORIZONTAL);
    assert_number(complete.camera.half_tangent, tan(M_PI / 6));
    assert_number(complete.camera.frame_aspect, 0);
}

TEST(lights)
{
    assert_int_equal(complete.lights.count, 3);
    const Light *lights = complete.lights.items;
    assert_int_equal(lights[0].type, LIGHT_POINT);
    assert_vector(lights[0].position, 1, 2, 3);
    assert_vector(lights[0].color, 0.5, 0, 0.1);
    assert_vector(lights[1].color, 1, 1, 1);
    assert_vector(lights[2].color, 0, 0, 0.25);
}

TEST(shapes)
{
    static const Object expected[] = {
        {SHAPE_SPHERE, .as.sphere = {{1, 2, 3}, 2}},
        {SHAPE_PLANE, .as.plane = {{0, -1, 0}, {0, 1, 0}}},
        // the file gives a cylinder's center
        {SHAPE_CYLINDER, .as.cylinder = {{1, -1, 3}, {0, 6, 0}, 1, .finite = true, .caps = true}},
        {SHAPE_TRIANGLE, .as.triangle.vertices = {{-1, 0, 3}, {3, 0, 3}, {3, 4, 3}}},
        {SHAPE_TRIANGLE, .as.triangle.vertices = {{-1, 0, 3}, {3, 4, 3}, {-1, 4, 3}}},
        {SHAPE_TRIANGLE, .as.triangle.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
        {SHAPE_CONE, .as.cone = {{1, 2, 3}, {3, 0, 0}, {2, 0}, .finite = true, .caps = true}},
    };
    assert_int_equal(complete.objects.count, COUNT_OF(expected));
    check_shapes(complete.objects.items, expected, COUNT_OF(expected));
}

TEST(materials)
{
    const Object *objects = complete.objects.items;
    const Material *first = material_of(&objects[0]), *second = material_of(&objects[1]);
    assert_vector(first->color, 1, 0, 0);
    assert_number(first->specular.largest, 0.5);
    assert_number(first->shininess, 10);
    assert_vector(second->color, 0, 1, 0);
    assert_vector(second->diffuse, 1, 1, 1);
    assert_number(second->ambient, 1);
    assert_number(second->specular.largest, 0);
    assert_number(material_of(&objects[2])->specular.largest, 0.25);
    assert_int_equal(objects[3].material, objects[4].material); // a square's triangles
    assert_vector(material_of(&objects[3])->color, 0.2, 0.4, 0.6);
}

TEST(square_on_the_floor)
{
    OwnedScene scene = scene_of_text("s.rt", LIT "sq 0,0,0 0,1,0 2 255,0,0\n");
    const Bounds bounds = scene_extent(&scene).bounds;
    assert_vector(bounds.min, -1, 0, -1);
    assert_vector(bounds.max, 1, 0, 1);
}

TEST(missing_parts_are_fine)
{
    assert_messages("s.rt", CAMERA,
                    "warning: the scene has no objects, so only the background is shown\nwarning: the scene "
                    "has no lights, so only ambient "
                    "light and emission are shown\n");
    OwnedScene scene = scene_of_text("s.rt", CAMERA);
    assert_vector(scene.ambient, 0, 0, 0);
    assert_int_equal(scene.width, 0);
}

TEST(far_camera_keeps_its_direction)
{
    OwnedScene scene = scene_of_text("s.rt", "C 1e20,0,0 0,0,1 70\n");
    assert_true(scene.camera.look_at.z > 0);
}

// Blanks next to commas, a brightness above 1, checkers and the names of textures.
TEST(lenient_reads_dialects)
{
    const char *const text = "A 0.2 255, 255,255\nC 0 ,0, -5 0,0 , 1 60\nL 1,2,\t3 1.5 255,0,0\n"
                             "sp 1, 2, 3 2 255, 0 ,0 0.5 10 cb:8\npl 0,0,0 0,1,0 9,9,9 earth.xpm\n"
                             "cy 0,0,0 0,1,0 255 , 0 , 0 1 2\n";
    OwnedText messages = scene_messages("s.rt", text, true);
    assert_string_equal(
        text_c(&messages),
        "3:10: warning: 'ratio' is above 1; it is used unchanged\n"
        "4:31: warning: 'cb:8' is skipped\n"
        "5:22: warning: 'earth.xpm' is skipped\n"
        "6:16: warning: the color is accepted although it precedes the diameter and the height\n");
    OwnedText source = {0};
    text_appendf(&source, "%s", text);
    OwnedMessageList list = {0};
    OwnedScene scene;
    assert_true(scene_read_text(&scene, "s.rt", &source, true, &list));
    assert_vector(scene.camera.position, 0, 0, -5);
    assert_vector(scene.lights.items[0].position, 1, 2, 3);
    assert_vector(scene.lights.items[0].color, 1.5, 0, 0);
    assert_vector(scene.objects.items[0].as.sphere.center, 1, 2, 3);
    assert_number(scene.materials.items[0].specular.largest, 0.5);
}

TEST(lenient_keeps_other_errors)
{
    OwnedText messages = scene_messages("s.rt",
                                        LIT "sp 0,0,0 -2 255,0,0\nsp 0, ,0 2 255,0,0\nsp 0, 0 2 255,0,0\n"
                                            "L 0,0,0 -1\n",
                                        true);
    assert_string_equal(text_c(&messages),
                        "3:10: error: 'diameter' must be greater than 0, not '-2'\n"
                        "4:7: error: 'center' must be a number, but it is empty\n"
                        "5:4: error: 'center' must be three numbers separated by commas, not '0, 0'\n"
                        "6:9: error: 'ratio' must be 0 or more, not '-1'\n");
}

TEST(many_warnings_are_counted)
{
    OwnedText text = {0};
    text_appendf(&text, LIT);
    for (int i = 0; i < 30; i++)
        text_appendf(&text, "pl 0,0,0 0,0.5,0 255,0,0\n");
    OwnedText messages = scene_messages("s.rt", text_c(&text), false);
    assert_non_null(strstr(text_c(&messages),
                           "22:10: warning: 'normal' is not a unit vector; it is normalized\n"
                           "warning: 10 more warnings are not shown\n"));
}

TEST_MAIN(set_up, complete_close)
