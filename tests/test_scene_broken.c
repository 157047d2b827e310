// Checks that every scene of the tables in tests/broken, whose README describes their format, gets exactly
// the messages next to it, and that every message has such a scene.
#include "host/import/load.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

#include <ctype.h>
#include <dirent.h>

enum { BROKEN_SCENES_MIN = 30, SETS_MAX = 40 };

static Text all_expected;

// A section of a table (tests/broken).
typedef struct {
    char name[80]; // with the table's ending
    struct {
        char *items[SETS_MAX];
        size_t count;
    } sets;
    bool is_escaped;
    Text text, expected;
} BrokenScene;

static bool starts_with(const char *line, const char *start)
{
    return strncmp(line, start, strlen(start)) == 0;
}

// Appends the line with each %d replaced by a number.
static void counted_line_append(Text *text, const char *line, long number)
{
    for (const char *at = line; *at; at++)
        if (starts_with(at, "%d")) {
            text_appendf(text, "%ld", number);
            at++;
        } else {
            text_append(text, at, 1);
        }
    text_append(text, "\n", 1);
}

// Replaces each \xNN by its byte.
static void text_unescape(Text *text)
{
    size_t length = 0;
    for (size_t i = 0; i < text->count; i++) {
        char digits[3] = "";
        if (starts_with(text->items + i, "\\x")) {
            memcpy(digits, text->items + i + 2, 2);
            i += 3;
        }
        text->items[length++] = digits[0] ? (char)strtol(digits, NULL, 16) : text->items[i];
    }
    text->items[text->count = length] = '\0';
}

// Reads the section that begins at `line`, where `#### start` stands for the text `start`. Returns the line
// behind it, or NULL at the end.
static char *section_read(char *line, const Text *start, const char *ending, BrokenScene *broken)
{
    *broken = (BrokenScene){0};
    char *next = line;
    bool is_expected = false;
    for (size_t i = 0; next && *next; i++, line = next) {
        if (i > 0 && starts_with(line, "#### scene ")) return line;
        char *end = strchr(line, '\n');
        next = end ? end + 1 : NULL;
        if (end) *end = '\0';
        char *value;
        if (starts_with(line, "#### scene ")) {
            snprintf(broken->name, sizeof broken->name, "%s.%s", line + strlen("#### scene "), ending);
        } else if (starts_with(line, "#### set ")) {
            assert_true(broken->sets.count < SETS_MAX);
            broken->sets.items[broken->sets.count++] = line + strlen("#### set ");
        } else if (starts_with(line, "#### escaped")) {
            broken->is_escaped = true;
        } else if (starts_with(line, "#### start")) {
            text_append(&broken->text, text_c(start), start->count);
        } else if (starts_with(line, "#### repeat ")) {
            const long first = strtol(line + strlen("#### repeat "), &value, 10),
                       last = strtol(value, &value, 10);
            for (long number = first; number <= last; number++)
                counted_line_append(&broken->text, value + 1, number);
        } else if (starts_with(line, "#### expected")) {
            is_expected = true;
            assert_true(!strstr(line, "without") || broken->text.count > 0);
            if (strstr(line, "without the last newline")) broken->text.items[--broken->text.count] = '\0';
        } else {
            text_appendf(is_expected ? &broken->expected : &broken->text, "%s\n", line);
        }
    }
    return NULL;
}

static void check_scene(BrokenScene *broken)
{
    if (broken->is_escaped) text_unescape(&broken->text);
    text_append(&all_expected, text_c(&broken->expected), broken->expected.count);
    OwnedMessageList messages = {0};
    OwnedText got = {0};
    Scene scene;
    const bool read =
        broken->sets.count > 0
            ? scene_read_set(&scene, broken->name, &broken->text, (const char *const *)broken->sets.items,
                             broken->sets.count, &messages)
            : scene_read_text(&scene, broken->name, &broken->text, false, &messages);
    for (size_t i = 0; i < messages.count; i++)
        message_describe(&got, &messages.items[i]);
    if (read || strcmp(text_c(&got), text_c(&broken->expected)) != 0)
        fail_msg("%s:\n%sexpected:\n%s", broken->name, text_c(&got), text_c(&broken->expected));
    assert_null(scene.objects.items);
    text_free(&broken->text);
    text_free(&broken->expected);
}

static void check_table(void **state)
{
    const char *ending = *state;
    OwnedText table = file_text(formatted("tests/broken/%s.txt", ending));
    size_t count = 0;
    char *line = strstr(table.items, "#### scene ");
    OwnedText start = {0};
    text_append(&start, table.items, (size_t)(line - table.items));
    for (; line; count++) {
        BrokenScene broken;
        line = section_read(line, &start, ending, &broken);
        check_scene(&broken);
    }
    assert_true(count >= BROKEN_SCENES_MIN);
}

TEST_CASE(yaml, check_table, "yaml")
TEST_CASE(rt, check_table, "rt")
TEST_CASE(cfg, check_table, "cfg")
TEST_CASE(nff, check_table, "nff")
TEST_CASE(dat, check_table, "dat")

// Returns the longest literal part of a format, which identifies the message.
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
    OwnedText text = file_text(path);
    size_t count = 0;
    for (const char *at = text_c(&text); (at = strstr(at, "report_error("));) {
        const char *quote = strchr(at, '"'), *end_of_call = strchr(at, ';');
        at += strlen("report_error(");
        if (!quote || quote > end_of_call) continue;
        OWNED char *core = format_core(quote + 1, (size_t)(strchr(quote + 1, '"') - quote - 1));
        if (*core && !strstr(text_c(&all_expected), core))
            fail_msg("%s: no broken scene for \"%s\"", path, core);
        count += *core != '\0';
    }
    return count;
}

static size_t check_sources(const char *folder)
{
    DIR *entries = opendir(folder);
    assert_non_null(entries);
    size_t count = 0;
    for (const struct dirent *entry; (entry = readdir(entries));) {
        const char *ending = strrchr(entry->d_name, '.');
        if (!ending || strcmp(ending, ".c") != 0) continue;
        count += check_source(formatted("%s/%s", folder, entry->d_name));
    }
    closedir(entries);
    return count;
}

// Runs after all broken scenes are read.
TEST(every_message_has_a_scene)
{
    // tests/test_scene_yaml.c and test_scene_include.c have them, without a file or with many
    text_appendf(&all_expected, "a scene of more than 2 GiB, recursive include of '', included files");
    size_t count = check_sources("host/import") + check_sources("host/import/yaml");
    assert_true(count >= 40);
    text_free(&all_expected);
}

TEST(names)
{
    OwnedMessageList messages = {0};
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
}

TEST_MAIN(NULL, NULL)
