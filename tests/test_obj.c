// Reads OBJ and MTL files. Tests the layouts that are read, materials and their images, and each message with
// its place.
#include "host/import/load.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

#define SCENE_OF(mesh)                                                                                       \
    "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\nlights: [{point: {position: [0, 0, -5]}}]\n"        \
    "objects:\n  - mesh: {file: a.obj" mesh "}\n"

#define CORNERS "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define FACE    CORNERS "f 1 2 3\n"

// Reads the scene of the mesh. All messages with their files, one per line, must equal `expected`.
static bool scene_read(Scene *scene, const char *text, const char *expected)
{
    OwnedMessageList messages = {0};
    OwnedText source = {0}, got = {0};
    text_appendf(&source, "%s", text);
    const bool read = scene_read_text(scene, "scene.yaml", &source, false, &messages);
    for (size_t i = 0; i < messages.count; i++) {
        text_appendf(&got, "%s:", messages.items[i].file ? messages.items[i].file : "");
        message_describe(&got, &messages.items[i]);
    }
    assert_string_equal(text_c(&got), expected);
    return read;
}

static Scene scene_of_obj(const char *obj, const char *expected)
{
    Scene scene;
    file_write("a.obj", obj);
    assert_true(scene_read(&scene, SCENE_OF(""), expected));
    return scene;
}

static Vector3 corner_of(const Mesh *mesh, size_t corner)
{
    return mesh->vertices[mesh->triangles[corner / 3][corner % 3]];
}

