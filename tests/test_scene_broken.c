// Every scene in tests/broken gets exactly the messages in the file next to it, and every message has such a
// scene. The lines of NAME.set, if there is one, are its overrides.
#include "host/base/array.h"
#include "host/import/load.h"
#include "tests/scene_reading.h"

#include <ctype.h>
#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { BROKEN_SCENES_MIN = 30 };

static Text all_expected;

static Text file_text(const char *path)
{
    Text text = {0};
    MessageList messages = {0};
    if (!text_read_file(&text, path, &messages)) message_list_print(&messages, stderr);
    assert_int_equal(messages.count, 0);
    return text;
}

static bool name_ends_with(const char *name, const char *ending)
{
    size_t length = strlen(name), ending_length = strlen(ending);
    return length > ending_length && !strcmp(name + length - ending_length, ending);
}

enum { SETS_MAX = 40 };

// Reads the scene with the lines of `path` as overrides.
static bool scene_read_lines(Scene *scene, const char *name, const Text *text, const char *path,
                             MessageList *messages)
{
    Text lines = file_text(path);
    const char *overrides[SETS_MAX];
    size_t count = 0;
    for (char *line = lines.items, *rest; (line = strtok_r(line, "\n", &rest)); line = NULL) {
        assert_true(count < SETS_MAX);
        overrides[count++] = line;
    }
    const bool read = scene_read_set(scene, name, text, overrides, count, messages);
    text_free(&lines);
    return read;
}

static void check_scene(const char *folder, const char *name)
{
    Text path = {0}, expected_path = {0}, set_path = {0}, got = {0};
    text_appendf(&path, "%s/%s", folder, name);
    text_append(&expected_path, path.items, (size_t)(strrchr(path.items, '.') - path.items));
    text_append(&set_path, expected_path.items, expected_path.count);
    text_appendf(&expected_path, ".expected");
    text_appendf(&set_path, ".set");
    Text text = file_text(text_c(&path)), expected = file_text(text_c(&expected_path));
    text_append(&all_expected, text_c(&expected), expected.count);

    MessageList messages = {0};
    Scene scene;
    bool read = access(text_c(&set_path), F_OK) == 0
                    ? scene_read_lines(&scene, name, &text, text_c(&set_path), &messages)
                    : scene_read_text(&scene, name, &text, false, &messages);
    for (size_t i = 0; i < messages.count; i++)
        message_describe(&got, &messages.items[i]);
    if (read || strcmp(text_c(&got), text_c(&expected)) != 0)
        fail_msg("%s:\n%sexpected:\n%s", text_c(&path), text_c(&got), text_c(&expected));
    assert_null(scene.objects.items);
    message_list_free(&messages);
    text_free(&path);
    text_free(&expected_path);
    text_free(&set_path);
    text_free(&got);
    text_free(&text);
    text_free(&expected);
}

static void check_folder(void **state)
{
    char folder[32], ending[8];
    snprintf(folder, sizeof folder, "tests/broken/%s", (const char *)*state);
    snprintf(ending, sizeof ending, ".%s", (const char *)*state);
    DIR *entries = opendir(folder);
    assert_non_null(entries);
    size_t count = 0;
    for (const struct dirent *entry; (entry = readdir(entries));) {
        if (!name_ends_with(entry->d_name, ending)) continue;
        check_scene(folder, entry->d_name);
        count++;
    }
    closedir(entries);
    assert_true(count >= BROKEN_SCENES_MIN);
}

// The longest literal part of a format, which identifies the message.
static char *format_core(const char *format, size_t length)
{
    const char *longest = format;
    size_t longest_length = 0;
    for (size_t start = 0, i = 0; i <= length; i++) {
        if (i < length && format[i] != '%') continue;
        if (i - start > longest_length) {
            longest = format + start;
            longest_length = i - start;
        }
        for (i++; i < length && strchr(".*0123456789z", format[i]); i++)
            continue;
        start = i + 1; // after the conversion
    }
    return strndup(longest, longest_length);
}

static size_t check_source(const char *path)
{
    Text text = file_text(path);
    size_t count = 0;
    for (const char *at = text_c(&text); (at = strstr(at, "report_error("));) {
        const char *quote = strchr(at, '"'), *end_of_call = strchr(at, ';');
        at += strlen("report_error(");
        if (!quote || quote > end_of_call) continue;
        char *core = format_core(quote + 1, (size_t)(strchr(quote + 1, '"') - quote - 1));
        if (*core && !strstr(text_c(&all_expected), core))
            fail_msg("%s: no broken scene for \"%s\"", path, core);
        count += *core != '\0';
        free(core);
    }
    text_free(&text);
    return count;
}

static size_t check_sources(const char *folder)
{
    DIR *entries = opendir(folder);
    assert_non_null(entries);
    size_t count = 0;
    for (const struct dirent *entry; (entry = readdir(entries));) {
        if (!name_ends_with(entry->d_name, ".c")) continue;
        Text path = {0};
        text_appendf(&path, "%s/%s", folder, entry->d_name);
        count += check_source(text_c(&path));
        text_free(&path);
    }
    closedir(entries);
    return count;
}

// Runs after all broken scenes are read.
static void test_every_message_has_a_scene(void **state)
{
    (void)state;
    text_appendf(&all_expected,
                 "a scene of more than 2 GiB"); // tests/test_scene_yaml.c has it, without a file
    size_t count = check_sources("host/import") + check_sources("host/import/yaml");
    assert_true(count >= 40);
    text_free(&all_expected);
}

static void test_names(void **state)
{
    (void)state;
    MessageList messages = {0};
    SceneOptions options = {0};
    Scene scene;
    assert_false(scene_load(&scene, "tests/scenes/complete.txt", &options, &messages));
    assert_string_equal(messages.items[0].text, "tests/scenes/complete.txt: a scene's name ends in .yaml, "
                                                ".yml, .json, .rt, .cfg, .nff or .dat, or in "
                                                "a "
                                                "mesh's, such as .obj, .ply, .stl, .gltf, .glb, .fbx, .dae");
    assert_false(scene_load(&scene, ".rt", &options, &messages));
    assert_false(scene_load(&scene, "tests/scenes/absent.yml", &options, &messages));
    assert_non_null(strstr(messages.items[2].text, "absent.yml"));
    assert_int_equal(messages.count, 3);
    message_list_free(&messages);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        {"test_yaml", check_folder, NULL, NULL, "yaml"},
        {"test_rt", check_folder, NULL, NULL, "rt"},
        {"test_cfg", check_folder, NULL, NULL, "cfg"},
        {"test_nff", check_folder, NULL, NULL, "nff"},
        {"test_dat", check_folder, NULL, NULL, "dat"},
        cmocka_unit_test(test_every_message_has_a_scene),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
