// Checks that the examples in docs/scene-format.md are scenes that are read without a message, and that its
// tables name every shape.
#include "tests/check.h"
#include "tests/scene_reading.h"

static Text page;

static int page_read(void **state)
{
    (void)state;
    MessageList messages = {0};
    return text_read_file(&page, "docs/scene-format.md", &messages) ? 0 : -1;
}

static int page_free(void **state)
{
    (void)state;
    text_free(&page);
    return 0;
}

typedef struct {
    const char *language; // of the fence, and the ending
    size_t count_min;
} Examples;

// Reads each block fenced as the language. Some blocks of YAML are only a camera.
static void check_examples(void **state)
{
    const Examples *examples = *state;
    const char *camera_alone = "warning: no objects: only the background is shown\nwarning: no lights: only "
                               "ambient light and emission are shown\n";
    OwnedText fence = {0};
    text_appendf(&fence, "\n```%s\n", examples->language);
    size_t count = 0;
    for (const char *at = text_c(&page); (at = strstr(at, text_c(&fence))); count++) {
        at += fence.count;
        const char *end = strstr(at, "\n```\n");
        assert_non_null(end);
        OwnedText example = {0};
        text_append(&example, at, (size_t)(end - at) + 1);
        OwnedText messages = scene_messages(formatted("s.%s", examples->language), text_c(&example), false);
        if (messages.count && strcmp(text_c(&messages), camera_alone) != 0)
            fail_msg("%s%s", text_c(&example), text_c(&messages));
    }
    assert_true(count >= examples->count_min && count <= 100);
}

TEST_CASE(yaml_examples_are_read, check_examples, &(Examples){"yaml", 2})
TEST_CASE(rt_examples_are_read, check_examples, &(Examples){"rt", 1})
TEST_CASE(cfg_examples_are_read, check_examples, &(Examples){"cfg", 1})
TEST_CASE(nff_examples_are_read, check_examples, &(Examples){"nff", 1})

TEST(every_shape_is_named)
{
    for (size_t i = 0; i < SHAPE_COUNT; i++) {
        if (i == SHAPE_OVAL) continue; // not in files
        assert_non_null(strstr(text_c(&page), formatted("\n| `%s` | ", shape_names[i])));
    }
}

// The names of colors in the page are those of CSS Color Module Level 3, section 4, with their values.
TEST(names_of_colors_are_those_of_css)
{
    static const struct {
        const char *name, *hex;
    } colors[] = {
        {"aqua", "00ffff"},   {"black", "000000"},   {"blue", "0000ff"},  {"brown", "a52a2a"},
        {"cyan", "00ffff"},   {"fuchsia", "ff00ff"}, {"gold", "ffd700"},  {"gray", "808080"},
        {"green", "008000"},  {"grey", "808080"},    {"lime", "00ff00"},  {"magenta", "ff00ff"},
        {"maroon", "800000"}, {"navy", "000080"},    {"olive", "808000"}, {"orange", "ffa500"},
        {"pink", "ffc0cb"},   {"purple", "800080"},  {"red", "ff0000"},   {"silver", "c0c0c0"},
        {"teal", "008080"},   {"violet", "ee82ee"},  {"white", "ffffff"}, {"yellow", "ffff00"},
    };
    const char *names = strstr(text_c(&page), "value in CSS");
    assert_non_null(names);
    const char *end = strstr(names, "\n\n");
    size_t count = 0;
    for (const char *at = names; (at = strchr(at, '`')) && at < end; at++)
        count++;
    assert_int_equal(count, 2 * COUNT_OF(colors));
    for (size_t i = 0; i < COUNT_OF(colors); i++) {
        const char *named = strstr(names, formatted("`%s`", colors[i].name));
        assert_true(named && named < end);
        OwnedScene scene = scene_of_text(
            "s.yaml",
            formatted("camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\nambient: %s\nbackground: '#%s'\n",
                      colors[i].name, colors[i].hex));
        assert_memory_equal(&scene.ambient, &scene.background, sizeof scene.ambient);
    }
}

TEST_MAIN(page_read, page_free)
