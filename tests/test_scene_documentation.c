// The examples in docs/scene-format.md are scenes that are read without a message, and its tables name every
// shape.
#include "tests/scene_reading.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

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

// Reads each block fenced as `language`; returns how many.
static size_t check_examples(const char *language, const char *name, const char *tolerated)
{
    Text fence = {0};
    text_appendf(&fence, "\n```%s\n", language);
    size_t count = 0;
    for (const char *at = text_c(&page); (at = strstr(at, text_c(&fence))); count++) {
        at += fence.count;
        const char *end = strstr(at, "\n```\n");
        assert_non_null(end);
        Text example = {0};
        text_append(&example, at, (size_t)(end - at) + 1);
        Text messages = scene_messages(name, text_c(&example), false);
        if (messages.count && strcmp(text_c(&messages), tolerated) != 0)
            fail_msg("%s%s", text_c(&example), text_c(&messages));
        text_free(&messages);
        text_free(&example);
    }
    text_free(&fence);
    return count;
}

static void test_yaml_examples(void **state)
{
    (void)state;
    const char *camera_only = "warning: s.yaml: no objects\nwarning: s.yaml: no lights\n";
    assert_in_range(check_examples("yaml", "s.yaml", camera_only), 4, 100);
}

static void test_rt_examples(void **state)
{
    (void)state;
    assert_in_range(check_examples("rt", "s.rt", ""), 1, 100);
}

static void test_cfg_examples(void **state)
{
    (void)state;
    assert_in_range(check_examples("cfg", "s.cfg", ""), 1, 100);
}

static void test_nff_examples(void **state)
{
    (void)state;
    assert_in_range(check_examples("nff", "s.nff", ""), 1, 100);
}

static void test_every_shape_is_named(void **state)
{
    (void)state;
    for (size_t i = 0; i < SHAPE_COUNT; i++) {
        Text row = {0};
        text_appendf(&row, "\n| `%s` | ", shape_names[i]);
        assert_non_null(strstr(text_c(&page), text_c(&row)));
        text_free(&row);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_yaml_examples),        cmocka_unit_test(test_rt_examples),
        cmocka_unit_test(test_cfg_examples),         cmocka_unit_test(test_nff_examples),
        cmocka_unit_test(test_every_shape_is_named),
    };
    return cmocka_run_group_tests(tests, page_read, page_free);
}
