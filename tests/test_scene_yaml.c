// Reads scenes in the native format. Tests every key's value, every default, warnings, and the scene that is
// read.
#include "host/import/load.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

#include <sys/stat.h>

#define CAMERA "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"
#define LIT    CAMERA "lights:\n  - point: {position: [0, 9, 0]}\n"
#define SPHERE "objects:\n  - sphere: {center: [0, 0, 0], radius: 1}\n"

static int set_up(void **state)
{
    (void)state;
    return complete_open("tests/scenes/complete.yaml");
}

TEST(scene_keys)
{
    assert_vector(complete.camera.position, 0, 1.5, -6);
    assert_vector(complete.camera.look_at, 0, 1, 0);
    assert_vector(complete.camera.up, 0, 1, 0.5);
    assert_int_equal(complete.camera.field_axis, FIELD_VERTICAL);
    assert_number(complete.camera.half_tangent, tan(20 * M_PI / 180));
    assert_number(complete.camera.frame_aspect, 0);
    assert_vector(complete.background, 0.2, 0.3, 0.5);
    assert_vector(complete.ambient, 0.1, 0.2, 0.3);
    assert_int_equal(complete.color_meaning, COLORS_LINEAR);
    assert_int_equal(complete.width, 0);
    assert_int_equal(complete.height, 0);
}

TEST(lights)
{
    assert_int_equal(complete.lights.count, 4);
    const Light *point = &complete.lights.items[0], *directional = point + 1, *spot = point + 2,
                *other = point + 3;
    assert_int_equal(point->type, LIGHT_POINT);
    assert_vector(point->position, 5, 8, -5);
    assert_vector(point->color, 0.5, 0.25, 0.125); // times intensity
    assert_int_equal(directional->type, LIGHT_DIRECTIONAL);
    assert_vector(directional->direction, 0, -1, 0.2);
    assert_vector(directional->color, 1, 1, 1);
    assert_int_equal(spot->type, LIGHT_SPOT);
    assert_vector(spot->position, 0, 5, 0);
    assert_vector(spot->direction, 0, -4, 0);
    assert_number(spot->spot.half_angle, 30);
    assert_number(spot->spot.penumbra, 5);
    assert_vector(other->direction, 0, -2, 0);
    assert_vector(other->color, 2, 2, 2);
    assert_number(other->spot.penumbra, 0);
}

TEST(materials)
{
    assert_int_equal(complete.materials.count, 5);
    assert_int_equal(complete.material_names.count, 5);
    assert_string_equal(complete.material_names.items[0], "red");
    assert_string_equal(complete.material_names.items[1], "tiles");
    assert_string_equal(complete.material_names.items[2], "");
    const Material *red = &complete.materials.items[0], *tiles = red + 1, *plain = red + 2, *blue = red + 3;
    assert_vector(red->color, 0.8, 0.1, 0.1);
    assert_number(red->ambient, 0.9);
    assert_vector(red->diffuse, 0.7, 0.7, 0.7);
    assert_number(red->specular.largest, 0.3);
    assert_number(red->shininess, 64);
    assert_number(red->reflection.largest, 0.25);
    assert_number(red->transmission.largest, 0.5);
    assert_number(red->ior, 1.33);
    assert_false(red->checker.is_on);
    assert_true(tiles->checker.is_on);
    assert_vector(tiles->checker.colors[0], 1, 1, 1);
    assert_vector(tiles->checker.colors[1], 0, 0.5, 0);
    assert_number(tiles->checker.size, 2);
    assert_vector(tiles->diffuse, 0.9, 0.8, 0.7);
    assert_vector(blue->color, 0, 0, 1);
    Material defaults = material_default();
    assert_vector(plain->color, 1, 1, 1);
    assert_number(plain->ambient, 1);
    assert_vector(plain->diffuse, 1, 1, 1);
    assert_number(plain->specular.largest, 0);
    assert_number(plain->shininess, 32);
    assert_number(plain->reflection.largest, 0);
    assert_number(plain->transmission.largest, 0);
    assert_number(plain->ior, 1.5);
    assert_number(defaults.checker.size, 1);
}