static void assert_unit_square(const char *obj, const char *messages)
{
    static const double expected[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
    OwnedScene scene = scene_of_obj(obj, messages);
    const Mesh *mesh = &scene.meshes.items[0];
    assert_int_equal(mesh->triangle_count, 2);
    for (size_t i = 0; i < 6; i++) {
        // a quadrilateral is cut by its first diagonal, wherever the first triangle starts
        const Vector3 corner = corner_of(mesh, i);
        assert_vector(corner, expected[i][0], expected[i][1], 0);
    }
}

TEST(layouts_are_read)
{
    static const char *const texts[] = {
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4",
        ("# a square\n\n  v\t0  0 0 \nv 1. -0 +0.0 # no color\nv 100e-2 1 0\nv .0 1E0 0\no a\ns off\n"
         "f  1 2\t3 4  \n"),
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n",
        // faces may stand before what they name
        "f 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n",
        "v 0 0 \\\n0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n3 \\\n  4\n",
        "# continues \\\nv 7 7 7\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nfo +1 2 3 4\n",
        "v 0 0 0 1\nv 2 0 0 2\nv -1 -1 0 -1\nv 0 0.5 0 0.5\nf 1 2 3 4\n",
        "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2// 3/1 4//1\n",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n",
        // what no face has is not checked
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv nan 0\nv 1e31 0 0\nf 1 2 3 4\n",
    };
    for (size_t i = 0; i < COUNT_OF(texts); i++) {
        for (int ends = 0; ends < 3; ends++) {
            OwnedText text = text_with_line_ends(texts[i], ends);
            assert_unit_square(text_c(&text), "");
        }
    }
}

TEST(short_faces_are_reported)
{
    const char *warning = "scene.yaml:4:18: warning: a.obj: faces of one or two corners are not shown\n";
    assert_unit_square(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2// 3/1 4//1\nf 1 2\nf 3\n", warning);
    assert_unit_square("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\nf 1 2\n", warning);
}

// The same position with other normals and texture coordinates is another vertex. The same of all is not.
TEST(corners_combine_their_parts)
{
    OwnedScene scene = scene_of_obj(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nvt 0.5\nvt 0.25 0.75 9\nvn 0 0 2\nvn 3 0 0\nvn 0 0 1\n"
        "f 1/1/1 2/2/1 3//2\nf 4/1/3 2/2/1 3/1/2\nf 1 2/2/1 3//2\n",
        "");
    const Mesh *mesh = &scene.meshes.items[0];
    assert_int_equal(mesh->vertex_count, 5);
    const uint32_t(*triangles)[3] = (const uint32_t(*)[3])mesh->triangles;
    assert_int_equal(triangles[0][0], triangles[1][0]);
    assert_int_equal(triangles[0][1], triangles[1][1]);
    assert_int_not_equal(triangles[0][2], triangles[1][2]);
    assert_int_equal(triangles[0][2], triangles[2][2]);
    assert_vector(mesh->normals[triangles[0][0]], 0, 0, 1);
    assert_vector(mesh->normals[triangles[0][2]], 1, 0, 0);
    assert_vector(mesh->normals[triangles[2][0]], 0, 0, 0);
    assert_number(mesh->uvs[triangles[0][0]][0], 0.5);
    assert_number(mesh->uvs[triangles[0][0]][1], 0);
    assert_number(mesh->uvs[triangles[0][1]][1], 0.75);
    assert_number(mesh->uvs[triangles[0][2]][0], 0);
}

// More combinations at one position than are compared with each other.
TEST(one_position_may_have_many_normals)
{
    enum { NORMALS = 300 };
    OwnedText text = {0};
    text_appendf(&text, CORNERS);
    for (int i = 0; i < NORMALS; i++)
        text_appendf(&text, "vn %d 1 0\n", i);
    for (int round = 0; round < 2; round++)
        for (int i = 1; i <= NORMALS; i++)
            text_appendf(&text, "f 1//%d 2//1 3//1\n", i);
    OwnedScene scene = scene_of_obj(text_c(&text), "");
    assert_int_equal(scene.meshes.items[0].triangle_count, 2 * NORMALS);
    assert_int_equal(scene.meshes.items[0].vertex_count, NORMALS + 2);
}

static const Material *triangle_material(const Scene *scene, size_t triangle)
{
    const Mesh *mesh = &scene->meshes.items[0];
    return &scene->materials
                .items[mesh->materials ? mesh->materials[triangle] : scene->objects.items[0].material];
}

// Opacity dims what the surface shows. Glass has bright highlights, and its illumination models bend light.
TEST(opacity_is_dissolve)
{
    static const struct {
        const char *lines, *expected;
        double diffuse, specular, transmission, ior;
    } cases[] = {
        {"d 1\n", "", 1, 0.5, 0, 1.5},
        {"d 0\n", "", 0, 0, 1, 1.5},
        {"d 0.25\n", "", 0.25, 0.125, 0.75, 1.5},
        {"Tr 0.75\n", "", 0.25, 0.125, 0.75, 1.5},
        {"Tr 0.75\nd 0.25\n", "", 0.25, 0.125, 0.75, 1.5},
        {"d 0.25\nTr 0.25\n", "a.mtl:6:4: warning: Tr 0.25 contradicts d 0.25 (Tr = 1 - d); d is used\n",
         0.25, 0.125, 0.75, 1.5},
        {"d -halo 0.25\n", "a.mtl:5:3: warning: '-halo' is not supported and is ignored\n", 0.25, 0.125, 0.75,
         1.5},
        {"d 0.25\nillum 2\n", "", 0.25, 0.125, 0.75, 1},
        {"illum 9\nd 0.25\n", "", 0.25, 0.5, 0.75, 1},
        {"illum 7\nd 0.25\n", "a.mtl:5:7: warning: the reflections of illum 3 to 8 are not shown\n", 0.25,
         0.5, 0.75, 1.5},
        {"illum 9\n",
         "a.mtl:5:7: warning: illum 9 is for glass, but d and Tr are missing; the material is opaque\n", 1,
         0.5, 0, 1.5},
    };
    file_write("a.ppm", "P3 1 1 255 255 0 0\n");
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write("a.mtl",
                   formatted("newmtl red\nKd 0.5 0 0\nKs 0.5\nNi 1.5\n%smap_Kd a.ppm\n", cases[i].lines));
        OwnedScene scene =
            scene_of_obj("mtllib a.mtl\nusemtl red\n" CORNERS "vt 0 0\nf 1/1 2/1 3/1\n", cases[i].expected);
        const Material *red = triangle_material(&scene, 0);
        assert_number(red->diffuse.x, 0.5 * cases[i].diffuse);
        assert_number(red->ambient, 0.5 / 3 * cases[i].diffuse);
        assert_number(red->specular.largest, cases[i].specular);
        assert_number(red->transmission.largest, cases[i].transmission);
        assert_number(red->ior, cases[i].ior);
    }
}

TEST(invalid_numbers_become_defaults)
{
    file_write("a.mtl", "newmtl red\nKd -1 0 0\nNi 0\nNs -5\nd 7\nKs 0 -2\nillum 11\nTr -1\n");
    OwnedScene scene =
        scene_of_obj("mtllib a.mtl\nusemtl red\n" FACE,
                     "a.mtl:2:4: warning: 'Kd' must be 0 or more, not -1; the default is used\n"
                     "a.mtl:3:4: warning: 'Ni' must be greater than 0, not 0; the default is used\n"
                     "a.mtl:4:4: warning: 'Ns' must be 0 or more, not -5; the default is used\n"
                     "a.mtl:5:3: warning: 'd' must be from 0 to 1, not 7; the default is used\n"
                     "a.mtl:6:6: warning: 'Ks' must be 0 or more, not -2; the default is used\n"
                     "a.mtl:7:7: warning: 'illum' must be from 0 to 10, not 11; the default is used\n"
                     "a.mtl:8:4: warning: 'Tr' must be from 0 to 1, not -1; the default is used\n");
    const Material *red = triangle_material(&scene, 0);
    assert_vector(red->color, 1, 1, 1);
    assert_number(red->shininess, material_default().shininess);
    assert_number(red->specular.largest, 0);
    assert_number(red->transmission.largest, 0);
}

// Polygons become triangles, and the materials move with them.
TEST(materials_are_those_of_their_faces)
{
    file_write("a.mtl", "Kd 1 0 0\nnewmtl red one \nKd 1 0 0\nKa 9 9 9\nillum 2\nKe 0 0 0\nTf 1 1 1\n");
    file_write("b c.mtl",
               "newmtl gray\nKd 0.5\nKs 0.9 0.3 0\nNs 40\nd 0.25\nNi 1.25\nnewmtl clear\nTr 0.5\nKd 0 2 0\n");
    Scene scene = scene_of_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nmtllib a.mtl\nusemtl red "
                               "one\nf 1 2 3\nf 1 2 3 4\nusemtl gray\n"
                               "usemtl clear\nf 1 2 3\nusemtl gray\nf 1 2 3 4\nf 1 2 3\nmtllib b c.mtl\n",
                               "a.mtl:1:1: warning: a line before the first newmtl is ignored\n");
    static const double reds[] = {1, 1, 1, 1, 1, 0, 0.5, 0.5, 0.5},
                        greens[] = {1, 1, 0, 0, 0, 2, 0.5, 0.5, 0.5};
    assert_int_equal(scene.meshes.items[0].triangle_count, COUNT_OF(reds));
    for (size_t i = 0; i < COUNT_OF(reds); i++) {
        assert_number(triangle_material(&scene, i)->color.x, reds[i]);
        assert_number(triangle_material(&scene, i)->color.y, greens[i]);
    }
    const Material *gray = triangle_material(&scene, 8), *clear = triangle_material(&scene, 5);
    assert_number(gray->specular.largest, 0.1);
    assert_number(gray->shininess, 40);
    assert_number(gray->transmission.largest, 0.75);
    assert_number(gray->ior, 1.25);
    assert_number(clear->transmission.largest, 0.5);
    assert_number(clear->ior, 1);
    assert_number(clear->shininess, material_default().shininess);
    scene_free(&scene);

    // a material in the scene wins
    assert_true(scene_read(&scene, SCENE_OF(", material: {color: [0, 0, 1]}"), ""));
    assert_null(scene.meshes.items[0].materials);
    assert_vector(triangle_material(&scene, 0)->color, 0, 0, 1);
    scene_free(&scene);

    scene = scene_of_obj(FACE, "");
    assert_vector(triangle_material(&scene, 0)->color, 1, 1, 1);
    scene_free(&scene);
}

