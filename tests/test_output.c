// Tests output files, which are written next to their target, synced and renamed: what replaces what, links,
// failures, and processes that end while they write.
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/output.h"
#include "host/cli/command_line.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

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

static bool removed_are_locked;

// Records whether another process would have to wait for the lock of the file.
int unlinkat(int at, const char *path, int flags) // NOLINT
{
    const int other = openat(at, path, O_RDONLY | O_CLOEXEC);
    removed_are_locked = other >= 0 && flock(other, LOCK_EX | LOCK_NB) != 0;
    if (other >= 0) close(other);
    return (int)syscall(SYS_unlinkat, at, path, flags);
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

TEST(committed_file_is_whole)
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

static void assert_link(const char *path)
{
    struct stat status;
    assert_int_equal(lstat(path, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
}

TEST(what_a_link_leads_to_is_replaced)
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
    assert_link("link");
    unlink("link");
    unlink("real");
}

// Relative to the folder of each link on the way.
TEST(what_a_link_leads_to_is_made)
{
    MessageList messages = {0};
    OutputFile output;
    assert_int_equal(mkdir("folder", 0700), 0);
    assert_int_equal(symlink("folder/link", "link"), 0);
    assert_int_equal(symlink("../made", "folder/link"), 0);
    output_write_new(&output, "link", &messages);
    assert_true(output_commit(&output, &messages));
    check_content("made", "new");
    assert_link("link");
    assert_link("folder/link");
    unlink("made");
    unlink("link");

    assert_int_equal(symlink("link", "link"), 0);
    assert_false(output_open(&output, "link", &messages));
    check_only_message(&messages, "cannot create 'link': Too many levels of symbolic links");
    unlink("link");
    unlink("folder/link");
    rmdir("folder");
}

TEST(file_systems_may_have_no_modes)
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

TEST(finished_file_is_yet_to_be_renamed)
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

TEST(failures)
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

TEST(abandoned_file_leaves_nothing)
{
    MessageList messages = {0};
    OutputFile output;
    file_write("kept", "old");
    for (int named = 0; named < 2; named++) {
        unnamed_are_refused = named == 1;
        output_write_new(&output, "kept", &messages);
        assert_int_equal(folder_count(".glint-"), named);
        removed_are_locked = false;
        output_abandon(&output);
        // otherwise another process could reuse the name before it is removed
        assert_int_equal(removed_are_locked, named);
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
TEST(killed_processes_leave_whole_files)
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

// Where no unnamed file was possible, the process that opened a file can commit it after a child has ended.
TEST(forked_process_keeps_the_temporary)
{
    MessageList messages = {0};
    OutputFile output;
    unnamed_are_refused = true;
    assert_true(output_open(&output, "new", &messages));
    const pid_t child = fork();
    if (child == 0) exit(EXIT_DONE);
    assert_int_equal(waitpid(child, NULL, 0), child);
    assert_true(output_write(&output, "new", 3, &messages));
    assert_true(output_commit(&output, &messages));
    unnamed_are_refused = false;
    check_content("new", "new");
    unlink("new");
}

static void output_lose(void *unused)
{
    (void)unused;
    assert_non_null(freopen("/dev/full", "w", stdout));
    setvbuf(stdout, NULL, _IONBF, 0);
    printf("lost");
    errno = ENOENT; // of a later call
    exit(command_finish(EXIT_DONE));
}

// A write that failed earlier, and whose reason is lost, is not reported with that of another call.
TEST(a_lost_write)
{
    if (access("/dev/full", W_OK) != 0) skip();
    char unused = 0;
    ChildEnd end = child_run(output_lose, &unused, sizeof unused);
    assert_string_equal(end.errors, "glint: cannot write to standard output: Input/output error\n");
    assert_int_equal(end.status, EXIT_MACHINE);
}

TEST_MAIN(folder_open, folder_close)