TEST(tints)
{
    OwnedScene scene =
        scene_of_text("a.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\n"
                                "materials:\n"
                                "  gold: {reflection: [0.5, 0.4, 0], specular: [1, 2, 4], fresnel: true}\n"
                                "  gray: {reflection: [0.5, 0.5, 0.5], specular: 2}\n"
                                "  lamp: {emission: [30, 2.5, 0]}\n"
                                "  ink: {absorption: {color: [1, 0.5, 0], distance: 2}}\n"
                                "  tea: {absorption: {color: 0.25}, transmission: [0.2, 0.5, 1]}\n"
                                "  gilt: {conductor: gold}\n"
                                "  lead: {ambient: 2, conductor: {n: 2, k: [1, 3, 4]}, reflection: 0.5}\n");
    const Material *gold = &scene.materials.items[0], *gray = gold + 1;
    assert_number(gold->reflection.largest, 0.5);
    assert_vector(gold->reflection.tint, 1, 0.8, 0);
    assert_number(gold->specular.largest, 4);
    assert_vector(gold->specular.tint, 0.25, 0.5, 1);
    assert_true(gold->fresnel);
    assert_number(gray->reflection.largest, 0.5);
    assert_vector(gray->reflection.tint, 0, 0, 0);
    assert_vector(tint_factors(gray->reflection.tint), 1, 1, 1);
    assert_number(gray->specular.largest, 2);
    assert_false(gray->fresnel);
    assert_vector(gray->emission, 0, 0, 0);
    assert_vector(gray[1].emission, 30, 2.5, 0);
    assert_vector(gray[1].absorption, 0, 0, 0);
    assert_vector(gray[2].absorption, 0, log(2) / 2, log(1e6) / 2);
    assert_vector(gray[3].absorption, log(4), log(4), log(4));
    assert_number(gray[3].transmission.largest, 1);
    assert_vector(gray[3].transmission.tint, 0.2, 0.5, 1);
    assert_vector(material_passing(&gray[3]), 0.2, 0.5, 1);
    assert_vector(material_passing(&gray[2]), 0, 0, 0);
    assert_vector(gray->conductor.n, 0, 0, 0);
    assert_vector(gray[4].conductor.n, 0.15557, 0.42415, 1.3831);
    assert_vector(gray[4].conductor.k, 3.6024, 2.4721, 1.9155);
    assert_number(gray[4].reflection.largest, 1);
    assert_number(gray[4].ambient, 0);
    assert_vector(gray[4].diffuse, 0, 0, 0);
    assert_vector(gray[5].conductor.n, 2, 2, 2);
    assert_vector(gray[5].conductor.k, 1, 3, 4);
    assert_number(gray[5].reflection.largest, 0.5);
    assert_number(gray[5].ambient, 2);
}

TEST(energy)
{
    assert_messages(
        "a.yaml",
        "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\n"
        "materials:\n"
        "  a: {reflection: 0.1, transmission: 0.9}\n"
        "  b: {transmission: 0.9, reflection: [0.2, 0, 0]}\n"
        "  c: {transmission: 1, reflection: 0.04, fresnel: true}\n",
        "4:38: warning: reflection 0.2 and transmission 0.9 exceed 1 together, so the surface adds "
        "light\n"
        "5:36: warning: reflection 0.04 and transmission 1 exceed 1 together, so the surface adds "
        "light; by 'fresnel' it reflects a part of its transmission\n"
        "warning: the scene has no objects, so only the background is shown\nwarning: the scene has no "
        "lights, so only ambient "
        "light and emission are shown\n");
}

