// Tests messages with their place, growing text, similar words, stages, hashes and file names.
#include "host/base/base64.h"
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/file.h"
#include "host/base/hash.h"
#include "host/base/stage.h"
#include "tests/check.h"
#include "tests/child.h"

static char *printed(const MessageList *messages)
{
    char *bytes = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&bytes, &length);
    assert_non_null(stream);
    message_list_print(messages, stream);
    fclose(stream);
    return bytes;
}

static void check_message(const char *bytes, size_t offset, const char *expected)
{
    OwnedMessageList messages = {0};
    Source source = {"a.yaml", bytes, strlen(bytes)};
    message_add_at(&messages, MESSAGE_ERROR, &source, offset, "bad %s", "word");
    OWNED char *text = printed(&messages);
    assert_string_equal(text, expected);
}

TEST(message_place)
{
    check_message("one\ntwo three\n", 8, "a.yaml:2:5: error: bad word\ntwo three\n    ^\n");
    check_message("one", 0, "a.yaml:1:1: error: bad word\none\n^\n");
    check_message("one", 99, "a.yaml:1:4: error: bad word\none\n   ^\n");
    check_message("one\n", 4, "a.yaml:2:1: error: bad word\n\n^\n");
    check_message("", 0, "a.yaml:1:1: error: bad word\n\n^\n");
    check_message("one\r\ntwo\r\n", 6, "a.yaml:2:2: error: bad word\ntwo\n ^\n");
    check_message("one\rtwo\rthree", 5, "a.yaml:2:2: error: bad word\ntwo\n ^\n");
    check_message("\xEF\xBB\xBFone", 4, "a.yaml:1:2: error: bad word\none\n ^\n");
}

TEST(message_characters)
{
    check_message("\ta\tb", 3, "a.yaml:1:4: error: bad word\n\ta\tb\n\t \t^\n");
    check_message("\xC3\xA9\xE2\x98\x83x", 5, "a.yaml:1:3: error: bad word\n\xC3\xA9\xE2\x98\x83x\n  ^\n");
    check_message("\x1B[1m\xFF\xC2\x9Bx", 7, "a.yaml:1:7: error: bad word\n?[1m??x\n      ^\n");
    check_message("\xED\xA0\x80\xC0\xAF.", 5, "a.yaml:1:6: error: bad word\n?????.\n     ^\n");
}

TEST(message_long_line)
{
    char line[1001];
    memset(line, 'a', 1000);
    line[1000] = '\0';
    check_message(line, 500, "a.yaml:1:501: error: bad word\n");
    check_message(line, 0, formatted("a.yaml:1:1: error: bad word\n%.240s\n^\n", line));
}

TEST(message_without_place)
{
    MessageList messages = {0};
    message_warning(&messages, "one\n%d\x1B", 2);
    message_error(&messages, "three");
    assert_int_equal(message_count(&messages, MESSAGE_WARNING), 1);
    assert_int_equal(message_count(&messages, MESSAGE_ERROR), 1);
    OWNED char *text = printed(&messages);
    assert_string_equal(text, "glint: warning: one?2?\nglint: error: three\n");
    message_list_free(&messages);
    assert_int_equal(messages.count, 0);
    message_warning(NULL, "nobody reads this");
    assert_false(message_error(NULL, "nor %s", "this"));
}

TEST(text_grows)
{
    Text text = {0};
    assert_string_equal(text_c(&text), "");
    text_append(&text, "ab\0c", 4);
    for (int i = 0; i < 1000; i++)
        text_appendf(&text, "%03d", i);
    assert_int_equal(text.count, 3004);
    assert_memory_equal(text.items, "ab\0c000001", 10);
    assert_string_equal(text.items + 3001, "999");
    text_free(&text);
    assert_null(text.items);
}