TEST(missing_materials_are_reported)
{
    file_write("a.mtl", "newmtl red\nKd 1 0 0\n");
    // a library with the mesh's name replaces one that is missing
    Scene scene = scene_of_obj("mtllib missing.mtl\nusemtl red\n" FACE, "");
    assert_vector(triangle_material(&scene, 0)->color, 1, 0, 0);
    scene_free(&scene);
    file_write("d.mtl", "newmtl blue\nKd 0 0 1\n");
    scene = scene_of_obj("mtllib d.mtl a.mtl\nusemtl red\n" FACE "usemtl blue\nf 1 2 3\n", "");
    assert_vector(triangle_material(&scene, 0)->color, 1, 0, 0);
    assert_vector(triangle_material(&scene, 1)->color, 0, 0, 1);
    scene_free(&scene);
    scene = scene_of_obj("mtllib D:\\x\\d.mtl\nusemtl blue\n" FACE,
                         "a.obj:1:8: warning: 'D:\\x\\d.mtl' does not exist; 'd.mtl' is used\n");
    assert_vector(triangle_material(&scene, 0)->color, 0, 0, 1);
    scene_free(&scene);
    // read once, however often it is named
    file_write("a.mtl", "newmtl red\nKd 1 0 0\nPr 1\n");
    scene = scene_of_obj("mtllib a.mtl\nmtllib ./a.mtl\nmtllib missing.mtl\nusemtl red\n" FACE,
                         "a.mtl:3:1: warning: 'Pr' is not supported and is ignored\n");
    scene_free(&scene);
    // what might wait or never end is not read
    unlink("a.mtl");
    assert_int_equal(symlink("/dev/null", "a.mtl"), 0);
    scene = scene_of_obj("mtllib a.mtl\nusemtl red\n" FACE,
                         "a.obj:1:8: warning: the material file 'a.mtl' cannot be read; the default material "
                         "is used\n");
    scene_free(&scene);
    unlink("a.mtl");
    scene = scene_of_obj("mtllib missing.mtl\nusemtl red\n" FACE,
                         "a.obj:1:8: warning: the material file 'missing.mtl' cannot be read; the default "
                         "material is used\n");
    assert_vector(triangle_material(&scene, 0)->color, 1, 1, 1);
    scene_free(&scene);
    scene = scene_of_obj("mtllib d.mtl\nusemtl red\n" FACE "usemtl blue\nf 1 2 3\nusemtl red\nf 1 2 3\n",
                         "a.obj:2:8: warning: 'red' is in no material file; the default material is used\n");
    assert_vector(triangle_material(&scene, 1)->color, 0, 0, 1);
    assert_vector(triangle_material(&scene, 2)->color, 1, 1, 1);
    scene_free(&scene);
}

