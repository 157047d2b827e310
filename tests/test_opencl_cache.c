// Tests the kernel cache on disk, for which no device is needed.
#include "host/opencl/cache.h"
#include "host/opencl/compose.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

static const char key[] = "device x\ntext y";
static const char machine_code[] = "machine\0code\xff\n";
enum { CODE_LENGTH = sizeof machine_code, FORMAT_OFFSET = 8, FORMAT_END = 16 };

static void store(const char *entry_key)
{
    OwnedText binary = {0};
    text_append(&binary, machine_code, CODE_LENGTH);
    cache_store(entry_key, &binary, NULL);
}

static bool loads_with(const char *entry_key, WarningReceiver *warnings)
{
    OwnedText binary = {0};
    bool found = cache_load(entry_key, &binary, warnings);
    if (found) {
        assert_int_equal(binary.count, CODE_LENGTH);
        assert_memory_equal(binary.items, machine_code, CODE_LENGTH);
    } else {
        assert_int_equal(binary.count, 0);
    }
    return found;
}

static bool loads(const char *entry_key)
{
    return loads_with(entry_key, NULL);
}

TEST_WITH(stored_entries_are_loaded, scratch_set_up, scratch_tear_down)
{
    assert_false(loads(key));
    store(key);
    assert_true(loads(key));
    assert_false(loads("device x\ntext z"));
    assert_false(loads(""));

    struct stat status;
    assert_int_equal(stat(formatted("%s/glint", scratch), &status), 0);
    assert_int_equal(status.st_mode & 0777, 0700);
}

static void entry_set_used(const char *entry_key, time_t when)
{
    OWNED char *path = cache_entry_path(entry_key);
    const struct timespec moments[2] = {{when, 0}, {when, 0}};
    assert_int_equal(utimensat(AT_FDCWD, path, moments, 0), 0);
}

// Whatever the umask permits, entries are private.
TEST_WITH(files_are_private, scratch_set_up, scratch_tear_down)
{
    mode_t before = umask(0);
    store(key);
    umask(before);
    OWNED char *path = cache_entry_path(key), *cache = cache_folder_path();
    assert_int_equal(mode_of(path), 0600);
    assert_int_equal(mode_of(cache), 0700);
    assert_int_equal(mode_of(formatted("%s/hash-key", cache)), 0600);
}

static void warnings_print(void *context, MessageList *warnings)
{
    (void)context;
    message_list_print(warnings, stderr);
}

static void load_twice(void *result)
{
    WarningReceiver warnings = {.deliver = warnings_print};
    *(bool *)result = loads_with(key, &warnings);
    *(bool *)result |= loads_with(key, &warnings);
}

static void store_and_list(void *result)
{
    store(key);
    MessageList messages = {0};
    CacheEntries entries;
    *(bool *)result = cache_list(&entries, &messages) || cache_clear(&messages);
}

static void load_without_rights(void *result)
{
    if (geteuid() != 0 || setuid(65534) == 0) load_twice(result);
}

// Expects a miss and one warning. Runs in a separate process, which may drop its privileges.
static void assert_load_refused(void (*load)(void *result), const char *reason)
{
    bool loaded = true;
    ChildEnd end = child_run(load, &loaded, sizeof loaded);
    assert_int_equal(end.status, 0);
    assert_false(loaded);
    if (!strstr(end.errors, reason)) print_error("%s", end.errors);
    assert_non_null(strstr(end.errors, reason));
    assert_null(strstr(strchr(end.errors, '\n'), "warning"));
}

static void assert_refused(const char *reason)
{
    assert_load_refused(load_twice, reason);
}

// An entry that others may have written is not loaded, and replaced.
TEST_WITH(entry_that_others_can_access_is_replaced, scratch_set_up, scratch_tear_down)
{
    static const mode_t modes[] = {0620, 0602, 0644};
    OWNED char *path = cache_entry_path(key);
    for (size_t i = 0; i < COUNT_OF(modes); i++) {
        store(key);
        assert_int_equal(chmod(path, modes[i]), 0);
        assert_refused("others may access it");
        store(key);
        assert_true(loads(key));
        assert_int_equal(mode_of(path), 0600);
    }
}