TEST(text_quantities)
{
    static const struct {
        double value;
        const char *size, *duration;
    } cases[] = {
        {0, "0 bytes", "0 seconds"},          {1, "1 byte", "1 second"},
        {90, "90 bytes", "90 seconds"},       {120, "120 bytes", "2 minutes"},
        {1048575, "1.0 MiB", "12 days"},      {3400, "3.3 KiB", "57 minutes"},
        {7200, "7.0 KiB", "2 hours"},         {196e3, "191.4 KiB", "2 days"},
        {0x1p42, "4.0 TiB", "50903316 days"}, {0x1p80, "1099511627776.0 TiB", "1000000000 days"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        assert_string_equal(text_size(cases[i].value).text, cases[i].size);
        assert_string_equal(text_duration(cases[i].value).text, cases[i].duration);
    }
    assert_string_equal(text_number(50, 1).text, "5e+01");
    assert_string_equal(text_number(50, 6).text, "50");
    assert_string_equal(text_number(1. / 3, 1).text, "0.3333333333333333");
    assert_string_equal(text_number(-0x1p-1074, 1).text, "-5e-324");
    assert_string_equal(text_plural(0), "s");
    assert_string_equal(text_plural(1), "");
}

TEST(characters_have_sizes)
{
    assert_int_equal(text_character_size("a", 1), 1);
    assert_int_equal(text_character_size("\xC3\xA9", 2), 2);
    assert_int_equal(text_character_size("\xC3\xA9", 1), 0);
    assert_int_equal(text_character_size("\xF4\x8F\xBF\xBF", 4), 4);
    assert_int_equal(text_character_size("\xF4\x90\x80\x80", 4), 0);
    assert_int_equal(text_character_size("\xE0\x80\x80", 3), 0);
    assert_int_equal(text_character_size("\xC1\x81", 2), 0);
    assert_int_equal(text_character_size("", 0), 0);
}

TEST(nearest_text)
{
    const char *const known[] = {"radius", "center", "material", "color", "up", "angle"};
    const size_t count = COUNT_OF(known);
    assert_string_equal(text_nearest("radios", known, count), "radius");
    assert_string_equal(text_nearest("centre", known, count), "center");
    assert_string_equal(text_nearest("colour", known, count), "color");
    assert_string_equal(text_nearest("coolr", known, count), "color");
    assert_string_equal(text_nearest("meterail", known, count), "material");
    assert_string_equal(text_nearest("angel", known, count), "angle");
    assert_string_equal(text_nearest("up", known, count), "up");
    assert_null(text_nearest("shininess", known, count));
    assert_null(text_nearest("x", known, count));
    assert_null(text_nearest("", known, count));
    assert_null(text_nearest("rad", known, count));
    assert_null(text_nearest("radius", known, 0));
}

TEST(array)
{
    ARRAY_OF(uint64_t) numbers = {0};
    for (uint64_t i = 0; i < 5000; i++)
        array_push(numbers, i * i);
    assert_int_equal(numbers.count, 5000);
    assert_true(numbers.capacity >= numbers.count);
    for (uint64_t i = 0; i < 5000; i++)
        assert_int_equal(numbers.items[i], i * i);
    free(numbers.items);
}

TEST(read_failures)
{
    MessageList messages = {0};
    OwnedText text = {0};
    assert_false(text_read_file(&text, "nothing", &messages));
    check_only_message(&messages, "cannot read 'nothing': No such file or directory");
    assert_false(text_read_file(&text, ".", &messages));
    check_only_message(&messages, "cannot read '.': Is a directory");
}

static void product_wrap(void *unused)
{
    (void)unused;
    memory_product(SIZE_MAX / 2 + 1, 2);
}

// A product that wraps would make an allocation that is too small.
TEST(products_do_not_wrap)
{
    assert_int_equal(memory_product(3, 5), 15);
    assert_int_equal(memory_product(0, SIZE_MAX), 0);
    assert_true(memory_product(SIZE_MAX / 2, 2) == SIZE_MAX - 1);
    assert_int_equal(child_run(product_wrap, &(char){0}, 1).status, EXIT_MACHINE);
}

// Values published with the function: draft-eastlake-fnv, appendix "FNV-1a 64 bit".
TEST(hash)
{
    assert_true(hash_bytes(HASH_START, "", 0) == UINT64_C(0xcbf29ce484222325));
    assert_true(hash_bytes(HASH_START, "a", 1) == UINT64_C(0xaf63dc4c8601ec8c));
    assert_true(hash_bytes(HASH_START, "foobar", 6) == UINT64_C(0x85944171f73967e8));
    assert_true(hash_bytes(hash_bytes(HASH_START, "foo", 3), "bar", 3) == UINT64_C(0x85944171f73967e8));
}

// RFC 4648, section 10.
TEST(base64)
{
    static const char *const cases[][2] = {
        {"", ""},
        {"f", "Zg=="},
        {"fo", "Zm8="},
        {"foo", "Zm9v"},
        {"foob", "Zm9vYg=="},
        {"fooba", "Zm9vYmE="},
        {"foobar", "Zm9vYmFy"},
        {"\xFB\xFF", "+/8="},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        OwnedText text = {0};
        base64_append(&text, (const uint8_t *)cases[i][0], strlen(cases[i][0]));
        OwnedText bytes = {0};
        assert_true(base64_decode(&bytes, text.items, text.count));
        assert_string_equal(text_c(&bytes), cases[i][0]);
        assert_string_equal(text_c(&text), cases[i][1]);
    }
}

static void stage_check(Stage *stage, const char *expected)
{
    OwnedText text = {0};
    double seconds = -1;
    assert_int_equal(stage_write(stage, &text, &seconds), expected[0] != '\0');
    assert_string_equal(text_c(&text), expected);
    if (expected[0]) assert_true(seconds >= 0);
}

TEST(stems_of_files)
{
    static const char *const rows[][2] = {
        {"a/b.c/scene.v2.yaml", "scene.v2"}, {"a.d/scene", "scene"}, {".yaml", ".yaml"}, {"-", "image"}};
    for (size_t i = 0; i < COUNT_OF(rows); i++) {
        OWNED char *stem = file_stem(rows[i][0]);
        assert_string_equal(stem, rows[i][1]);
    }
}

TEST(stages)
{
    Stage *stage = stage_open(true);
    stage_check(stage, "");
    stage_begin(stage, "reading", "folder/a.obj", 200);
    stage_check(stage, "reading a.obj 0%");
    stage_set(stage, 82);
    stage_check(stage, "reading a.obj 41%");
    stage_begin(stage, "building", NULL, 4);
    stage_check(stage, "building 0%");
    stage_add(stage, 2);
    stage_add(stage, 1);
    stage_check(stage, "building 75%");
    stage_add(stage, 9); // more than there are
    stage_check(stage, "building 100%");
    size_t count;
    const HostSpan *spans = stage_spans(stage, &count);
    assert_int_equal(count, 1);
    assert_string_equal(spans[0].name, "reading a.obj");
    assert_true(spans[0].start_seconds <= spans[0].end_seconds);
    stage_begin(stage, "uploading", NULL, 0);
    stage_set(stage, 1);
    stage_check(stage, "uploading");
    stage_end(stage);
    stage_check(stage, "");
    stage_close(stage);
    // without a receiver
    stage_begin(NULL, "reading", "a.obj", 1);
    stage_set(NULL, 1);
    stage_add(NULL, 1);
    stage_end(NULL);
    stage_close(NULL);
}

TEST_MAIN(NULL, NULL)
