// Checks the tables of text that are made from a report's JSON.
#include "host/cli/result_text.h"
#include "tests/check.h"

#include <stdlib.h>

static const ResultTable scene_table = {
    .rows = "scenes.runs",
    .names = {"scene", "size", "precision", "lanes", "variant"},
    .values = {"frame ms", "wrong objects at edges=errors.object", "build=build", "over first=ratio",
               "energy"},
    .extras = {"kernel"},
};

static void row_notes(const void *context, size_t row, Text *notes)
{
    if (row == *(const size_t *)context) text_appendf(notes, "    a note\n");
}

static void assert_prints_table(const ResultTable *table, const char *document, const char *expected)
{
    const size_t noted = 1;
    char *printed = NULL;
    size_t length;
    FILE *stream = open_memstream(&printed, &length);
    json_t *loaded = json_loads(document, 0, NULL);
    assert_non_null(loaded);
    result_text_print(loaded, table, row_notes, &noted, stream);
    fclose(stream);
    json_decref(loaded);
    assert_string_equal(printed, expected);
    free(printed);
}

static void assert_prints(const char *document, const char *expected)
{
    assert_prints_table(&scene_table, document, expected);
}

TEST(a_table_shows_what_differs)
{
    assert_prints(
        "{\"scenes\": [{\"scene\": \"a.yaml\", \"size\": [32, 24], \"runs\": ["
        "{\"precision\": \"single\", \"lanes\": 8, \"variant\": \"\", \"frame ms\": 0.25, \"kernel\": \"f\","
        " \"errors\": {\"object\": 12}, \"build\": {\"reason\": \"not timed\"}},"
        "{\"precision\": \"double\", \"lanes\": 8, \"variant\": \"--samples\\t2\", \"frame ms\": 1234.5,"
        " \"errors\": {\"object\": null}, \"build\": 3, \"ratio\": {\"ratio\": 2.0, \"low\": 1.5, \"high\": "
        "2.5}},"
        "{\"precision\": \"certified\", \"lanes\": 8, \"status\": \"unavailable\", \"reason\": \"no "
        "fp64\"}]}]}",
        "\n"
        "a.yaml, 32x24, lanes 8\n"
        "                                     wrong\n"
        "                                   objects                           over\n"
        "precision  variant      frame ms  at edges  build                   first\n"
        "single     \"\"             0.2500        12      -\n"
        "double     --samples 2      1234         -      3  2.000 (1.500 to 2.500)\n"
        "    a note\n"
        "certified               unavailable: no fp64\n"
        "build: not timed\n");
}

TEST(each_scene_has_a_table)
{
    const char *const run = "{\"precision\": \"single\", \"frame ms\": 1e-7}";
    char *document =
        text_format("{\"scenes\": [{\"scene\": \"a\", \"runs\": [%s]}, {\"scene\": \"a\", \"runs\": [%s]},"
                    " {\"scene\": \"b\", \"runs\": []}]}",
                    run, run);
    assert_prints(document, "\na, precision single\nframe ms\n1.00e-07\n"
                            "\na, precision single\nframe ms\n1.00e-07\n    a note\n");
    free(document);
    assert_prints(
        "{\"scenes\": [{\"scene\": \"a\", \"runs\": [{\"status\": \"unavailable\", \"reason\": \"lost\"}]}]}",
        "\na\nunavailable: lost\n");
}

TEST(one_table_has_all_scenes)
{
    static const ResultTable table = {
        .rows = "scenes.runs",
        .names = {"scene", "size", "lanes", "report"},
        .values = {"ms"},
        .is_one_table = true,
    };
    assert_prints_table(
        &table,
        "{\"scenes\": [{\"scene\": \"a\", \"lanes\": 8, \"size\": [4, 3], \"runs\": [{\"report\": \"A\", "
        "\"ms\": 1},"
        " {\"report\": \"B\", \"ms\": 2}, {\"report\": \"C\", \"lanes\": 1, \"ms\": 3}]},"
        " {\"scene\": \"b\", \"lanes\": 8, \"size\": [4, 3], \"runs\": [{\"report\": \"A\", \"ms\": 4}]}]}",
        "\n"
        "4x3\n"
        "scene  lanes  report  ms\n"
        "a          8  A        1\n"
        "              B        2\n"
        "    a note\n"
        "           1  C        3\n"
        "b          8  A        4\n");
}

TEST(a_sole_name_is_a_column)
{
    static const ResultTable table = {
        .rows = "runs", .names = {"run"}, .values = {"ms"}, .is_one_table = true};
    assert_prints_table(&table, "{\"runs\": [{\"run\": 0, \"ms\": 1}]}", "run  ms\n  0   1\n");
}

TEST_MAIN(NULL, NULL)
