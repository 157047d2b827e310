// Feeds randomly damaged files to the readers of tests/fuzz/readers.c in a sanitized build. tools/fuzz
// generates inputs guided by coverage.
// run_tests: sanitized
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"
#include "tests/film.h"
#include "tests/fuzz/readers.h"
#include <glob.h>

// A reader that takes longer for one input ends by SIGALRM.
enum { SECONDS_MAX = 20, LENGTH_MAX = 1 << 16, EDITS_MAX = 6 };

typedef ARRAY_OF(Text) Seeds;

static Random random_state;

static size_t random_below(size_t limit)
{
    return limit > 0 ? (size_t)(random_bits(&random_state) % limit) : 0;
}

static void text_replace(Text *text, size_t start, size_t removed, const char *bytes, size_t length)
{
    Text result = {0};
    text_append(&result, text->items, start);
    text_append(&result, bytes, length);
    text_append(&result, text->items + start + removed, text->count - start - removed);
    text_free(text);
    *text = result;
}

static void edit_truncate(Text *text)
{
    text->count = random_below(text->count + 1);
}

static void edit_flip_bit(Text *text)
{
    if (text->count > 0) text->items[random_below(text->count)] ^= (char)(1 << random_below(8));
}

static void edit_replace_by_word(Text *text)
{
    static const char *const words[][9] = {
        {"nan", "inf", "-", "1e999", "1e-999", "0x10", "-1", "0", "1e30"},
        {",", "[", "]", "{", "}", ":", ": ", "- ", "&a"},
        {"*a", "!t", "|", ">", "\"", "'", "\\", "#", "\n"},
        {"\t", "\r", "---", "? ", "=>", "<<", "%", "@", "null"},
        {"~", "{}", "[]", "sp", "cy", "\xff", "\xc3", "C", "pp 4"},
        {"p 3", "...", "true", ", ", "?", "\n\n ", "\xef\xbb\xbf", "\xe2\x80\xa8", "<<: *a"},
    };
    const char *word = words[random_below(COUNT_OF(words))][random_below(COUNT_OF(words[0]))];
    const size_t start = random_below(text->count + 1), rest = text->count - start, removed = random_below(4);
    text_replace(text, start, removed < rest ? removed : rest, word, strlen(word));
}

static void edit_remove(Text *text)
{
    const size_t start = random_below(text->count + 1);
    text_replace(text, start, random_below((text->count - start) / 4 + 1), "", 0);
}

static void edit_insert_bytes(Text *text)
{
    char bytes[16];
    const size_t length = random_below(sizeof bytes + 1);
    for (size_t i = 0; i < length; i++)
        bytes[i] = (char)random_below(256);
    text_replace(text, random_below(text->count + 1), 0, bytes, length);
}

static void edit_repeat_line(Text *text)
{
    size_t start = random_below(text->count), end = start;
    while (start > 0 && text->items[start - 1] != '\n')
        start--;
    while (end < text->count && text->items[end] != '\n')
        end++;
    end += end < text->count;
    Text line = {0};
    text_append(&line, text->items + start, end - start);
    for (size_t times = 1 + random_below(40); times > 0 && text->count < LENGTH_MAX; times--)
        text_replace(text, start, 0, line.items, line.count);
    text_free(&line);
}

static void edit_splice(Text *text, const Text *other)
{
    const size_t start = random_below(other->count + 1);
    text_replace(text, random_below(text->count + 1), 0, other->items + start,
                 random_below(other->count - start + 1));
}

static void text_damage(Text *text, const Seeds *seeds)
{
    void (*const edits[])(Text *) = {edit_truncate,        edit_flip_bit, edit_replace_by_word,
                                     edit_replace_by_word, edit_remove,   edit_insert_bytes,
                                     edit_repeat_line};
    for (size_t left = 1 + random_below(EDITS_MAX); left > 0; left--) {
        const size_t edit = random_below(COUNT_OF(edits) + 1);
        if (edit < COUNT_OF(edits))
            edits[edit](text);
        else
            edit_splice(text, &seeds->items[random_below(seeds->count)]);
    }
}

// Appends the files that a pattern matches.
static void files_add(Seeds *seeds, const char *pattern)
{
    glob_t paths;
    if (glob(pattern, 0, NULL, &paths) != 0) return;
    for (size_t i = 0; i < paths.gl_pathc; i++) {
        Text seed = file_text(paths.gl_pathv[i]);
        if (seed.count > LENGTH_MAX) seed.count = LENGTH_MAX;
        array_push(*seeds, seed);
    }
    globfree(&paths);
}

static void seeds_free(Seeds *seeds)
{
    for (size_t i = 0; i < seeds->count; i++)
        text_free(&seeds->items[i]);
    free(seeds->items);
}

typedef struct {
    const char *reader, *broken; // the folder of the scenes of tests/broken
    size_t run_count, run;       // the current one
} Feeding;

// Feeds the reader. The inputs are the same in each run of the test.
static void reader_feed(void *context)
{
    Feeding *feeding = context;
    setenv("GLINT_FUZZ", feeding->reader, 1);
    LLVMFuzzerInitialize(NULL, NULL);
    Seeds seeds = {0};
    files_add(&seeds, formatted("tests/fuzz/corpus/%s/*", feeding->reader));
    files_add(&seeds, formatted("tests/scenes/*.%s", feeding->reader));
    files_add(&seeds, formatted("%s/*.%s", feeding->broken, feeding->reader));
    assert_true(seeds.count > 0);
    random_state = (Random){1};
    for (feeding->run = 0; feeding->run < feeding->run_count; feeding->run++) {
        const Text *seed = &seeds.items[random_below(seeds.count)];
        Text text = {0};
        text_append(&text, seed->items, seed->count);
        text_damage(&text, &seeds);
        alarm(SECONDS_MAX);
        LLVMFuzzerTestOneInput((const uint8_t *)text.items, text.count);
        text_free(&text);
    }
    seeds_free(&seeds);
}

TEST(readers_survive_damage)
{
    static const char *const readers[] = {
        "png",  "jpeg", "ppm", "exr", "npy", "obj",   "mtl",        "ply",   "stl",      "gltf",  "glb",
        "yaml", "rt",   "cfg", "nff", "dat", "reply", "checkpoint", "cache", "baseline", "golden"};
    char *broken = folder_make();
    const char *write_tables = formatted(
        "for table in tests/broken/*.txt; do tests/scene_tables.py $table %s || exit; done", broken);
    assert_int_equal(system(write_tables), 0);
    for (size_t i = 0; i < COUNT_OF(readers); i++) {
        Feeding feeding = {readers[i], broken, tests_are_long() ? 20000 : 1000, 0};
        const ChildEnd end = child_run(reader_feed, &feeding, sizeof feeding);
        if (end.status != 0)
            fail_msg("reader %s, input %zu: exit status %d, signal %d: %s", readers[i], feeding.run,
                     end.status, end.signal, end.errors);
    }
    folder_remove(broken);
}

TEST_MAIN(NULL, NULL)