TEST(shapes)
{
    static const Object expected[] = {
        {SHAPE_SPHERE, .as.sphere = {{0, 1, 0}, 1}},
        {SHAPE_PLANE, .as.plane = {{0, -1, 0}, {0, 2, 0}}},
        {SHAPE_DISC, .as.disc = {{1, 2, 3}, {0, 0, -1}, 0.5}},
        {SHAPE_BOX, .as.box = {{-1, -2, -3}, {1, 2, 3}}},
        {SHAPE_CYLINDER, .as.cylinder = {{1, 0, 0}, {0, 3, 0}, 0.25, .finite = true}},
        {SHAPE_CYLINDER, .as.cylinder = {{2, 0, 0}, {0, 3, 0}, 0.25, .finite = true, .caps = true}},
        {SHAPE_CYLINDER, .as.cylinder = {{3, 0, 0}, {0, 0, 5}, 0.75}},
        {SHAPE_CONE, .as.cone = {{0, 0, 1}, {0, 4, 0}, {1, 0.5}, .finite = true, .caps = true}},
        {SHAPE_CONE, .as.cone = {{0, 0, 1}, {0, 4, 0}, {1, 0}, .finite = true}},
        {SHAPE_CONE, .as.cone = {{0, 0, 2}, {3, 0, 0}, .slope = 1}},
        {SHAPE_TRIANGLE, .as.triangle.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
        {SHAPE_TRIANGLE,
         .as.triangle = {{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0, 0, -1}, {0, 1, -1}, {1, 0, -1}}, true}},
    };
    // the default material is the third, and an alias of an inline material is a separate one
    static const uint32_t materials[] = {0, 1, 2, 3, 2, 2, 4, 2, 2, 2, 2, 0};
    assert_int_equal(complete.objects.count, COUNT_OF(expected));
    check_shapes(complete.objects.items, expected, COUNT_OF(expected));
    for (size_t i = 0; i < COUNT_OF(materials); i++)
        assert_int_equal(complete.objects.items[i].material, materials[i]);
    assert_number(complete.materials.items[4].shininess, 64);
}

TEST(defaults)
{
    OwnedScene scene = scene_of_text("s.yaml", CAMERA);
    assert_vector(scene.camera.up, 0, 1, 0);
    assert_number(scene.camera.half_tangent, tan(25 * M_PI / 180));
    assert_vector(scene.background, 0, 0, 0);
    assert_vector(scene.ambient, 0, 0, 0);
    assert_int_equal(scene.lights.count, 0);
    assert_int_equal(scene.materials.count, 0);
    assert_int_equal(scene.objects.count, 0);
}

TEST(focal_length)
{
    OwnedScene scene = scene_of_text(
        "s.yaml", "camera: {position: [0, 0, 0], look_at: [0, 0, 1], focal_length: 2, frame: [3, 2], "
                  "shift: [-0.5, 0.25]}\n");
    assert_int_equal(scene.camera.field_axis, FIELD_HORIZONTAL);
    assert_number(scene.camera.half_tangent, 0.75);
    assert_number(scene.camera.frame_aspect, 1.5);
    assert_true(scene.camera.shift[0] == -0.5 && scene.camera.shift[1] == 0.25);
}

TEST(block_style_and_number_forms)
{
    OwnedScene scene =
        scene_of_text("s.yaml", "\xEF\xBB\xBF---\r\n" // byte order mark, document start, CRLF
                                "\"camera\":\r\n  position:\r\n    - +1.\r\n    - -.5\r\n    - 25e-1\r\n"
                                "  look_at: ['0', \"0\", 1E+2]\r\n...\r\n");
    assert_vector(scene.camera.position, 1, -0.5, 2.5);
    assert_vector(scene.camera.look_at, 0, 0, 100);
}

TEST(names_in_every_style)
{
    char name[400 + 1] = {0}; // longer than one read of a scalar
    memset(name, 'n', sizeof name - 1);
    OwnedScene scene = scene_of_text(
        "s.yaml",
        formatted(CAMERA
                  "materials:\n  two words: {}\n  'it''s': {}\n  \"caf\\u00e9\\t\\\"x\\\"\": {}\n  %s: {}\n"
                  "  ? 'it''s\n    folded'\n  : {}\n",
                  name));
    assert_string_equal(scene.material_names.items[0], "two words");
    assert_string_equal(scene.material_names.items[1], "it's");
    assert_string_equal(scene.material_names.items[2], "caf\xC3\xA9\t\"x\"");
    assert_string_equal(scene.material_names.items[3], name);
    assert_string_equal(scene.material_names.items[4], "it's folded");
}

TEST(tiny_numbers_are_zero)
{
    OwnedScene scene = scene_of_text("s.yaml", CAMERA "background: [1e-31, 1e-999, 1e-30]\n");
    assert_true(scene.background.x == 0 && scene.background.y == 0 && scene.background.z == 1e-30);
}

