// Feeds damaged files to one reader, in this process: fuzz_scene FORMAT RUNS SEED FILE…
//
// FORMAT is yaml, rt, cfg, nff or dat for scenes, or the ending of a mesh. Meshes that assimp reads are each
// read in a separate process. The same arguments give the same inputs. Build it with sanitizers. It fails
// only if a reader crashes, leaks or hangs, which assimp may, and then leaves the input in fuzz_scene.input
// (with sanitizers, if ASAN_OPTIONS=abort_on_error=1).
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/import/load.h"
#include "host/import/mesh/mesh_import.h"
#include "host/scene/scene.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <unistd.h>

// A reader may take so long per input: of the processor, because a busy machine stops any process for
// seconds, and in all, for one that waits. Assimp's process ends by itself in 120 s.
enum { PROCESSOR_SECONDS_ALLOWED = 5, SECONDS_ALLOWED = 150, LENGTH_MAX = 1 << 16, EDITS_MAX = 6 };

typedef struct {
    Text *items;
    size_t count, capacity;
} Seeds;

static const char *input;
static size_t input_length;

// The state of SplitMix64 (Steele, Lea and Flood, Fast splittable pseudorandom number generators, 2014,
// figure 17).
static uint64_t random_state;

static size_t random_below(size_t limit)
{
    uint64_t z = (random_state += 0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return limit ? (size_t)((z ^ (z >> 31)) % limit) : 0;
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

static void edit_flip_bits(Text *text)
{
    if (text->count) text->items[random_below(text->count)] ^= (char)(1 << random_below(8));
}

static void edit_replace_by_word(Text *text)
{
    static const char *const words[] = {"nan",    "inf",
                                        "-",      "1e999",
                                        "1e-999", "0x10",
                                        "-1",     "0",
                                        "1e30",   ",",
                                        ", ",     "[",
                                        "]",      "{",
                                        "}",      ":",
                                        ": ",     "-",
                                        "- ",     "&a",
                                        "*a",     "!t",
                                        "|",      ">",
                                        "\"",     "'",
                                        "\\",     "#",
                                        "\n",     "\t",
                                        "\r",     "---",
                                        "?",      "? ",
                                        "=>",     "<<",
                                        "%",      "@",
                                        "null",   "\n\n ",
                                        "\xff",   "\xc3",
                                        "~",      "{}",
                                        "[]",     "sp",
                                        "cy",     "C",
                                        "pp 4",   "p 3",
                                        "true",   "\xef\xbb\xbf",
                                        "...",    "\xe2\x80\xa8",
                                        "<<: *a"};
    const char *word = words[random_below(COUNT_OF(words))];
    size_t start = random_below(text->count + 1);
    size_t removed = random_below(4);
    if (removed > text->count - start) removed = text->count - start;
    text_replace(text, start, removed, word, strlen(word));
}

static void edit_remove(Text *text)
{
    size_t start = random_below(text->count + 1);
    text_replace(text, start, random_below((text->count - start) / 4 + 1), "", 0);
}

static void edit_random_bytes(Text *text)
{
    char bytes[16] = {0};
    size_t length = random_below(sizeof bytes + 1);
    for (size_t i = 0; i < length; i++)
        bytes[i] = (char)random_below(256);
    text_replace(text, random_below(text->count + 1), 0, bytes, length);
}

static void edit_repeat_line(Text *text)
{
    if (!text->count) return;
    size_t start = random_below(text->count), end = start;
    while (start > 0 && text->items[start - 1] != '\n')
        start--;
    while (end < text->count && text->items[end] != '\n')
        end++;
    end += end < text->count;
    Text line = {0};
    text_append(&line, text->items + start, end - start);
    for (size_t times = 1 + random_below(40); times && text->count < LENGTH_MAX; times--)
        text_replace(text, start, 0, line.items, line.count);
    text_free(&line);
}

static void edit_splice(Text *text, const Text *other)
{
    size_t start = random_below(other->count + 1);
    text_replace(text, random_below(text->count + 1), 0, other->items + start,
                 random_below(other->count - start + 1));
}

static void text_damage(Text *text, const Seeds *seeds)
{
    void (*const edits[])(Text *) = {edit_truncate,        edit_flip_bits, edit_replace_by_word,
                                     edit_replace_by_word, edit_remove,    edit_random_bytes,
                                     edit_repeat_line};
    for (size_t left = 1 + random_below(EDITS_MAX); left; left--) {
        size_t edit = random_below(COUNT_OF(edits) + 1);
        if (edit < COUNT_OF(edits))
            edits[edit](text);
        else
            edit_splice(text, &seeds->items[random_below(seeds->count)]);
    }
}

static bool scene_read(const char *format, const char *bytes, size_t length)
{
    Source source = {.file = "fuzz", .bytes = bytes, .length = length};
    SceneOptions options = {.lenient = random_below(2)};
    MessageList messages = {0};
    Scene scene = {0};
    bool read = !strcmp(format, "rt")    ? scene_read_rt(&scene, &source, &options, &messages)
                : !strcmp(format, "cfg") ? scene_read_cfg(&scene, &source, &messages)
                : !strcmp(format, "nff") ? scene_read_nff(&scene, &source, &messages)
                : !strcmp(format, "dat") ? scene_read_dat(&scene, &source, &messages)
                                         : scene_read_yaml(&scene, &source, &options, &messages);
    if (read == (message_count(&messages, MESSAGE_ERROR) > 0)) abort(); // errors and the verdict must agree
    scene_free(&scene);
    message_list_free(&messages);
    return read;
}

static size_t crash_count; // assimp's processes that crashed or reached a limit

// Writes a file of the format in the working folder and reads it.
static bool mesh_read(const char *format, const char *bytes, size_t length)
{
    char path[32];
    snprintf(path, sizeof path, "fuzz_scene.%s", format);
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(bytes, 1, length, file) != length || fclose(file) != 0)
        fault("cannot write '%s'", path);
    const Source source = {.file = "fuzz.yaml", .bytes = ""};
    MessageList messages = {0};
    Report report = report_open(&source, &messages);
    const MeshImport import = {
        .path = path, .transform = affine_identity, .own_materials = random_below(2), .report = &report};
    Scene scene = {0};
    uint32_t index;
    const bool read = mesh_import(&scene, &import, &index);
    report_close(&report);
    for (size_t i = 0; i < messages.count; i++)
        crash_count += strstr(messages.items[i].text, "assimp crashes") ||
                       strstr(messages.items[i].text, "assimp needs");
    if (read == (message_count(&messages, MESSAGE_ERROR) > 0)) abort();
    scene_free(&scene);
    message_list_free(&messages);
    unlink(path);
    return read;
}

static bool is_scene(const char *format)
{
    return !strcmp(format, "yaml") || !strcmp(format, "rt") || !strcmp(format, "cfg") ||
           !strcmp(format, "nff") || !strcmp(format, "dat");
}

static void keep_input(int signal_number)
{
    static const char hang[] = "fuzz_scene: a hang\n", crash[] = "fuzz_scene: a crash\n";
    bool hangs = signal_number != SIGABRT;
    int file = open("fuzz_scene.input", O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (write(STDERR_FILENO, hangs ? hang : crash, hangs ? sizeof hang - 1 : sizeof crash - 1) < 0 ||
        file < 0 || write(file, input, input_length) < 0)
        _exit(EXIT_MACHINE);
    signal(SIGABRT, SIG_DFL);
    abort();
}

// Starts the two clocks of an input, or stops them.
static void limit_seconds(int processor_seconds, int seconds)
{
    setitimer(ITIMER_PROF, &(struct itimerval){.it_value.tv_sec = processor_seconds}, NULL);
    alarm((unsigned)seconds);
}

int main(int argument_count, char **arguments)
{
    if (argument_count < 5) {
        fputs("usage: fuzz_scene FORMAT RUNS SEED FILE...\n", stderr);
        return EXIT_USER;
    }
    const char *format = arguments[1];
    long run_count = strtol(arguments[2], NULL, 10), read_count = 0;
    random_state = strtoull(arguments[3], NULL, 10);
    Seeds seeds = {0};
    for (int i = 4; i < argument_count; i++) {
        MessageList messages = {0};
        Text text = {0};
        if (!text_read_file(&text, arguments[i], &messages)) {
            message_list_print(&messages, stderr);
            return EXIT_USER;
        }
        array_push(seeds, text);
    }
    signal(SIGALRM, keep_input);
    signal(SIGPROF, keep_input);
    signal(SIGABRT, keep_input);

    double start = clock_seconds();
    for (long run = 0; run < run_count; run++) {
        const Text *seed = &seeds.items[random_below(seeds.count)];
        Text text = {0};
        text_append(&text, seed->items, seed->count);
        text_damage(&text, &seeds);
        // The buffer has exactly this length, so that the sanitizer sees a read past the end.
        char *bytes = memory_allocate(text.count + !text.count, 1);
        memcpy(bytes, text.items, text.count);
        input = bytes;
        input_length = text.count;
        limit_seconds(is_scene(format) ? PROCESSOR_SECONDS_ALLOWED : SECONDS_ALLOWED, SECONDS_ALLOWED);
        read_count += (is_scene(format) ? scene_read : mesh_read)(format, bytes, text.count);
        limit_seconds(0, 0);
        input_length = 0;
        free(bytes);
        text_free(&text);
    }
    double seconds = clock_seconds() - start;
    printf("%s: %ld runs, %ld of them valid, %.0f runs a second", format, run_count, read_count,
           (double)run_count / seconds);
    printf(crash_count > 0 ? ", %zu that assimp fails on\n" : "\n", crash_count);
    for (size_t i = 0; i < seeds.count; i++)
        text_free(&seeds.items[i]);
    free(seeds.items);
    return EXIT_DONE;
}