// Nothing is loaded from a folder that belongs to another user, or stored in it.
TEST_WITH(folder_of_others_is_not_used, scratch_set_up, scratch_tear_down)
{
    OWNED char *path = cache_entry_path(key), *cache = cache_folder_path(), *moved = NULL;
    assert_true(asprintf(&moved, "%s/moved", scratch) > 0);
    for (int type = 0; type < 3; type++) {
        store(key);
        assert_true(loads(key));
        if (type == 0) {
            assert_int_equal(chmod(cache, 0770), 0);
        } else if (type == 1) {
            assert_int_equal(rename(cache, moved), 0);
            assert_int_equal(symlink(moved, cache), 0);
        } else if (geteuid() == 0) {
            assert_int_equal(chown(cache, 65534, 65534), 0);
        } else {
            continue;
        }
        static const char *const reasons[] = {"others may access it", "it is a symbolic link",
                                              "it belongs to another user"};
        assert_refused(reasons[type]);
        assert_int_equal(unlink(path), 0);
        bool used = true;
        assert_int_equal(child_run(store_and_list, &used, sizeof used).status, 0);
        assert_false(used);
        assert_int_equal(access(path, F_OK), -1);
        if (type == 0) {
            assert_int_equal(chmod(cache, 0700), 0);
        } else if (type == 1) {
            assert_int_equal(unlink(cache), 0);
            assert_int_equal(rename(moved, cache), 0);
        }
    }
}

// Entries are useless without the key of their hash. A key that others may know is replaced.
TEST_WITH(hash_key_that_others_can_know_is_replaced, scratch_set_up, scratch_tear_down)
{
    OWNED char *cache = cache_folder_path(), *secret = text_format("%s/hash-key", cache);
    store(key);
    assert_int_equal(chmod(secret, 0640), 0);
    assert_refused("the key of its hash cannot be read");
    store("another key");
    assert_true(loads("another key"));
    assert_refused("it is damaged"); // written with the earlier key
    assert_int_equal(truncate(secret, 31), 0);
    store(key);
    assert_true(loads(key));
    assert_int_equal(mode_of(secret), 0600);
}

// A file of 20 GB without contents is not read, and goes first.
TEST_WITH(entry_that_is_too_large_is_not_read, scratch_set_up, scratch_tear_down)
{
    store(key);
    store("another key");
    OWNED char *path = cache_entry_path(key);
    assert_int_equal(truncate(path, (off_t)20 << 30), 0);
    assert_refused("it is larger than the limit");
    entry_set_used(key, 1u << 31);
    cache_trim(CACHE_BYTES_MAX, NULL);
    assert_int_equal(access(path, F_OK), -1);
    assert_true(loads("another key"));

    OwnedText binary = {0};
    array_reserve(binary, CACHE_ENTRY_BYTES_MAX);
    binary.count = CACHE_ENTRY_BYTES_MAX;
    cache_store(key, &binary, NULL);
    assert_int_equal(access(path, F_OK), -1);
    binary.count = 0;
}

// Four processes on an empty cache make one key of the hash, so that all load what each stores.
TEST_WITH(processes_on_an_empty_cache_share_a_hash_key, scratch_set_up, scratch_tear_down)
{
    enum { PROCESSES = 4, ROUNDS = 20 };
    for (int round = 0; round < ROUNDS; round++) {
        char keys[PROCESSES][16];
        pid_t children[PROCESSES];
        for (int i = 0; i < PROCESSES; i++) {
            snprintf(keys[i], sizeof keys[i], "key %d", i);
            children[i] = fork();
            if (children[i] == 0) {
                store(keys[i]);
                _exit(loads(keys[i]) ? 0 : 1);
            }
        }
        for (int i = 0; i < PROCESSES; i++) {
            int status;
            assert_int_equal(waitpid(children[i], &status, 0), children[i]);
            assert_int_equal(status, 0);
        }
        for (int i = 0; i < PROCESSES; i++)
            assert_true(loads(keys[i]));
        MessageList messages = {0};
        assert_true(cache_clear(&messages));
    }
}

