// Parses YAML texts whole and in parts of one item each, and compares the trees.
#include "host/base/random.h"
#include "host/import/yaml/parts.h"
#include "tests/check.h"
#include "tests/files.h"

#include <glob.h>

static void nodes_compare(const YamlTree *got, uint32_t got_node, const YamlTree *expected,
                          uint32_t expected_node)
{
    const YamlNode *a = yaml_node(got, got_node), *b = yaml_node(expected, expected_node);
    assert_int_equal(a->type, b->type);
    assert_int_equal(a->offset, b->offset);
    assert_int_equal(a->end, b->end);
    assert_string_equal(yaml_text(got, a), yaml_text(expected, b));
    if (a->type == YAML_SCALAR) return;
    assert_int_equal(a->child_count, b->child_count);
    uint32_t child = a->first, other = b->first;
    for (; child > 0 && other > 0;
         child = yaml_node(got, child)->next, other = yaml_node(expected, other)->next)
        nodes_compare(got, child, expected, other);
    assert_int_equal(child, 0);
    assert_int_equal(other, 0);
}

// Returns whether the error means that the text is not for libfyaml.
static bool is_refused(const char *error)
{
    return strcmp(error, "the file must be UTF-8 text without NUL characters") == 0 ||
           strstr(error, "in a text with tabs");
}

// Returns whether the text could be parsed in parts. Its tree then equals that of the whole, and otherwise it
// is empty.
static bool parts_check(const char *text, size_t length)
{
    const Source source = {.file = "a.yaml", .bytes = text, .length = length};
    YamlTree whole = {0}, joined = {0};
    MessageList messages = {0};
    Report report = report_open(&source, &messages);
    const bool is_whole = yaml_tree_read(&whole, &report, 7, NULL),
               is_joined = (is_whole || !is_refused(messages.items[0].text)) &&
                           yaml_parts_read(&joined, &source, 7, 1, NULL);
    if (is_joined) {
        assert_true(is_whole);
        assert_int_equal(joined.nodes.count, whole.nodes.count);
        assert_int_equal(joined.texts.count, whole.texts.count);
        assert_int_equal(joined.has_aliases, whole.has_aliases);
        nodes_compare(&joined, 0, &whole, 0);
    } else {
        assert_int_equal(joined.nodes.count + joined.texts.count + joined.has_aliases, 0);
    }
    message_list_free(&messages);
    yaml_tree_free(&whole);
    yaml_tree_free(&joined);
    return is_joined;
}

#define ITEM(n) "  - sphere: {center: [" #n ", 0, 0], radius: 1}\n"
#define LIST    "objects:\n"

static const char *const in_parts[] = {
    LIST ITEM(1) ITEM(2) ITEM(3),
    LIST ITEM(1) ITEM(2) ITEM(3) ITEM(4) "camera: {fov: 3}\n",
    "\xEF\xBB\xBF"
    "a: &a [1]\n" LIST ITEM(1) ITEM(2) ITEM(3) "b: *a\n",
    "---\n" LIST "- a\n- b: c\n- d\n- [e]\n- f\nlights:\n- g\n- h\n",
    LIST "    - a:\n    - b:\n    - c:\n    - d:\n...\n",
    LIST "  - a: |\n      - b\n  - c: >-\n      d\n\n  - e: 'x\n      y'\n  - f: \"z\\\n      w\"\n  - g\n",
    LIST "  - a: [1,\n      2,\n     3]\n  - b: {c: d,\n     e: f}\n\n  - g: h\n    i: j\n  - k: l\n  - m\n",
    LIST "  # one\n\n  - a # two\n  # three\n# four\n  - b\n\n\n  - c # - d\n  - e\n  # end\nf: g\n",
    "a: b\r\n" LIST "  - c: [1, 2]\r\n  - d: 1\r\n  - e: 2\r\n\r\n  - f\r\n",
    LIST "  - &a b\n  - c\n  - d\n  - e\nf: *a\n",
    LIST "  - a\n    b\n  - c\n    d\n  - e\n    - f\n  - g\n",
    LIST "  - - a\n    - b\n  - - c\n    -\n  - d\n  - - e\n  - f\n",
    LIST "  - a\n  - ? b\n  - ? c: d\n  - ? - e\n  - f\n  - g\n",
    LIST "  - a:\n    - b\n    - c\n  - d:\n  - e: ~\n  -\n  - f\n  - g",
    LIST "  - a\t\n  - b:\tc\n  - d \t# e\n  - f: [\t1 ]\n  - g\n",
};

