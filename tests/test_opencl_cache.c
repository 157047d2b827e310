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

// Expects a miss, with one warning if there is a reason. Runs in a separate process, which may drop its
// privileges.
static void assert_load_refused(void (*load)(void *result), const char *reason)
{
    bool loaded = true;
    ChildEnd end = child_run(load, &loaded, sizeof loaded);
    assert_int_equal(end.status, 0);
    assert_false(loaded);
    const bool is_right =
        reason ? strstr(end.errors, reason) && !strstr(strchr(end.errors, '\n'), "warning") : !end.errors[0];
    if (!is_right) print_error("%s", end.errors);
    assert_true(is_right);
}

// After the cache is spoiled, the key's entry is replaced when it is stored, the folder is not used, or a
// folder stays in place of the entry.
typedef enum { REPAIRED, UNUSED, KEPT } Then;

static const struct {
    const char *spoil;  // shell commands
    const char *reason; // of the warning when the entry is loaded, or NULL for none
    Then then;
    bool needs_root, spares_root;
} spoiled[] = {
    {"rm $ENTRY", NULL, REPAIRED},
    {"rm -r $FOLDER", NULL, REPAIRED},
    {": > $ENTRY", "it is damaged", REPAIRED},
    {"echo garbage > $ENTRY", "it is damaged", REPAIRED},
    {"truncate -s -1 $ENTRY", "it is damaged", REPAIRED},
    {"truncate -s 20G $ENTRY", "it is larger than the limit", REPAIRED},
    {"cp $OTHER $ENTRY", NULL, REPAIRED}, // as if both keys had the same hash
    {"chmod 620 $ENTRY", "others may access it", REPAIRED},
    {"chmod 602 $ENTRY", "others may access it", REPAIRED},
    {"chmod 644 $ENTRY", "others may access it", REPAIRED},
    {"chmod 0 $ENTRY", "it cannot be opened", REPAIRED, .spares_root = true},
    {"chown 65534 $ENTRY", "it belongs to another user", REPAIRED, .needs_root = true},
    {"mv $ENTRY $ENTRY.moved && ln -s $ENTRY.moved $ENTRY", "it is a symbolic link", REPAIRED},
    {"rm $ENTRY && mkfifo -m 600 $ENTRY", "it is not a regular file", REPAIRED},
    {"rm $ENTRY && mkdir -m 700 $ENTRY", "it is not a regular file", KEPT},
    {"chmod 770 $FOLDER", "others may access it", UNUSED},
    {"chown 65534 $FOLDER", "it belongs to another user", UNUSED, .needs_root = true},
    {"mv $FOLDER $FOLDER.moved && ln -s $FOLDER.moved $FOLDER", "it is a symbolic link", UNUSED},
    {"rm -r $FOLDER && echo in the way > $FOLDER", "Not a directory", UNUSED}, // stops even root
};

static void spoiled_check(const char *entry, Then then)
{
    struct stat status;
    bool used = true;
    switch (then) {
    case REPAIRED:
        store(key);
        assert_true(loads(key));
        assert_int_equal(lstat(entry, &status), 0);
        assert_int_equal(status.st_mode, S_IFREG | 0600);
        assert_int_equal(status.st_uid, geteuid());
        break;
    case UNUSED:
        unlink(entry);
        assert_int_equal(child_run(store_and_list, &used, sizeof used).status, 0);
        assert_false(used);
        assert_int_equal(access(entry, F_OK), -1);
        break;
    case KEPT:
        store(key);
        assert_false(loads(key));
        assert_int_equal(rmdir(entry), 0);
    }
}

// A pipe that nobody writes into is not waited for.
TEST(spoiled_caches)
{
    alarm(60);
    for (size_t i = 0; i < COUNT_OF(spoiled); i++) {
        if (spoiled[i].needs_root && geteuid() != 0) continue;
        scratch_set_up(NULL);
        OWNED char *entry = cache_entry_path(key), *other = cache_entry_path("another key"),
                   *folder = cache_folder_path();
        setenv("ENTRY", entry, 1);
        setenv("OTHER", other, 1);
        setenv("FOLDER", folder, 1);
        store(key);
        store("another key");
        print_message("%s\n", spoiled[i].spoil);
        assert_int_equal(system(spoiled[i].spoil), 0); // NOLINT(cert-env33-c)
        if (!spoiled[i].spares_root || geteuid() != 0) assert_load_refused(load_twice, spoiled[i].reason);
        spoiled_check(entry, spoiled[i].then);
        scratch_tear_down(NULL);
    }
    alarm(0);
}