// The linear values of sRGB are those of Python's decimal module, rounded to float.
TEST(colors)
{
    const double half = 0.21586050011389926F, dark = 0.0030352698354883752F, third = 0.033104766570885055F;
    OwnedScene scene =
        scene_of_text("s.yaml", CAMERA "background: '#FF800a'\n"
                                       "ambient: 0.1\n"
                                       "lights:\n"
                                       "  - point: {position: [0, 9, 0], color: Gray, intensity: 4}\n"
                                       "  - point: {position: [0, 9, 0], color: 20}\n"
                                       "  - point: {position: [0, 9, 0], color: [255.0, 255, 255]}\n"
                                       "materials:\n"
                                       "  a: {color: \"#3f0\", diffuse: navy}\n"
                                       "  b: {color: 1, diffuse: [2, 1, 0]}\n"
                                       "  c: {checker: {colors: [lime, 0.25]}}\n"
                                       "  d: {color: [1.5, 0, 0]}\n");
    assert_vector(scene.background, 1, half, dark);
    assert_vector(scene.ambient, 0.1, 0.1, 0.1);
    assert_vector(scene.lights.items[0].color, 4 * half, 4 * half, 4 * half);
    assert_vector(scene.lights.items[1].color, 20, 20, 20);
    assert_vector(scene.lights.items[2].color, 255, 255, 255);
    const Material *materials = scene.materials.items;
    assert_vector(materials[0].color, third, 1, 0);
    assert_vector(materials[0].diffuse, 0, 0, half);
    assert_vector(materials[1].color, 1, 1, 1);
    assert_vector(materials[1].diffuse, 2, 1, 0);
    assert_vector(materials[2].checker.colors[0], 0, 1, 0);
    assert_vector(materials[2].checker.colors[1], 0.25, 0.25, 0.25);
    assert_vector(materials[3].color, 1.5, 0, 0);
}

static Scene scene_of_set(const char *text, const char *const *overrides, size_t count)
{
    OwnedText source = {0};
    text_appendf(&source, "%s", text);
    OwnedMessageList messages = {0};
    Scene scene;
    assert_true(scene_read_set(&scene, "s.yaml", &source, overrides, count, &messages));
    return scene;
}

#define SET(text, ...)                                                                                       \
    scene_of_set(text, (const char *const[]){__VA_ARGS__},                                                   \
                 sizeof(const char *[]){__VA_ARGS__} / sizeof(char *))

TEST(values_are_set)
{
    OwnedScene scene =
        SET(LIT SPHERE, "camera.fov=60", "ambient=#f00", "background= 0.5", "camera.fov=40",
            "objects[0].sphere.radius=3", "lights[0].point={position: [1, 2, 3], color: red}",
            "materials={red: {color: red}, 'a.b': {}}", "materials.'a.b'.color=[0, 0.5, 0]",
            "objects[0].sphere.material=red", "objects[1]=plane: {point: [0, -1, 0], normal: [0, 1, 0]}",
            "objects[1].plane.material=\"a.b\"", "lights[1]={directional: {direction: [0, -1, 0]}}");
    assert_number(scene.camera.half_tangent, tan(20 * M_PI / 180));
    assert_vector(scene.ambient, 1, 0, 0);
    assert_vector(scene.background, 0.5, 0.5, 0.5);
    assert_int_equal(scene.objects.count, 2);
    assert_number(scene.objects.items[0].as.sphere.radius, 3);
    assert_int_equal(scene.objects.items[0].line, 5);
    assert_int_equal(scene.objects.items[1].line, 0);
    assert_int_equal(scene.lights.count, 2);
    assert_vector(scene.lights.items[0].position, 1, 2, 3);
    assert_vector(scene.materials.items[scene.objects.items[0].material].color, 1, 0, 0);
    assert_vector(scene.materials.items[scene.objects.items[1].material].color, 0, 0.5, 0);
}