TEST_WITH(entries_are_listed, scratch_set_up, scratch_tear_down)
{
    static const char described[] = "options x\nlaunch render 8x1\ndevice y, z\n";
    MessageList messages = {0};
    OwnedMessageList earlier = {0};
    message_warning(&earlier, "earlier");
    CacheEntries entries;
    assert_true(cache_list(&entries, &earlier) && cache_clear(&earlier)); // without a folder
    assert_true(cache_list(&entries, &messages));
    assert_int_equal(entries.count, 0);
    store(key);
    store(described);
    entry_set_used(described, 1000);
    OWNED char *path = cache_entry_path(key);
    // an entry of another version is not a fault
    OwnedText content = file_text(path);
    content.items[FORMAT_OFFSET]++;
    memset(content.items + FORMAT_END, 0xff, content.count - FORMAT_END); // whatever follows the format
    const size_t lengths[] = {FORMAT_END, content.count};
    for (size_t i = 0; i < COUNT_OF(lengths); i++) {
        file_write_bytes(path, content.items, lengths[i]);
        assert_true(cache_list(&entries, &messages));
        assert_int_equal(entries.count, 2);
        assert_null(entries.items[1].fault);
        assert_null(entries.items[1].device);
        cache_entries_free(&entries);
    }
    file_write_bytes(path, machine_code, CODE_LENGTH);
    assert_true(cache_list(&entries, &messages));
    assert_int_equal(entries.count, 2);
    assert_null(entries.items[0].fault);
    assert_string_equal(entries.items[0].device, "y, z");
    assert_string_equal(entries.items[1].fault, "it is damaged");
    assert_string_equal(entries.items[1].name, strrchr(path, '/') + 1);
    assert_int_equal(entries.size, entries.items[0].size + CODE_LENGTH);
    cache_entries_free(&entries);
    file_write_bytes(path, "", 0); // the latest entry
    assert_true(cache_clear(&messages));
    assert_true(cache_list(&entries, &messages));
    assert_int_equal(entries.count, 0);
    assert_int_equal(messages.count, 0);
}

TEST_WITH(failure_to_clear_is_reported, scratch_set_up, scratch_tear_down)
{
    OwnedMessageList messages = {0};
    OWNED char *path = cache_folder_path(), *secret;
    assert_true(asprintf(&secret, "%s/hash-key", path) > 0);
    store(key);
    assert_true(cache_clear(&messages));
    assert_int_equal(mkdir(secret, 0700), 0);
    assert_false(cache_clear(&messages));
    assert_int_equal(messages.count, 1);
    assert_string_equal(messages.items[0].text,
                        "cannot remove 'hash-key' of the kernel cache: Is a directory");
    rmdir(secret);
}

TEST_WITH(folder_without_rights_is_not_used, scratch_set_up, scratch_tear_down)
{
    OWNED char *cache = cache_folder_path();
    store(key);
    assert_int_equal(chmod(cache, 0), 0);
    assert_load_refused(load_without_rights, "Permission denied");
    assert_int_equal(chmod(cache, 0700), 0);
}

// However few files may be open, no entry is left out in silence, and none is called removed that is not.
TEST_WITH(too_few_descriptors_are_reported, scratch_set_up, scratch_tear_down)
{
    enum { ROOM_END = 4 };
    struct rlimit usual;
    assert_int_equal(getrlimit(RLIMIT_NOFILE, &usual), 0);
    const int next = open(".", O_RDONLY | O_CLOEXEC);
    assert_true(next >= 0);
    close(next);
    bool listed = false, cleared = false;
    for (rlim_t room = 0; room < ROOM_END; room++) {
        store(key);
        const struct rlimit few = {(rlim_t)next + room, usual.rlim_max};
        MessageList messages[2] = {0};
        CacheEntries entries;
        assert_int_equal(setrlimit(RLIMIT_NOFILE, &few), 0);
        listed = cache_list(&entries, &messages[0]);
        cleared = cache_clear(&messages[1]);
        assert_int_equal(setrlimit(RLIMIT_NOFILE, &usual), 0);
        assert_int_equal(entries.count, listed ? 1 : 0);
        assert_false(cleared && loads(key));
        assert_int_equal(messages[0].count, listed ? 0 : 1);
        assert_int_equal(messages[1].count, cleared ? 0 : 1);
        cache_entries_free(&entries);
        for (int i = 0; i < 2; i++)
            message_list_free(&messages[i]);
    }
    assert_true(listed && cleared);
}