// Such an entry is removed first, however recently it was used, and none is stored.
TEST_WITH(entry_that_is_too_large_is_removed, scratch_set_up, scratch_tear_down)
{
    store(key);
    OWNED char *path = cache_entry_path(key);
    assert_int_equal(truncate(path, (off_t)20 << 30), 0);
    entry_set_used(key, 1u << 31);
    store("another key");
    assert_int_equal(access(path, F_OK), -1);
    assert_true(loads("another key"));

    OwnedText binary = {0};
    array_reserve(binary, CACHE_ENTRY_BYTES_MAX);
    binary.count = CACHE_ENTRY_BYTES_MAX;
    cache_store(key, &binary, NULL);
    assert_int_equal(access(path, F_OK), -1);
    binary.count = 0;
}

// Four processes on an empty cache all load what each stores.
TEST_WITH(processes_share_an_empty_cache, scratch_set_up, scratch_tear_down)
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

typedef struct {
    bool is_cleared;
    char text[256];
} Clearing;

static void clear_without_rights(void *result)
{
    Clearing *clearing = result;
    if (geteuid() == 0 && (chown(scratch, 65534, 65534) != 0 || setuid(65534) != 0)) _exit(9);
    OWNED char *folder = cache_folder_path();
    OwnedMessageList messages = {0};
    store(key);
    chmod(folder, 0500);
    clearing->is_cleared = cache_clear(&messages);
    chmod(folder, 0700);
    if (messages.count == 1) snprintf(clearing->text, sizeof clearing->text, "%s", messages.items[0].text);
}

TEST_WITH(failure_to_clear_is_reported, scratch_set_up, scratch_tear_down)
{
    Clearing clearing = {.is_cleared = true};
    assert_int_equal(child_run(clear_without_rights, &clearing, sizeof clearing).status, 0);
    assert_false(clearing.is_cleared);
    OWNED char *path = cache_entry_path(key);
    assert_string_equal(clearing.text, formatted("cannot remove '%s' of the kernel cache: Permission denied",
                                                 strrchr(path, '/') + 1));
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

TEST_WITH(unusable_folder_cannot_be_listed, scratch_set_up, scratch_tear_down)
{
    file_write(formatted("%s/glint", scratch), "in the way");
    CacheEntries entries;
    OwnedMessageList messages = {0};
    assert_false(cache_list(&entries, &messages));
    assert_int_equal(messages.count, 1);
    assert_non_null(strstr(messages.items[0].text, "is not used: Not a directory"));
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

// Gives an entry a size, without contents, and the time of its last use.
static void entry_resize(const char *entry_key, off_t size, time_t used)
{
    OWNED char *path = cache_entry_path(entry_key);
    assert_int_equal(truncate(path, size), 0);
    entry_set_used(entry_key, used);
}

static bool is_stored(const char *entry_key)
{
    OWNED char *path = cache_entry_path(entry_key);
    return access(path, F_OK) == 0;
}

// The entries that were used last stay, whenever they were stored. Other files stay in any case.
TEST_WITH(least_recently_used_entries_are_removed, scratch_set_up, scratch_tear_down)
{
    static const char *const keys[] = {"key a", "key b", "key c", "key d"};
    enum { KEY_COUNT = COUNT_OF(keys) };
    _Static_assert(KEY_COUNT * CACHE_ENTRY_BYTES_MAX == CACHE_BYTES_MAX,
                   "the largest entries fill the cache");
    struct stat status;
    store("key a");
    entry_set_used("key a", 1000);
    assert_true(loads("key a"));
    OWNED char *path = cache_entry_path("key a"), *folder = cache_folder_path();
    assert_int_equal(stat(path, &status), 0);
    assert_true(status.st_mtim.tv_sec > 1000);
    for (int i = 1; i < KEY_COUNT; i++)
        store(keys[i]);
    for (int i = 0; i < KEY_COUNT; i++)
        entry_resize(keys[i], CACHE_ENTRY_BYTES_MAX, i == 0 ? 2000 : 1000 + i);

    static const char *const others[] = {"notes", "0123456789abcdef.txt", "0123456789abcdef.bin.old",
                                         ".0123456789abcdef.bin.glint-0"};
    enum { OTHERS = COUNT_OF(others) - 1 }; // the last is a temporary of a process that was killed
    for (size_t i = 0; i <= OTHERS; i++)
        file_write(formatted("%s/%s", folder, others[i]), "");
    entry_resize("key a", CACHE_ENTRY_BYTES_MAX - status.st_size, 2000);
    store("key e"); // as large as that of a was
    for (int i = 0; i < KEY_COUNT; i++)
        assert_true(is_stored(keys[i]));
    entry_resize("key a", CACHE_ENTRY_BYTES_MAX - status.st_size + 1, 2000);
    store("key e");
    assert_false(is_stored("key b"));
    assert_true(is_stored("key a") && is_stored("key c") && is_stored("key d") && loads("key e"));

    OwnedMessageList messages = {0};
    assert_true(cache_clear(&messages));
    assert_false(is_stored("key a") || is_stored("key e"));
    for (size_t i = 0; i <= OTHERS; i++)
        assert_int_equal(access(formatted("%s/%s", folder, others[i]), F_OK), i < OTHERS ? 0 : -1);
}

TEST_MAIN(NULL, NULL)