TEST(values_are_removed)
{
    OwnedScene scene =
        SET("camera: {position: [0, 0, -5], look_at: [0, 0, 0], focal_length: 1, frame: [2, 1]}\n"
            "lights: [{point: {position: [0, 9, 0]}}]\n"
            "objects: [{sphere: {center: [0, 0, 0], radius: 1}}, {sphere: {center: [1, 0, 0], radius: 2}},\n"
            "  {sphere: {center: [0, 0, 0], radius: 3}}]\n",
            "camera.frame=", "camera.focal_length=", "camera.fov=40",
            "objects[1]=", "objects[0]= ", "lights=", "objects[1]={box: {min: [0, 0, 0], max: [1, 1, 1]}}");
    assert_int_equal(scene.camera.field_axis, FIELD_VERTICAL);
    assert_int_equal(scene.objects.count, 2);
    assert_number(scene.objects.items[0].as.sphere.radius, 3);
    assert_int_equal(scene.objects.items[1].type, SHAPE_BOX);
    assert_int_equal(scene.lights.count, 0);
}

// A value that is set through one of several names of the same nodes changes only under that name.
TEST(aliases_keep_what_is_set_elsewhere)
{
    OwnedScene scene =
        SET(LIT "materials:\n  a: &a {color: [0, 0, 1], ior: 2}\n  b: *a\n  c: *a\n"
                "objects:\n  - &s sphere: {center: [0, 0, 0], radius: 1}\n"
                "  - sphere: &t {center: [9, 9, 9], radius: 1}\n  - sphere: *t\n  - sphere: *t\n",
            "materials.b.color=red", "materials.a.ior=3", "materials.c.diffuse=0.5",
            "materials.b.ior=", "objects[2].sphere.center[1]=5", "objects[1].sphere.radius=7",
            "objects[3].sphere={center: &u [1, 2, 3], radius: 4, material: {diffuse: *u}}");
    const Material *materials = scene.materials.items;
    assert_vector(materials[0].color, 0, 0, 1);
    assert_vector(materials[1].color, 1, 0, 0);
    assert_vector(materials[2].color, 0, 0, 1);
    assert_number(materials[0].ior, 3);
    assert_number(materials[1].ior, 1.5);
    assert_number(materials[2].ior, 2);
    assert_number(materials[1].diffuse.x, 1);
    assert_number(materials[2].diffuse.x, 0.5);
    const Object *objects = scene.objects.items;
    assert_vector(objects[1].as.sphere.center, 9, 9, 9);
    assert_vector(objects[2].as.sphere.center, 9, 5, 9);
    assert_number(objects[1].as.sphere.radius, 7);
    assert_number(objects[2].as.sphere.radius, 1);
    assert_vector(materials[objects[3].material].diffuse, 1, 2, 3);
}

// A message about an image that was set points into the override's text.
TEST(textures_that_are_set_have_a_place)
{
    static const char *const overrides[] = {"ambient=1", "objects[0].sphere.material={image: lost.png}"};
    OwnedText source = {0}, described = {0};
    text_append(&source, LIT SPHERE, strlen(LIT SPHERE));
    OwnedMessageList messages = {0};
    Scene scene;
    assert_false(scene_read_set(&scene, "s.yaml", &source, overrides, 2, &messages));
    assert_int_equal(messages.count, 1);
    message_describe(&described, &messages.items[0]);
    assert_string_equal(text_c(&described),
                        "--set:1:36: error: cannot read 'lost.png': No such file or directory\n");
    assert_string_equal(messages.items[0].source_line, overrides[1]);
}

// Writes an image of one pixel, 1 in the default layer and 2 in `diffuse`.
static void write_layered_image(const char *path)
{
    static const ImageLayer diffuse = {"diffuse.R,diffuse.G,diffuse.B", 3, 'f'};
    static const float colors[][3] = {{1, 1, 1}, {2, 2, 2}};
    const ImageHeader header = {IMAGE_EXR,       1, 1, 3, .npy_type = 'f', .bits = 16, .layers = &diffuse,
                                .layer_count = 1};
    MessageList messages = {0};
    ImageWriter *writer = image_writer_open(path, &header, &messages);
    assert_non_null(writer);
    assert_true(image_writer_layer_rows(writer, (const void *const[]){colors[0], colors[1]}, 1, &messages));
    assert_true(image_writer_commit(writer, &messages));
}