// Each changed byte, each shorter length and one more byte are noticed. Storing repairs the entry.
TEST_WITH(damaged_entry_is_not_loaded, scratch_set_up, scratch_tear_down)
{
    store(key);
    OWNED char *path = cache_entry_path(key);
    OwnedText entry = file_text(path);
    assert_true(entry.count > strlen(key) + CODE_LENGTH);
    for (size_t i = 0; i < entry.count; i++) {
        entry.items[i] ^= 0x10;
        file_write_bytes(path, entry.items, entry.count);
        assert_false(loads(key));
        entry.items[i] ^= 0x10;
    }
    for (size_t length = 0; length < entry.count; length++) {
        file_write_bytes(path, entry.items, length);
        assert_false(loads(key));
    }
    file_write_bytes(path, entry.items, entry.count);
    assert_true(loads(key));
    text_append(&entry, "", 1);
    file_write_bytes(path, entry.items, entry.count);
    assert_false(loads(key));

    store(key);
    assert_true(loads(key));
}

// The entry of one key lies where another is looked for, as if both had the same hash.
TEST_WITH(entry_of_another_key_is_not_loaded, scratch_set_up, scratch_tear_down)
{
    store("another key");
    store(key);
    OWNED char *from = cache_entry_path("another key"), *to = cache_entry_path(key);
    assert_int_equal(rename(from, to), 0);
    assert_false(loads(key));
}

TEST_WITH(entry_without_rights_is_replaced, scratch_set_up, scratch_tear_down)
{
    store(key);
    OWNED char *path = cache_entry_path(key);
    assert_int_equal(chmod(path, 0), 0);
    if (geteuid() != 0) assert_false(loads(key));
    store(key);
    assert_true(loads(key));
}

// What is not an entry is replaced when the key is stored. A pipe that nobody writes into is not waited for.
TEST_WITH(foreign_entry_is_replaced, scratch_set_up, scratch_tear_down)
{
    OWNED char *path = cache_entry_path(key), *other = cache_entry_path("another key");
    alarm(60);
    for (int type = 0; type < 3; type++) {
        store(key);
        if (type == 0) {
            assert_int_equal(unlink(path), 0);
            assert_int_equal(mkfifo(path, 0600), 0);
        } else if (type == 1) {
            assert_int_equal(rename(path, other), 0);
            assert_int_equal(symlink(other, path), 0);
        } else if (geteuid() == 0) {
            assert_int_equal(chown(path, 65534, 65534), 0);
        } else {
            continue;
        }
        assert_false(loads(key));
        store(key);
        assert_true(loads(key));
        struct stat status;
        assert_int_equal(lstat(path, &status), 0);
        assert_true(S_ISREG(status.st_mode) && status.st_uid == geteuid());
    }
    alarm(0);
}

TEST_WITH(missing_folder_disables_cache, scratch_set_up, scratch_tear_down)
{
    const char *before = getenv("HOME");
    OWNED char *home = before ? strdup(before) : NULL;
    unsetenv("HOME");
    unsetenv("XDG_CACHE_HOME");
    assert_null(cache_entry_path(key));
    store(key);
    assert_false(loads(key));
    setenv("XDG_CACHE_HOME", "relative", 1);
    assert_null(cache_entry_path(key));
    store(key);
    assert_int_not_equal(access("relative", F_OK), 0);

    setenv("HOME", scratch, 1);
    OWNED char *path = cache_entry_path(key), *expected = NULL;
    assert_true(asprintf(&expected, "%s/.cache/glint/", scratch) > 0);
    assert_memory_equal(path, expected, strlen(expected));
    store(key);
    assert_true(loads(key));
    if (home)
        setenv("HOME", home, 1);
    else
        unsetenv("HOME");
}