TEST(the_last_material_of_a_name_is_used)
{
    file_write("a.mtl", "newmtl red\nKd 0.5 0 0\nnewmtl blue\nKd 0 0 1\nnewmtl red\nKd 1 0 0\nnewmtl re\n");
    file_write("b.mtl", "newmtl reddish\nnewmtl blue\nKd 0 0 0.5\n");
    OwnedScene scene =
        scene_of_obj("mtllib a.mtl b.mtl\nusemtl red\n" FACE "usemtl blue\nf 1 2 3\n",
                     "a.mtl:5:8: warning: material 'red' is given twice; the last one is used\n"
                     "b.mtl:2:8: warning: material 'blue' is given twice; the last one is used\n");
    assert_vector(triangle_material(&scene, 0)->color, 1, 0, 0);
    assert_vector(triangle_material(&scene, 1)->color, 0, 0, 0.5);
}

TEST(images_of_materials_are_used)
{
    file_write("a.ppm", "P3 1 1 255 255 0 0\n");
    file_write("a.tga", "no image");
    file_write("a.mtl", "newmtl red\nKd 0.75 0.5 0.25\nmap_Kd ./a.ppm\nnewmtl same\nmap_Kd ./a.ppm\n");
    Scene scene = scene_of_obj(
        "mtllib a.mtl\nusemtl red\n" CORNERS "vt 0 0\nf 1/1 2/1 3/1\nusemtl same\nf 1 2 3\n", "");
    const Material *red = triangle_material(&scene, 0), *same = triangle_material(&scene, 1);
    assert_int_equal(scene.textures.count, 1);
    assert_string_equal(scene.textures.items[0].path, "./a.ppm");
    assert_int_equal(red->image.texture, 1);
    assert_int_equal(same->image.texture, 1);
    assert_vector(red->diffuse, 0.75, 0.5, 0.25);
    assert_number(red->ambient, 0.5);
    assert_vector(same->diffuse, 1, 1, 1);
    scene_free(&scene);

    scene = scene_of_obj(
        "mtllib a.mtl\nusemtl red\n" FACE,
        "scene.yaml:4:18: warning: a.obj: the mesh has no texture coordinates for the image './a.ppm' of "
        "material 'red'; the material's color is used\n");
    assert_int_equal(triangle_material(&scene, 0)->image.texture, 0);
    assert_vector(triangle_material(&scene, 0)->color, 0.75, 0.5, 0.25);
    scene_free(&scene);
    scene = scene_of_obj(
        "mtllib a.mtl\nusemtl red\n" CORNERS "f 1/1 2/2 3/3\n",
        "scene.yaml:4:18: warning: a.obj: the mesh has no texture coordinates for the image './a.ppm' of "
        "material 'red'; the material's color is used\n"
        "a.obj:6:13: warning: a face names texture coordinate 3 (counted from 1), but the file has only 0; "
        "it "
        "is ignored\n");
    assert_int_equal(triangle_material(&scene, 0)->image.texture, 0);
    scene_free(&scene);

    static const struct {
        const char *mtl, *expected;
    } cases[] = {
        {"map_Kd none.png\n", "a.mtl:2:8: warning: cannot read 'none.png': No such file or directory; the "
                              "material's color is used\n"},
        {"map_Kd /dev/null\n",
         "a.mtl:2:8: warning: cannot read '/dev/null': not a regular file; the material's color is used\n"},
        {"map_Kd a.tga\n",
         "a.mtl:2:8: warning: 'a.tga' is not a PNG, JPEG, PPM or EXR; the material's color is used\n"},
        {"map_Kd C:\\Users\\me\\a.ppm\n",
         "a.mtl:2:8: warning: 'C:\\Users\\me\\a.ppm' does not exist; 'a.ppm' is used\n"},
        {"map_Kd /home/me/a.ppm\n", "a.mtl:2:8: warning: '/home/me/a.ppm' does not exist; 'a.ppm' is used\n"},
        {"map_Kd C:/none.png\n", "a.mtl:2:8: warning: cannot read 'C:/none.png': No such file or directory; "
                                 "the material's color is used\n"},
        {"map_Kd -s 2 2 1 -clamp on -bm 3 a.ppm\n",
         "a.mtl:2:8: warning: the options of textures are ignored\n"},
        {"map_bump -bm 3 none.png\n",
         "a.mtl:2:16: warning: cannot read 'none.png': No such file or directory; normals are not tilted\n"},
        {"norm a.ppm\n", ""},
        {"map_Bump -bm 9 a.ppm\nnorm a.ppm\n",
         "a.mtl:3:6: warning: a second normal or height map replaces the first\n"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write("a.mtl", formatted("newmtl red\n%s", cases[i].mtl));
        scene =
            scene_of_obj("mtllib a.mtl\nusemtl red\n" CORNERS "vt 0 0\nf 1/1 2/1 3/1\n", cases[i].expected);
        assert_int_equal(scene.textures.count, strstr(cases[i].mtl, "a.ppm") != NULL);
        scene_free(&scene);
    }
}

// White is 1/50 of the image's width above black. A colored image of map_Bump has normals, as that of norm
// does. -bm multiplies either.
TEST(bumps_are_normals)
{
    const char *ramp = "P3 5 1 255 0 0 0 51 51 51 102 102 102 51 51 51 0 0 0\n",
               *colors = "P3 2 1 255 0 51 102 153 204 255\n";
    for (int i = 0; i < 4; i++) {
        const bool is_ramp = i < 2;
        file_write("a.ppm", is_ramp ? ramp : colors);
        file_write("a.mtl", formatted("newmtl red\n%s%s -bm -2.5 a.ppm\n", i == 3 ? "bump -bm 9 a.ppm\n" : "",
                                      i % 2    ? "norm"
                                      : i == 0 ? "map_Bump"
                                               : "bump"));
        OwnedScene scene = scene_of_obj("mtllib a.mtl\nusemtl red\n" CORNERS "vt 0 0\nf 1/1 2/1 3/1\n",
                                        i == 3 ? "a.mtl:3:6: warning: a second normal or height map "
                                                 "replaces the first\n"
                                               : "");
        const Material *red = triangle_material(&scene, 0);
        assert_int_equal(red->normal_map.texture, 1);
        assert_number(red->normal_map.strength, -2.5);
        assert_int_equal(scene.textures.items[0].content, i % 2 ? TEXTURE_NORMALS : TEXTURE_BUMPS);
        const float *values = scene.textures.items[0].image.values;
        const double slope = 0.2 * 5 / 50, length = sqrt(1 + slope * slope);
        const Vector3 rising = {0.5 - 0.5 * slope / length, 0.5, 0.5 + 0.5 / length}, gray = {0.2, 0.2, 0.2},
                      first = {0, 0.2, 0.4};
        const Vector3 expected = i == 0 ? rising : i == 1 ? gray : first;
        const size_t at = is_ramp ? 3 : 0;
        const Vector3 got = {values[at], values[at + 1], values[at + 2]};
        assert_true(vector_length(vector_subtract(got, expected)) < 1e-6);
    }
}

TEST(what_is_not_used_is_reported_once)
{
    file_write(
        "a.mtl",
        "newmtl red\nKd inf 1e39 nan\nKs 0 x 0\nNs 1e39\nd\nNi 1e39\nKe -1 0 0\nTf xyz 1\nmap_refl b.png\n"
        "newmtl more\nTf 1 0 0\nmap_refl b.png\nPr 0.5\n");
    OwnedScene scene = scene_of_obj(
        "mtllib a.mtl\nusemtl red\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 abc\nvt nan 0\nvt 0 1e31\nvn 0 inf "
        "0 abc\n"
        "f 1/1/1 2/2/1 3/1/1\nl 1 2\np 1\nl 2 3\ncstype bezier\n",
        "scene.yaml:4:18: warning: a.obj: 2 texture coordinates are not finite or too large "
        "and are read as 0\n"
        "scene.yaml:4:18: warning: a.obj: 1 normal is not finite or too large and is ignored\n"
        "a.mtl:2:4: warning: 'Kd' must be a number of at most 1e+30 in magnitude; the default is used\n"
        "a.mtl:3:6: warning: 'Ks' must be a number of at most 1e+30 in magnitude; the default is used\n"
        "a.mtl:4:4: warning: 'Ns' must be a number of at most 1e+30 in magnitude; the default is used\n"
        "a.mtl:5:2: warning: 'd' must be a number of at most 1e+30 in magnitude; the default is used\n"
        "a.mtl:6:4: warning: 'Ni' must be a number of at most 1e+30 in magnitude; the default is used\n"
        "a.mtl:7:4: warning: 'Ke' must be 0 or more, not -1; the default is used\n"
        "a.mtl:8:4: warning: 'Tf' must be a number of at most 1e+30 in magnitude; the default is used\n"
        "a.mtl:9:1: warning: 'map_refl' is not supported and is ignored\n"
        "a.mtl:13:1: warning: 'Pr' is not supported and is ignored\n"
        "a.obj:3:11: warning: vertex colors are ignored; the material's color is used\n"
        "a.obj:5:9: warning: words after the last number of a row are ignored\n"
        "a.obj:10:1: warning: 'l' is not supported and is ignored\n"
        "a.obj:11:1: warning: 'p' is not supported and is ignored\n"
        "a.obj:13:1: warning: 'cstype' is not supported and is ignored\n");
    const Material *red = triangle_material(&scene, 0);
    assert_vector(red->color, 1, 1, 1);
    assert_number(red->specular.largest, 0);
    assert_number(red->shininess, material_default().shininess);
    assert_number(red->transmission.largest, 0);
    assert_number(red->ior, 1);
}

// Faces are read without texture coordinates and normals that the file lacks.
TEST(missing_parts_are_dropped)
{
    static const struct {
        const char *obj, *expected;
        bool has_uvs, has_normals;
    } cases[] = {
        {CORNERS "vn 0 0 1\nf 1//1 2//1 3//2\nf 1//1 2//3 3//2\n",
         "a.obj:6:11: warning: a face names normal 3 (counted from 1), but the file has only 1; it is "
         "ignored\n",
         false, true},
        {CORNERS "vn 0 0 1\nf 1//1 2//0 3//-2\n",
         "a.obj:5:11: warning: a face names normal 0, but the file has only 1 before the face; it is "
         "ignored\n",
         false, true},
        {CORNERS "vn 0 0 1\nf 1//0 2//0 3//0\n",
         "a.obj:5:6: warning: a face names normal 0, but the file has only 1 before the face; it is "
         "ignored\n",
         false, false},
        {CORNERS "f 1/1 2/2 3/99999999999\n",
         "a.obj:4:9: warning: a face names texture coordinate 2 (counted from 1), but the file has only 0; "
         "it is ignored\n"
         "a.obj:4:13: warning: a face names texture coordinate 99999999999, but the file has only 0 before "
         "the face; it is ignored\n",
         false, false},
        {CORNERS "vt 0 0\nf 1/1 2/2 3/1\n",
         "a.obj:5:9: warning: a face names texture coordinate 2 (counted from 1), but the file has only 1; "
         "it is ignored\n",
         true, false},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        OwnedScene scene = scene_of_obj(cases[i].obj, cases[i].expected);
        const Mesh *mesh = &scene.meshes.items[0];
        assert_int_equal(mesh->uvs != NULL, cases[i].has_uvs);
        assert_int_equal(mesh->normals != NULL, cases[i].has_normals);
        assert_vector(corner_of(mesh, 1), 1, 0, 0);
        if (mesh->normals) assert_vector(mesh->normals[mesh->triangles[0][0]], 0, 0, 1);
        if (mesh->normals) assert_vector(mesh->normals[mesh->triangles[0][2]], 0, 0, 0);
    }
}

// Each warning about a file is printed once, however often a scene names the file.
TEST(files_have_each_message_once)
{
    Text scene_text = {0}, obj = {0}, expected = {0};
    text_appendf(&scene_text, SCENE_OF(""));
    for (int i = 0; i < 29; i++)
        text_appendf(&scene_text, "  - mesh: {file: a.obj}\n");
    text_appendf(&obj, "mtllib a.mtl\nusemtl red\n" FACE "f 1 1 1\n");
    text_appendf(&expected, "scene.yaml:4:18: warning: a.obj: 1 triangle has no area and is never hit\n"
                            "a.mtl:2:4: warning: 'Kd' must be 0 or more, not -1; the default is used\n");
    for (int i = 0; i < 25; i++) {
        text_appendf(&obj, "word%d\n", i);
        if (i < 18)
            text_appendf(&expected, "a.obj:%d:1: warning: 'word%d' is not supported and is ignored\n", 8 + i,
                         i);
    }
    text_appendf(&expected, "scene.yaml:warning: 7 more warnings are not shown\n");
    file_write("a.mtl", "newmtl red\nKd -1\n");
    file_write("a.obj", text_c(&obj));
    Scene scene;
    assert_true(scene_read(&scene, text_c(&scene_text), text_c(&expected)));
    assert_int_equal(scene.objects.count, 30);
    scene_free(&scene);
    text_free(&expected);

    file_write("a.obj", CORNERS "f 1 2 4\n");
    text_appendf(&expected,
                 "a.obj:4:7: error: a face names vertex 4 (counted from 1), but the file has only 3\n");
    assert_false(scene_read(&scene, text_c(&scene_text), text_c(&expected)));
    unlink("a.obj");
    text_free(&expected);
    text_appendf(&expected,
                 "scene.yaml:4:18: error: a.obj: cannot read the file: No such file or directory\n");
    assert_false(scene_read(&scene, text_c(&scene_text), text_c(&expected)));
    text_free(&expected);
    text_free(&obj);
    text_free(&scene_text);
}

// The faces have nine times the most corners of a face, which would take half a minute to cut.
TEST(many_large_polygons_are_refused)
{
    OwnedText text = {0};
    text_appendf(&text, CORNERS);
    for (int face = 0; face < 9; face++) {
        text_appendf(&text, "f");
        for (int i = 0; i < 16384; i++)
            text_append(&text, " 1", 2);
        text_append(&text, "\n", 1);
    }
    Scene scene;
    file_write("a.obj", text_c(&text));
    assert_false(scene_read(
        &scene, SCENE_OF(""),
        "scene.yaml:4:18: error: a.obj: the polygons have too many corners; the sum of their squared "
        "counts is 2415919104, but at most 2147483648 is supported\n"));
}

TEST(faults_have_their_place)
{
    static const struct {
        const char *obj, *expected;
    } cases[] = {
        {"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n",
         "a.obj:3:5: error: a coordinate must be a number of at most 1e+30 in magnitude, not 'nan'\n"},
        {"v 0 0 0\nv 1e35 0 0\nv 0 1 0\nf 1 2 3\n",
         "a.obj:2:3: error: a coordinate must be a number of at most 1e+30 in magnitude, not '1e35'\n"},
        {"v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "a.obj:2:6: error: a coordinate of the vertex is missing\n"},
        {"v nan 0 0\nv 0 0 0\nv 1 0x1 0\nv 0 1 0\nf -3 -2 -1\n",
         "a.obj:3:5: error: a coordinate must be a number of at most 1e+30 in magnitude, not '0x1'\n"},
        {"v 0 0 0 0\n", "a.obj:1:10: error: the fourth number of a vertex must not be zero\n"},
        {CORNERS "f 1 2 4\n",
         "a.obj:4:7: error: a face names vertex 4 (counted from 1), but the file has only 3\n"},
        {CORNERS "f 1 2 0\n",
         "a.obj:4:7: error: a face names vertex 0; indices count from 1, or backward from -1\n"},
        {CORNERS "f -4 2 3\n",
         "a.obj:4:3: error: a face names vertex -4, but the file has only 3 before the face\n"},
        {CORNERS "f 1 2 9999999999\n",
         "a.obj:4:7: error: a face names vertex 9999999999, but the file has only 3 before the face\n"},
        {CORNERS "f 1 2 99999999999\n",
         "a.obj:4:7: error: a face names vertex 99999999999, but the file has only 3 before the face\n"},
        {CORNERS "f 1 2 1000000000000000000\n",
         "a.obj:4:7: error: '1000000000000000000' is not a corner of a face\n"},
        {CORNERS "f 1 2 4294967295\n",
         "a.obj:4:7: error: a face names vertex 4294967295 (counted from 1), but the file has only 3\n"},
        {CORNERS "f 1 2 x\n", "a.obj:4:7: error: 'x' is not a corner of a face\n"},
        {CORNERS "f 1 2 3/1/1/1\n", "a.obj:4:7: error: '3/1/1/1' is not a corner of a face\n"},
        {CORNERS "f 1 2 3.5\n", "a.obj:4:7: error: '3.5' is not a corner of a face\n"},
        {CORNERS "f 1 2 -\n", "a.obj:4:7: error: '-' is not a corner of a face\n"},
        {CORNERS "f 1 2\n", "scene.yaml:4:18: warning: a.obj: faces of one or two corners are not shown\n"
                            "scene.yaml:4:18: error: a.obj: the mesh has no triangles\n"},
        {"", "scene.yaml:4:18: error: a.obj: the mesh has no triangles\n"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        Scene scene;
        file_write("a.obj", cases[i].obj);
        assert_false(scene_read(&scene, SCENE_OF(""), cases[i].expected));
    }
    file_write_bytes("a.obj", "v 0\0", 4);
    Scene scene;
    assert_false(scene_read(&scene, SCENE_OF(""), "a.obj:1:4: error: the file contains a NUL character\n"));
    OwnedText text = {0};
    text_appendf(&text, CORNERS "f");
    for (int i = 0; i <= 16384; i++)
        text_appendf(&text, " 1");
    file_write("a.obj", text_c(&text));
    assert_false(scene_read(&scene, SCENE_OF(""),
                            "a.obj:4:2: error: a face has 16385 corners; at most 16384 are supported\n"));
}

typedef struct {
    Stage *stage;
    Text seen;
} Progress;

static void progress_note(void *context, const char *path)
{
    Progress *progress = context;
    double seconds;
    text_appendf(&progress->seen, "%s: ", path);
    stage_write(progress->stage, &progress->seen, &seconds);
}

// The material library is read last.
TEST(progress)
{
    file_write("a.obj", "mtllib missing.mtl\nusemtl red\n" CORNERS "f 1 2 3\nf 1 2 3\n");
    const char text[] = SCENE_OF("") "  - sphere: {center: [0, 0, 0], radius: 1}\n";
    const Source source = {.file = "scene.yaml", .bytes = text, .length = strlen(text)};
    Progress progress = {.stage = stage_open(false)};
    const SceneOptions options = {.file_named = progress_note, .context = &progress, .stage = progress.stage};
    OwnedMessageList messages = {0};
    OwnedScene scene;
    assert_true(scene_read_yaml(&scene, &source, &options, &messages));
    text_appendf(&progress.seen, ", ");
    progress_note(&progress, "then");
    assert_string_equal(text_c(&progress.seen),
                        "a.obj: reading the objects of scene.yaml 0%"
                        "missing.mtl: reading a.obj 89%"
                        "a.mtl: reading a.obj 89%, then: reading the objects of scene.yaml 50%");
    text_free(&progress.seen);
    stage_close(progress.stage);
}

TEST_MAIN(folder_open, folder_close)
