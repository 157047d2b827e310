// Tests `include` of YAML scenes: what the files give, in which order, and the places of what is wrong in
// them.
#include "host/import/load.h"
#include "host/scene/describe.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

#include <sys/stat.h>

#define CAMERA "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"
#define LIGHTS "lights: [point: {position: [0, 9, 0]}]\n"

static int set_up(void **state)
{
    if (folder_open(state) != 0) return -1;
    file_write("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    return mkdir("parts", 0700);
}

static Scene scene_set(const char *path, const char *const *overrides, size_t count)
{
    MessageList messages = {0};
    Scene scene;
    const SceneOptions options = {.overrides = overrides, .override_count = count, .override_name = "--set"};
    const bool is_read = scene_load(&scene, path, &options, &messages);
    message_list_print(&messages, stderr);
    assert_true(is_read);
    assert_int_equal(messages.count, 0);
    return scene;
}

static void check_messages(const char *path, const char *const *overrides, size_t count, const char *expected)
{
    OwnedMessageList messages = {0};
    Scene scene;
    const SceneOptions options = {.overrides = overrides, .override_count = count, .override_name = "--set"};
    assert_false(scene_load(&scene, path, &options, &messages));
    for (size_t i = 0; i < messages.count; i++) { // without the lines of the source
        free(messages.items[i].source_line);
        messages.items[i].source_line = NULL;
    }
    OWNED char *text = message_list_text(&messages);
    assert_string_equal(text, expected);
}

// Writes the files of a scene in two folders, one of which includes another.
static void write_forest(const char *scene)
{
    file_write("parts/colors.yaml", "# a comment\nmaterials:\n  green: {color: [0, 1, 0]}\n");
    file_write("parts/trees.yaml",
               "include: colors.yaml\n"
               "camera: {position: [0, 0, 9], look_at: [0, 0, 0]}\n"
               "ambient: 0.25\n"
               "materials: {bark: {color: [1, 0, 0]}}\n"
               "define:\n"
               "  tree: {objects: [{sphere: {center: [0, 0, 0], radius: 2, material: green}}]}\n"
               "lights: [point: {position: [1, 1, 1]}]\n"
               "objects:\n"
               "  - mesh: {file: ../triangle.obj, material: bark}\n"
               "  - instance: {of: tree}\n");
    file_write("ground.yaml", "camera: {position: [0, 0, 7], look_at: [0, 0, 0]}\n"
                              "background: [0, 0, 1]\n"
                              "objects:\n\n"
                              "  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: green}\n");
    file_write("forest.yaml", scene);
}

#define FOREST                                                                                               \
    "include: [parts/trees.yaml, ground.yaml, parts/colors.yaml]\n"                                          \
    "materials: {blue: {color: [0, 0, 1]}}\n"                                                                \
    "define: {pair: {objects: [{instance: {of: tree}}, {instance: {of: tree}}]}}\n"                          \
    "lights: [point: {position: [2, 2, 2]}]\n"                                                               \
    "objects:\n"                                                                                             \
    "  - instance: {of: pair, material: blue}\n"                                                             \
    "  - mesh: {file: triangle.obj}\n"

TEST(included_files_are_joined)
{
    write_forest(FOREST);
    OwnedScene scene = scene_set("forest.yaml", NULL, 0);
    assert_vector(scene.camera.position, 0, 0, 9); // the first one
    assert_vector(scene.background, 0, 0, 1);
    assert_vector(scene.ambient, 0.25, 0.25, 0.25);
    assert_int_equal(scene.lights.count, 2);
    assert_vector(scene.lights.items[0].position, 1, 1, 1);
    assert_vector(scene.lights.items[1].position, 2, 2, 2);
    static const struct {
        ShapeType type;
        const char *material, *description;
    } expected[] = {
        {SHAPE_MESH, "bark", "triangle 0 of mesh 0, triangle.obj, trees.yaml:9, material bark"},
        {SHAPE_SPHERE, "green", "sphere 1, trees.yaml:10, material green"},
        {SHAPE_PLANE, "green", "plane 2, ground.yaml:5, material green"},
        {SHAPE_SPHERE, "blue", "sphere 3, forest.yaml:6, material blue"},
        {SHAPE_SPHERE, "blue", "sphere 4, forest.yaml:6, material blue"},
        {SHAPE_MESH, "", "triangle 0 of mesh 5, triangle.obj, forest.yaml:7"},
    };
    assert_int_equal(scene.objects.count, 6);
    for (size_t i = 0; i < 6; i++) {
        const Object *object = &scene.objects.items[i];
        assert_int_equal(object->type, expected[i].type);
        assert_string_equal(scene.material_names.items[object->material], expected[i].material);
        OwnedText description = {0};
        object_describe(&description, &scene, "forest.yaml", i);
        assert_string_equal(text_c(&description), expected[i].description);
    }
    assert_int_equal(scene.materials.count, 4); // with that of the last mesh
    assert_int_equal(scene.included.count, 3);
    assert_true(scene_was_read_from(&scene, "forest.yaml", "parts/../parts/colors.yaml"));
    assert_false(scene_was_read_from(&scene, "ground.yaml", "lost.yaml"));
}

TEST(scene_overrides_included_files)
{
    write_forest("include: ground.yaml\nmaterials: {green: {}}\nbackground: 0\n" CAMERA LIGHTS);
    OwnedScene scene = scene_set("forest.yaml", NULL, 0);
    assert_vector(scene.camera.position, 0, 0, -5);
    assert_vector(scene.background, 0, 0, 0);
    assert_int_equal(scene.objects.count, 1);
}

// A scene's animation values take precedence, then those of the first included file.
TEST(scene_overrides_included_animation)
{
    file_write("timing.yaml", "frames: 8\nfps: 30\nshutter: 0.5\n");
    file_write("other.yaml", "frames: 9\nfps: 31\nshutter: 0.25\n");
    write_forest("include: [parts/trees.yaml, timing.yaml, other.yaml]\nfps: 12\n");
    OwnedScene scene = scene_set("forest.yaml", NULL, 0);
    assert_int_equal(scene.animation.frame_count, 8);
    assert_number(scene.animation.frame_rate, 12);
    assert_number(scene.animation.shutter, 0.5);
}

TEST(hash_covers_included_files)
{
    write_forest(FOREST);
    OwnedScene scene = scene_set("forest.yaml", NULL, 0), same = scene_set("forest.yaml", NULL, 0);
    file_write("parts/colors.yaml", "materials:\n  green: {color: [0, 0.5, 0]}\n");
    OwnedScene other = scene_set("forest.yaml", NULL, 0);
    assert_true(scene.text_hash == same.text_hash);
    assert_true(scene.text_hash != other.text_hash);
}

// Values that an alias repeats in an included file are joined under only one of its names.
TEST(aliases_in_included_files_are_joined_once)
{
    file_write("alias.yaml", "define: {two: {objects: &s [{sphere: {center: [0, 0, 0], radius: 1}},\n"
                             "                             {sphere: {center: [0, 0, 0], radius: 2}}]}}\n"
                             "objects: *s\n");
    file_write("more.yaml", "define: {one: {objects: &s [{sphere: {center: [0, 0, 0], radius: 3}}]}}\n"
                            "objects: *s\n");
    file_write("scene.yaml", "include: [alias.yaml, more.yaml]\n" CAMERA LIGHTS
                             "objects: [instance: {of: two}, instance: {of: one}]\n");
    static const double radii[] = {1, 2, 3, 1, 2, 3};
    OwnedScene scene = scene_set("scene.yaml", NULL, 0);
    assert_int_equal(scene.objects.count, 6);
    for (size_t i = 0; i < 6; i++)
        assert_number(scene.objects.items[i].as.sphere.radius, radii[i]);
}

TEST(set_changes_included_values)
{
    write_forest(FOREST);
    static const char *const overrides[] = {"objects[2].plane.point=[0, 4, 0]", "materials.green.color=blue",
                                            "objects[5]=mesh: {file: triangle.obj}"};
    OwnedScene scene = scene_set("forest.yaml", overrides, 3);
    assert_int_equal(scene.objects.count, 7);
    assert_vector(scene.objects.items[2].as.plane.point, 0, 4, 0);
    assert_int_equal(scene.objects.items[6].line, 0);
    assert_vector(scene.materials.items[0].color, 0, 0, 1);
    check_messages(
        "forest.yaml", (const char *[]){"ambient=1", "include=ground.yaml", "ambient=x"}, 3,
        "--set:1:9: error: 'ambient' must be a color, such as [1, 0.2, 0], 0.5, '#ff8000' or red, "
        "not 'x'\n--set:1:9: error: 'include' cannot be set, because files are included before values are "
        "set\n");
}

static void name_append(void *context, const char *path)
{
    text_appendf(context, "%s\n", path);
}

TEST(every_included_file_is_named)
{
    write_forest(FOREST);
    file_write("ground.yaml", "objects: [\n");
    OwnedText names = {0};
    OwnedMessageList messages = {0};
    Scene scene;
    const SceneOptions options = {.file_named = name_append, .context = &names};
    assert_false(scene_load(&scene, "forest.yaml", &options, &messages));
    assert_string_equal(text_c(&names),
                        "parts/trees.yaml\nparts/colors.yaml\nground.yaml\nparts/colors.yaml\n");
}

TEST(names_given_twice_are_refused)
{
    write_forest("include: [ground.yaml, parts/trees.yaml]\n"
                 "materials:\n  bark: {}\n  green: {}\n"
                 "define: {tree: {objects: []}}\n");
    check_messages("forest.yaml", NULL, 0,
                   "forest.yaml:3:3: error: material 'bark' is already given at parts/trees.yaml:4:13\n"
                   "forest.yaml:4:3: error: material 'green' is already given at parts/colors.yaml:3:3\n"
                   "forest.yaml:5:10: error: definition 'tree' is already given at parts/trees.yaml:6:3\n");
}

// Messages about the scene's file come first, in the order of its text, then others as they are found.
TEST(messages_name_the_included_file)
{
    file_write("parts/a.yaml", "objects:\n  - sphere: {center: [0, 0, 0], radius: -1}\n"
                               "  - mesh: {file: lost.obj}\npurple: 1\n");
    file_write("b.yaml", "objects: [sphere: {}]\n");
    file_write("scene.yaml", "\n\n\n\ninclude: [parts/a.yaml, b.yaml]\n" CAMERA "objects: [sphere: {}]\n");
    check_messages(
        "scene.yaml", (const char *[]){"ambient=-1"}, 1,
        "scene.yaml:7:19: error: the sphere lacks 'center'\n"
        "scene.yaml:7:19: error: the sphere lacks 'radius'\n"
        "parts/a.yaml:4:1: error: unknown scene key 'purple'; the choices are include, "
        "camera, frames, fps, "
        "shutter, background, ambient, lights, materials, define, objects\n"
        "--set:1:9: error: 'ambient' must be 0 or more, not '-1'\n"
        "parts/a.yaml:2:41: error: 'radius' must be greater than 0, not '-1'\n"
        "parts/a.yaml:3:18: error: parts/lost.obj: cannot read the file: No such file or directory\n"
        "b.yaml:1:19: error: the sphere lacks 'center'\n"
        "b.yaml:1:19: error: the sphere lacks 'radius'\n");
    file_write("parts/a.yaml", "objects:\n  - sphere: {center: [0, 0, 0], radius: 1\n");
    file_write("b.yaml", "objects: {}\nlights: []\ndefine: []\nlights: []\n");
    check_messages("scene.yaml", NULL, 0,
                   "parts/a.yaml:3:1: error: missing comma in flow mapping\n"
                   "b.yaml:1:10: error: 'objects' must be a list, not a mapping\n"
                   "b.yaml:3:9: error: 'define' must be a mapping, not a list of 0\n"
                   "b.yaml:4:1: error: 'lights' is given twice\n");
    file_write("parts/a.yaml", "- objects\n");
    file_write("b.yaml", "");
    check_messages("scene.yaml", NULL, 0,
                   "parts/a.yaml:1:1: error: 'scene' must be a mapping, not a list of 1\n"
                   "b.yaml:1:1: error: the scene is empty\n");
}

TEST(recursive_includes_are_refused)
{
    file_write("scene.yaml", "include: [parts/a.yaml]\n");
    file_write("parts/a.yaml", "lights: []\ninclude: ../b.yaml\n");
    file_write("b.yaml", "include:\n  - parts/a.yaml\n  - scene.yaml\n  - b.yaml\n");
    check_messages("scene.yaml", NULL, 0,
                   "parts/../b.yaml:2:5: error: 'parts/../parts/a.yaml' includes itself\n"
                   "parts/../b.yaml:3:5: error: 'parts/../scene.yaml' includes itself\n"
                   "parts/../b.yaml:4:5: error: 'parts/../b.yaml' includes itself\n");
}

TEST(number_of_included_files_is_limited)
{
    OwnedText list = {0};
    for (int i = 0; i < 100; i++) {
        const char *name = formatted("%d.yaml", i);
        file_write(name, "objects: []\n");
        text_appendf(&list, "%s, ", name);
    }
    file_write("last.yaml", "objects: []\n");
    Text scene = {0};
    text_appendf(&scene,
                 "include: [%s]\n" CAMERA LIGHTS "objects: [sphere: {center: [0, 0, 0], radius: 1}]\n",
                 text_c(&list));
    file_write("scene.yaml", text_c(&scene));
    Scene read = scene_set("scene.yaml", NULL, 0);
    assert_int_equal(read.included.count, 100);
    scene_free(&read);
    text_free(&scene);
    text_appendf(&scene, "include: [%s last.yaml, lost.yaml]\n" CAMERA, text_c(&list));
    file_write("scene.yaml", text_c(&scene));
    check_messages("scene.yaml", NULL, 0,
                   formatted("scene.yaml:1:%zu: error: a scene may include at most 100 files\n",
                             strlen("include: [") + list.count + 2));
    text_free(&scene);
    // a file that cannot be read counts
    assert_int_equal(symlink("/proc/self/mem", "unreadable.yaml"), 0);
    text_appendf(&scene, "include: [unreadable.yaml, %slost.yaml]\n" CAMERA, text_c(&list));
    file_write("scene.yaml", text_c(&scene));
    check_messages("scene.yaml", NULL, 0,
                   formatted("scene.yaml:1:11: error: cannot read 'unreadable.yaml': Input/output error\n"
                             "scene.yaml:1:%zu: error: a scene may include at most 100 files\n",
                             strlen("include: [unreadable.yaml, ") + list.count + 1 - strlen("99.yaml, ")));
    text_free(&scene);
}

TEST_MAIN(set_up, folder_close)