// A file in place of the folder stops even root.
TEST_WITH(unwritable_folder_disables_cache, scratch_set_up, scratch_tear_down)
{
    OWNED char *path = NULL;
    assert_true(asprintf(&path, "%s/glint", scratch) > 0);
    file_write_bytes(path, "in the way", 10);
    store(key);
    assert_false(loads(key));
    CacheEntries entries;
    OwnedMessageList messages = {0};
    assert_false(cache_list(&entries, &messages));
    assert_int_equal(messages.count, 1);
    assert_non_null(strstr(messages.items[0].text, "is not used: Not a directory"));
}

TEST_WITH(folder_in_place_of_an_entry_is_kept, scratch_set_up, scratch_tear_down)
{
    store(key);
    OWNED char *path = cache_entry_path(key);
    assert_int_equal(unlink(path), 0);
    assert_int_equal(mkdir(path, 0700), 0);
    assert_false(loads(key));
    store(key);
    assert_false(loads(key));
}

// While two processes replace the entry, a reader always finds it whole.
TEST_WITH(readers_find_whole_entries, scratch_set_up, scratch_tear_down)
{
    store(key);
    pid_t writers[2];
    for (int i = 0; i < 2; i++) {
        writers[i] = fork();
        if (writers[i] == 0) {
            for (int j = 0; j < 500; j++)
                store(key);
            _exit(0);
        }
    }
    for (int i = 0; i < 1000; i++)
        assert_true(loads(key));
    for (int i = 0; i < 2; i++) {
        int status;
        assert_int_equal(waitpid(writers[i], &status, 0), writers[i]);
        assert_int_equal(status, 0);
    }
    assert_true(loads(key));
}

// The entries that were used last stay, whenever they were stored.
TEST_WITH(least_recently_used_entries_are_trimmed, scratch_set_up, scratch_tear_down)
{
    static const char *const keys[] = {"key a", "key b", "key c", "key d"};
    enum { KEY_COUNT = COUNT_OF(keys) };
    for (int i = 0; i < KEY_COUNT; i++) {
        store(keys[i]);
        entry_set_used(keys[i], 1000 + i);
    }
    assert_true(loads("key a"));
    OWNED char *path = cache_entry_path("key a");
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    *strrchr(path, '/') = '\0';
    uint64_t size = (uint64_t)status.st_size;
    cache_trim(KEY_COUNT * size, NULL);
    for (int i = 1; i < KEY_COUNT; i++) {
        OWNED char *kept = cache_entry_path(keys[i]);
        assert_int_equal(access(kept, F_OK), 0);
    }
    cache_trim(2 * size + size / 2, NULL);
    assert_false(loads("key b"));
    assert_false(loads("key c"));
    assert_true(loads("key d"));
    assert_true(loads("key a"));
    static const char *const others[] = {"notes", "0123456789abcdef.txt", "0123456789abcdef.bin.old"};
    static const char left_over[] = ".0123456789abcdef.bin.glint-0";
    int cache = open(path, O_RDONLY | O_DIRECTORY);
    for (size_t i = 0; i < 3; i++)
        close(openat(cache, others[i], O_CREAT | O_WRONLY, 0600));
    close(openat(cache, left_over, O_CREAT | O_WRONLY, 0600));
    cache_trim(0, NULL);
    assert_false(loads("key a"));
    assert_int_equal(faccessat(cache, left_over, F_OK, 0), -1);
    for (size_t i = 0; i < 3; i++) {
        assert_int_equal(faccessat(cache, others[i], F_OK, 0), 0);
        assert_int_equal(unlinkat(cache, others[i], 0), 0);
    }
    close(cache);
}

TEST_MAIN(NULL, NULL)