TEST_WITH(layers_of_images, folder_open, folder_close)
{
    assert_int_equal(mkdir("scenes", 0700), 0);
    write_layered_image("scenes/a.exr");
    OwnedScene scene =
        scene_of_text("scenes/s.yaml", CAMERA "materials:\n"
                                              "  a: {image: {file: a.exr, layer: diffuse}}\n"
                                              "  b: {image: a.exr}\n"
                                              "  c: {image: {file: a.exr}}\n"
                                              "  d: {image: {layer: diffuse, file: a.exr}, diffuse: 0.5}\n");
    assert_int_equal(scene.textures.count, 2);
    assert_string_equal(scene.textures.items[0].path, "scenes/a.exr");
    assert_string_equal(scene.textures.items[0].layer, "diffuse");
    assert_null(scene.textures.items[1].layer);
    for (size_t i = 0; i < 2; i++)
        assert_number((double)scene.textures.items[i].image.values[0], i == 0 ? 2 : 1);
    static const uint32_t textures[] = {1, 2, 2, 1};
    for (size_t i = 0; i < 4; i++)
        assert_int_equal(scene.materials.items[i].image.texture, textures[i]);
}

TEST(materials_may_follow_objects)
{
    OwnedScene scene =
        scene_of_text("s.yaml", LIT "objects:\n  - sphere: {center: [0, 0, 0], radius: 1, material: b}\n"
                                    "materials: {a: {}, b: {shininess: 7}}\n");
    assert_number(scene.materials.items[scene.objects.items[0].material].shininess, 7);
}

TEST(the_largest_frame_rate_is_allowed)
{
    OwnedScene scene = scene_of_text("s.yaml", LIT SPHERE "fps: 1000\n");
    assert_number(scene.animation.frame_rate, 1000);
}

TEST(warnings)
{
    assert_messages("s.yaml", LIT SPHERE, "");
    assert_messages("s.yaml", CAMERA SPHERE,
                    "warning: the scene has no lights, so only ambient light and emission are shown\n");
    assert_messages("s.yaml", LIT, "warning: the scene has no objects, so only the background is shown\n");
    assert_messages("s.yaml", LIT "objects:\n  - triangle: {vertices: [[0, 0, 0], [1, 1, 1], [2, 2, 2]]}\n",
                    "5:15: warning: the triangle has no area and is never hit\n");
}

// Reads a scene of each format.
TEST(a_failed_scene_is_empty)
{
    static const char *const cases[][3] = {
        {"s.yaml", LIT SPHERE "purple: 1\n", "purple: 1"},
        {"s.rt", "C 0,0,0 0,0,1 60\nL 0,0,0 1\nsp 0,0,0 1 1,1,1\nxx\n", "xx"},
        {"s.cfg", "=>light :\n{\n position 0 0 0\n intensity 1 1 1\n}\n=>torus :\n{\n}\n", "=>torus :"},
        {"s.nff", "v\nfrom 0 0 0\nat 0 0 1\nup 0 1 0\nangle 9\nl 0 9 0\nf 1 1 1 1 0 1 0 0\ns 0 0 0 1\nt 1\n",
         "t 1"},
        {"s.dat", "begin_scene\nresolution 8 8\ndirectional_light direction 0 0 1 color 1 1 1\nteapot\n",
         "teapot"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        OwnedText text = {0};
        text_appendf(&text, "%s", cases[i][1]);
        OwnedMessageList messages = {0};
        Scene scene;
        assert_false(scene_read_text(&scene, cases[i][0], &text, false, &messages));
        assert_null(scene.objects.items);
        assert_null(scene.lights.items);
        assert_int_equal(scene.objects.count, 0);
        assert_string_equal(messages.items[0].file, cases[i][0]);
        assert_string_equal(messages.items[0].source_line, cases[i][2]);
    }
}

// A node's offsets cannot count this many bytes. Those beyond the scene here are never read.
TEST(more_than_2_gibibytes_are_refused)
{
    const Source source = {.file = "s.yaml", .bytes = CAMERA SPHERE, .length = ((size_t)1 << 31) + 1};
    MessageList messages = {0};
    Scene scene;
    assert_false(scene_read_yaml(&scene, &source, &(SceneOptions){0}, &messages));
    check_only_message(&messages, "a scene and its files may have at most 2 GiB");
}

TEST_MAIN(set_up, complete_close)