static const char *const whole_only[] = {
    LIST "  - a: *b\n  - c\n  - d\n",
    "",
    LIST ITEM(1) ITEM(2),
    LIST "  - a\n  - b: &c 1\n  - d: *c\n  - e\n",
    LIST "  - a\n  - b: &c 1\n  - d\n  - e\nf: *c\n",
    LIST "  - a\n  - !b c\n  - d\n",
    LIST "  - a\n  - b: [1,\n  - c\n  - d: ]\n  - e\n",
    LIST "  - a\n  - b: 'x\n  - c\n  - d'\n  - e\n",
    LIST "  - a\n  - b\n - c\n  - d\n",
    LIST "  - a\n  - b\n  c: d\n  - e\n",
    LIST "  - a\nb:\n  - c\n  - d\n",
    LIST "  - a\n  - b:\n\rc:\n  - d\n  - e\n",
    LIST "  - a\n  - b\n---\n  - c\n  - d\n",
    "a: |\n objects:\n  - b\n  - c\n  - d\n",
    "a: '\nobjects:\n  - b\n  - c\n  - d\n  '\n",
    "%YAML 1.1\n---\n" LIST ITEM(1) ITEM(2) ITEM(3),
    "objects: [a,\n  - b,\n  - c,\n  - d]\n",
    "objects: &a\n  - b\n  - c\n  - d\ne: *a\n",
    "a:\n objects:\n  - b\n  - c\n  - d\n",
    LIST "  - a\n  - b: {c: [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]}\n  - d\n  - e\n",
};

TEST(parts_equal_the_whole)
{
    for (size_t i = 0; i < COUNT_OF(in_parts); i++)
        assert_true(parts_check(in_parts[i], strlen(in_parts[i])));
    for (size_t i = 0; i < COUNT_OF(whole_only); i++)
        assert_false(parts_check(whole_only[i], strlen(whole_only[i])));
}

static size_t below(uint64_t *random, size_t limit)
{
    return (size_t)(random_next(random) % limit);
}

// Replaces up to three bytes by a word, or repeats a part of the text elsewhere.
static void text_edit(Text *text, uint64_t *random)
{
    static const char *const words[] = {
        "",        " ",        "  ",  "\n",  "\r\n", "- ", "  - ",   "\n  - a",   "\n- ", ": ", ":",
        "? ",      "#",        " # ", "[",   "]",    "{",  "}",      ",",         "'",    "\"", "|",
        "|1\n",    ">\n",      "&a ", "*a ", "!",    "%",  "@",      "`",         "\t",   "? ", "---",
        "\n...\n", "\xC2\x85", "\\",  "\r",  "-",    "a",  "\n b\n", "objects:\n"};
    const size_t start = below(random, text->count + 1), rest = text->count - start,
                 removed = rest > 0 ? below(random, rest < 4 ? rest + 1 : 4) : 0;
    const bool is_copy = below(random, 8) == 0 && text->count > 0 && text->count < 400;
    const size_t from = is_copy ? below(random, text->count) : 0;
    const char *word = words[below(random, COUNT_OF(words))];
    Text edited = {0};
    text_append(&edited, text->items, start);
    text_append(&edited, is_copy ? text->items + from : word,
                is_copy ? below(random, text->count - from) : strlen(word));
    text_append(&edited, text->items + start + removed, rest - removed);
    text_free(text);
    *text = edited;
}

TEST(parts_of_edited_texts_equal_the_whole)
{
    enum { EDITED_COUNT = 20000, EDITS_MAX = 3 };
    uint64_t random = 1;
    size_t joined = 0;
    for (size_t i = 0; i < EDITED_COUNT; i++) {
        const char *start = below(&random, 8) ? in_parts[below(&random, COUNT_OF(in_parts))]
                                              : whole_only[below(&random, COUNT_OF(whole_only))];
        Text text = {0};
        text_append(&text, start, strlen(start));
        for (size_t edits = below(&random, EDITS_MAX) + 1; edits > 0; edits--)
            text_edit(&text, &random);
        joined += parts_check(text.items, text.count);
        text_free(&text);
    }
    assert_in_range(joined, EDITED_COUNT / 10, EDITED_COUNT);
}

TEST(parts_of_scenes_equal_the_whole)
{
    static const char *const patterns[] = {"scenes/*.yaml", "tests/scenes/*.yaml"};
    size_t joined = 0;
    for (size_t i = 0; i < COUNT_OF(patterns); i++) {
        glob_t paths;
        assert_int_equal(glob(patterns[i], 0, NULL, &paths), 0);
        for (size_t j = 0; j < paths.gl_pathc; j++) {
            Text text = file_text(paths.gl_pathv[j]);
            joined += parts_check(text.items, text.count);
            text_free(&text);
        }
        globfree(&paths);
    }
    assert_in_range(joined, 10, 1000);
}

TEST_MAIN(NULL, NULL)
