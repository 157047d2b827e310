// Tests the lines of objects in a scene's file, by every reader, and their description.
#include "host/scene/describe.h"
#include "tests/check.h"
#include "tests/scene_reading.h"

enum { OBJECTS_MAX = 4 };

#define CFG_SPHERE "=>sphere :\n{\nradius 1\ncenter 0 0 0\ncolor 255 0 0\ndiffuse 1 1 1\nspecular 0\n}\n"

static const struct {
    const char *name, *text;
    unsigned lines[OBJECTS_MAX]; // of each object
} cases[] = {
    {"a.yaml",
     "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"
     "lights: [{point: {position: [3, 5, 4]}}]\n"
     "objects:\n"
     "  - &ball\n"
     "    sphere: {center: [0, 0, 0], radius: 1}\n"
     "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
     "  - *ball\n"
     "  - box: {min: [0, 0, 0],\n"
     "      max: [1, 1, 1]}\n",
     {5, 6, 5, 8}},
    {"a.rt",
     "A 0.2 255,255,255\n"
     "C 0,0,-5 0,0,1 70\n"
     "L 0,5,0 0.5 255,255,255\n"
     "\n"
     "sp 0,0,0 2 255,0,0\n"
     "# no object\n"
     "sq 0,0,0 0,0,1 2 255,0,0\n"
     "sp 0,3,0 2 255,0,0",
     {5, 7, 7, 8}},
    {"a.nff",
     "v\nfrom 0 0 -5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 8 8\n"
     "l 0 5 0\n"
     "f 1 0 0 1 0 1 0 1\n"
     "s 0 0 0 1\n"
     "p 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
     "s 3 0 0\n1\n",
     {10, 11, 11, 16}},
    {"a.dat",
     "begin_scene\nresolution 8 8\n"
     "camera zoom 1 aspectratio 1 antialiasing 0 raydepth 5 center 0 0 -5 viewdir 0 0 1 updir 0 1 0 "
     "end_camera\n"
     "light center 0 9 0 rad 0 color 1 1 1\n"
     "texdef t ambient 0 diffuse 1 specular 0 opacity 1 color 1 1 1 texfunc 0\n"
     "sphere center 0 0 0 rad 1 t sphere\ncenter 0 0 0\nrad 1 t\n"
     "polycylinder points 1\n0 0 0 rad 1 t\nplane center 0 0 0 normal 0 1 0 t\nend_scene\n",
     {6, 6, 9, 11}},
    {"a.cfg",
     "=>camera :\n{\nposition 0 0 -5\nlook_at 0 0 0\n}\n"
     "=>light :\n{\nposition 0 9 0\nintensity 1 1 1\n}\n" CFG_SPHERE CFG_SPHERE "\n" CFG_SPHERE CFG_SPHERE,
     {11, 19, 28, 36}},
};

static void check_lines(size_t i, int ends)
{
    OwnedText text = text_with_line_ends(cases[i].text, ends);
    OwnedScene scene = scene_of_text(cases[i].name, text_c(&text));
    assert_int_equal(scene.objects.count, OBJECTS_MAX);
    for (size_t k = 0; k < OBJECTS_MAX; k++)
        assert_int_equal(scene.objects.items[k].line, cases[i].lines[k]);
}

// Line ends of Unix, Windows and old Macs.
TEST(lines)
{
    for (size_t i = 0; i < COUNT_OF(cases); i++)
        for (int ends = 0; ends < 3; ends++)
            check_lines(i, ends);
}

static void assert_described(const Scene *scene, size_t id, const char *expected)
{
    OwnedText text = {0};
    object_describe(&text, scene, "folder/a.yaml", id);
    assert_string_equal(text_c(&text), expected);
}

TEST(descriptions)
{
    OwnedScene scene = scene_of_text("a.yaml", "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"
                                               "lights: [{point: {position: [3, 5, 4]}}]\n"
                                               "materials: {red: {color: [1, 0, 0]}}\n"
                                               "objects:\n"
                                               "  - sphere: {center: [0, 0, 0], radius: 1, material: red}\n"
                                               "  - mesh: {file: scenes/meshes/bunny.obj}\n"
                                               "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n");
    const size_t triangles = scene.meshes.items[0].triangle_count;
    assert_described(&scene, 0, "sphere 0, a.yaml:5, material red");
    assert_described(&scene, 3, "triangle 2 of mesh 1, bunny.obj, a.yaml:6");
    assert_described(&scene, triangles + 1, formatted("plane %zu, a.yaml:7", triangles + 1));
    assert_described(&scene, triangles + 2, "nothing");
    assert_described(&scene, UINT32_MAX, "nothing");
}

TEST_MAIN(NULL, NULL)
