// Tests messages with their place, growing text, similar words, stages, hashes, and output files next to
// their target.
#include "host/base/base64.h"
#include "host/base/fault.h"
#include "host/base/hash.h"
#include "host/base/output.h"
#include "host/base/stage.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

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

// These replace libc's functions.
static bool modes_are_refused, unnamed_are_refused, syncs_fail, is_killed_at_rename;
static int sync_count;

int fchmod(int descriptor, mode_t mode) // NOLINT(readability-inconsistent-declaration-parameter-name)
{
    if (!modes_are_refused) return (int)syscall(SYS_fchmod, descriptor, mode);
    errno = EPERM;
    return -1;
}

int openat(int at, const char *path, int flags, ...) // NOLINT
{
    va_list arguments;
    va_start(arguments, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    if (!unnamed_are_refused || (flags & O_TMPFILE) != O_TMPFILE)
        return (int)syscall(SYS_openat, at, path, flags, mode);
    errno = EOPNOTSUPP;
    return -1;
}

int renameat(int from_at, const char *from, int to_at, const char *to) // NOLINT
{
    if (is_killed_at_rename) raise(SIGKILL);
    return (int)syscall(SYS_renameat2, from_at, from, to_at, to, 0);
}

int fsync(int descriptor) // NOLINT(readability-inconsistent-declaration-parameter-name)
{
    sync_count++;
    if (!syncs_fail) return (int)syscall(SYS_fsync, descriptor);
    errno = EIO;
    return -1;
}

TEST(committed_output)
{
    MessageList messages = {0};
    OutputFile output;
    mode_t mask = umask(027);
    sync_count = 0;
    assert_true(output_open(&output, "new", &messages));
    assert_int_equal(access("new", F_OK), -1);
    assert_true(output_write(&output, "whole", 5, &messages));
    assert_true(output_commit(&output, &messages));
    umask(mask);
    check_content("new", "whole");
    assert_int_equal(folder_count(".glint-"), 0);
    assert_int_equal(sync_count, 2); // the file and its folder
    assert_int_equal(mode_of("new"), 0640);
    assert_int_equal(messages.count, 0);
    unlink("new");
}

static void output_write_new(OutputFile *output, const char *path, MessageList *messages)
{
    assert_true(output_open(output, path, messages));
    assert_true(output_write(output, "new", 3, messages));
}

TEST(output_replaces_what_a_link_leads_to)
{
    MessageList messages = {0};
    OutputFile output;
    file_write("real", "old");
    assert_int_equal(chmod("real", 0604), 0);
    assert_int_equal(symlink("real", "link"), 0);
    output_write_new(&output, "link", &messages);
    check_content("link", "old");
    assert_true(output_commit(&output, &messages));
    check_content("real", "new");
    assert_int_equal(mode_of("real"), 0604);
    struct stat status;
    assert_int_equal(lstat("link", &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    unlink("link");
    unlink("real");
}

// Relative to the folder of each link on the way.
TEST(output_makes_what_a_link_leads_to)
{
    MessageList messages = {0};
    OutputFile output;
    assert_int_equal(mkdir("folder", 0700), 0);
    assert_int_equal(symlink("folder/link", "link"), 0);
    assert_int_equal(symlink("../made", "folder/link"), 0);
    output_write_new(&output, "link", &messages);
    assert_true(output_commit(&output, &messages));
    check_content("made", "new");
    struct stat status;
    assert_int_equal(lstat("link", &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    assert_int_equal(lstat("folder/link", &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    unlink("made");
    unlink("link");

    assert_int_equal(symlink("link", "link"), 0);
    assert_false(output_open(&output, "link", &messages));
    check_only_message(&messages, "cannot create 'link': Too many levels of symbolic links");
    unlink("link");
    unlink("folder/link");
    rmdir("folder");
}

TEST(output_where_there_are_no_modes)
{
    MessageList messages = {0};
    OutputFile output;
    file_write("new", "old");
    modes_are_refused = true;
    assert_true(output_open(&output, "new", &messages));
    modes_are_refused = false;
    assert_true(output_write(&output, "new", 3, &messages));
    assert_true(output_commit(&output, &messages));
    assert_int_equal(mode_of("new"), 0600);
    check_content("new", "new");
    unlink("new");
}

TEST(finished_output)
{
    MessageList messages = {0};
    OutputFile output;
    file_write("kept", "old");
    output_write_new(&output, "kept", &messages);
    assert_true(output_finish(&output, &messages));
    check_content("kept", "old");
    assert_true(output_commit(&output, &messages));
    check_content("kept", "new");
    syncs_fail = true;
    output_write_new(&output, "new", &messages);
    assert_false(output_finish(&output, &messages));
    syncs_fail = false;
    check_only_message(&messages, "cannot write 'new': Input/output error");
    assert_int_equal(access("new", F_OK), -1);
    assert_true(output_open(&output, "/dev/full", &messages));
    assert_true(output_write(&output, "x", 1, &messages));
    assert_false(output_finish(&output, &messages));
    check_only_message(&messages, "cannot write '/dev/full': No space left on device");
    unlink("kept");
}

TEST(output_failures)
{
    MessageList messages = {0};
    OutputFile output;
    assert_false(output_open(&output, "nowhere/new", &messages));
    check_only_message(&messages, "cannot create 'nowhere/new': No such file or directory");
    assert_false(output_open(&output, "/", &messages));
    check_only_message(&messages, "cannot write '/': Is a directory");
    assert_false(output_open(&output, "", &messages));
    check_only_message(&messages, "cannot create '': No such file or directory");
    assert_true(output_open(&output, "/dev/full", &messages));
    assert_null(output.temporary);
    assert_true(output_write(&output, "x", 1, &messages)); // buffered
    assert_false(output_commit(&output, &messages));
    check_only_message(&messages, "cannot write '/dev/full': No space left on device");
    assert_true(output_open(&output, "/dev/null", &messages));
    assert_true(output_write(&output, "x", 1, &messages));
    assert_true(output_commit(&output, &messages));
}

TEST(abandoned_output)
{
    MessageList messages = {0};
    OutputFile output;
    file_write("kept", "old");
    for (int named = 0; named < 2; named++) {
        unnamed_are_refused = named == 1;
        output_write_new(&output, "kept", &messages);
        assert_int_equal(folder_count(".glint-"), named);
        output_abandon(&output);
        assert_int_equal(folder_count(".glint-"), 0);
        check_content("kept", "old");
    }
    unnamed_are_refused = false;
    unlink("kept");
}

typedef enum { WRITING, WRITING_NAMED, RENAMING, FAULTING } EndedWhile;

// Writes in a process that is killed or faults, and checks that the old file stays whole.
static void output_in_ended_process(EndedWhile ended_while)
{
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        MessageList messages = {0};
        OutputFile output;
        unnamed_are_refused = ended_while == WRITING_NAMED || ended_while == FAULTING;
        is_killed_at_rename = ended_while == RENAMING;
        if (!output_open(&output, "kept", &messages) || !output_write(&output, "new", 3, &messages)) _exit(9);
        fflush(output.file);
        if (ended_while == RENAMING) output_commit(&output, &messages);
        if (ended_while == FAULTING && freopen("/dev/null", "w", stderr)) fault("as meant");
        raise(SIGKILL);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    if (ended_while != FAULTING)
        assert_true(WIFSIGNALED(status));
    else
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == EXIT_MACHINE);
    check_content("kept", "old");
}

// A process that is killed while it writes leaves nothing if files need no name. Otherwise the next process
// removes what it left, but not the files of a living process.
TEST(output_of_killed_processes)
{
    MessageList messages = {0};
    OutputFile living, output;
    file_write("kept", "old");
    output_in_ended_process(WRITING);
    assert_int_equal(folder_count(".glint-"), 0);
    static const EndedWhile leaving[] = {WRITING_NAMED, RENAMING};
    for (size_t i = 0; i < 2; i++) {
        output_in_ended_process(leaving[i]);
        assert_int_equal(folder_count(".glint-"), 1);
        unnamed_are_refused = true;
        output_write_new(&living, "kept", &messages);
        assert_int_equal(folder_count(".glint-"), 1);
        output_write_new(&output, "kept", &messages);
        assert_int_equal(folder_count(".glint-"), 2);
        assert_true(output_commit(&living, &messages));
        assert_true(output_commit(&output, &messages));
        unnamed_are_refused = false;
        assert_int_equal(folder_count(".glint-"), 0);
        check_content("kept", "new");
        file_write("kept", "old");
    }
    assert_int_equal(messages.count, 0);
    unlink("kept");
}

// A process that faults while a named temporary is half written exits with status 2 and leaves the old file
// whole and nothing next to it.
TEST(fault_removes_the_temporary)
{
    file_write("kept", "old");
    output_in_ended_process(FAULTING);
    assert_int_equal(folder_count(".glint-"), 0);
    unlink("kept");
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

TEST_MAIN(folder_open, folder_close)
