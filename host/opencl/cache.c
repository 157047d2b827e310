// An entry is a CacheHeader, the key without its NUL, and the binary. Numbers are in native byte order, as
// the binary is for this machine. All files are opened relative to the open folder, so that none can be
// exchanged between check and use.
#include "host/opencl/cache.h"

#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char cache_magic[] = "glintprg"; // stored without its null
static const uint64_t cache_format = 3;

enum { TAG_BYTES = crypto_generichash_BYTES };

typedef struct {
    char magic[8];
    uint64_t format, key_length, binary_length;
    unsigned char tag[TAG_BYTES]; // of the fields above, the key and the binary
} CacheHeader;

static CacheHeader header_of(const char *key, uint64_t key_length, const char *binary, uint64_t binary_length)
{
    CacheHeader header = {.format = cache_format, .key_length = key_length, .binary_length = binary_length};
    memcpy(header.magic, cache_magic, sizeof header.magic);
    crypto_generichash_state state;
    crypto_generichash_init(&state, NULL, 0, TAG_BYTES);
    crypto_generichash_update(&state, (const unsigned char *)&header, offsetof(CacheHeader, tag));
    crypto_generichash_update(&state, (const unsigned char *)key, key_length);
    crypto_generichash_update(&state, (const unsigned char *)binary, binary_length);
    crypto_generichash_final(&state, header.tag, TAG_BYTES);
    return header;
}

char *cache_folder_path(void)
{
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    bool has_cache = cache && cache[0] == '/', has_home = home && home[0] == '/';
    if (!has_cache && !has_home) return NULL;
    return text_format("%s%s/glint", has_cache ? cache : home, has_cache ? "" : "/.cache");
}

typedef struct {
    char text[24];
} EntryName;

static EntryName entry_name(const char *key)
{
    EntryName name;
    snprintf(name.text, sizeof name.text, "%016" PRIx64 ".bin", hash_bytes(HASH_START, key, strlen(key)));
    return name;
}

char *cache_entry_path(const char *key)
{
    OWNED char *folder = cache_folder_path();
    return folder ? text_format("%s/%s", folder, entry_name(key).text) : NULL;
}

// Returns why a file or folder cannot be trusted, or NULL if it can.
static const char *distrust(const struct stat *status, mode_t type)
{
    if ((status->st_mode & S_IFMT) != type)
        return type == S_IFDIR ? "it is not a folder" : "it is not a regular file";
    if (status->st_uid != geteuid()) return "it belongs to another user";
    if ((status->st_mode & 077) != 0) return "others may access it";
    return NULL;
}

// Creates the folder and every one above it, private to their owner (XDG Base Directory Specification 0.8,
// "Referencing this specification"). A failure is reported when the folder is opened.
static void folders_make(char *path)
{
    for (char *slash = strchr(path + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        mkdir(path, 0700);
        *slash = '/';
    }
    mkdir(path, 0700);
}

// Opens the cache's folder. Returns -1 on failure, with a message unless it does not exist.
static int cache_folder_open(bool makes, MessageList *messages)
{
    OWNED char *path = cache_folder_path();
    if (!path) return -1;
    if (makes) folders_make(path);
    struct stat status;
    const char *why = NULL;
    int folder = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    const int error = errno;
    if (folder >= 0)
        why = fstat(folder, &status) == 0 ? distrust(&status, S_IFDIR) : "its status cannot be read";
    else if (lstat(path, &status) == 0 && S_ISLNK(status.st_mode))
        why = "it is a symbolic link";
    else if (error != ENOENT)
        why = strerror(error);
    if (!why) return folder;
    message_warning(messages, "the kernel cache '%s' is not used: %s", path, why);
    if (folder >= 0) close(folder);
    return -1;
}

static const char absent[] = "absent";

// Reads an entry's file without blocking. Returns NULL if the file can be trusted, `absent` if there is none,
// else why it cannot be trusted.
static const char *entry_file_read(Text *content, int folder, const char *name)
{
    int descriptor = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    if (descriptor < 0)
        return errno == ENOENT ? absent : errno == ELOOP ? "it is a symbolic link" : "it cannot be opened";
    struct stat status;
    const char *why =
        fstat(descriptor, &status) == 0 ? distrust(&status, S_IFREG) : "its status cannot be read";
    if (!why && status.st_size > CACHE_ENTRY_BYTES_MAX) why = "it is larger than the limit";
    FILE *file = why ? NULL : fdopen(descriptor, "rb");
    if (!file) {
        close(descriptor);
        return why ? why : "it cannot be opened";
    }
    if (!text_read_open_file(content, file, name, NULL)) why = "it cannot be read";
    fclose(file);
    return why;
}

typedef struct {
    Text content;
    const char *key, *binary; // into the content; not terminated
    size_t key_length, binary_length;
} Entry;

// Returns why the entry cannot be trusted, `absent` if another version wrote it, or NULL if it can be
// trusted.
static const char *entry_read(Entry *entry, int folder, const char *name)
{
    *entry = (Entry){0};
    Text *content = &entry->content;
    const char *why = entry_file_read(content, folder, name);
    if (why) return why;
    static const char damaged[] = "it is damaged";
    CacheHeader header;
    enum { VERSION_BYTES = offsetof(CacheHeader, key_length) }; // of every version's header
    if (content->count < VERSION_BYTES) return damaged;
    memcpy(&header, content->items, VERSION_BYTES);
    if (memcmp(header.magic, cache_magic, sizeof header.magic) != 0) return damaged;
    if (header.format != cache_format) return absent;
    if (content->count < sizeof header) return damaged;
    memcpy(&header, content->items, sizeof header);
    const size_t rest = content->count - sizeof header;
    if (header.key_length > rest) return damaged;
    entry->key = content->items + sizeof header;
    entry->key_length = (size_t)header.key_length;
    entry->binary = entry->key + entry->key_length;
    entry->binary_length = rest - entry->key_length;
    const CacheHeader expected =
        header_of(entry->key, entry->key_length, entry->binary, entry->binary_length);
    return memcmp(&header, &expected, sizeof header) == 0 ? NULL : damaged;
}

// Delivers and frees the messages, unless earlier ones were delivered.
static void warnings_deliver(WarningReceiver *warnings, MessageList *messages)
{
    if (messages->count > 0 && warnings && !atomic_exchange(&warnings->cache_is_reported, true))
        warnings->deliver(warnings->context, messages);
    message_list_free(messages);
}

bool cache_load(const char *key, Text *binary, WarningReceiver *warnings)
{
    MessageList messages = {0};
    OwnedDescriptor folder = cache_folder_open(false, &messages);
    const EntryName name = entry_name(key);
    Entry entry = {0};
    const char *why = folder < 0 ? absent : entry_read(&entry, folder, name.text);
    const bool found = !why && entry.key_length == strlen(key) && memcmp(entry.key, key, strlen(key)) == 0;
    if (found) {
        text_append(binary, entry.binary, entry.binary_length);
        utimensat(folder, name.text, NULL, 0); // most recently used
    } else if (why && why != absent) {
        OWNED char *path = cache_entry_path(key);
        message_warning(&messages, "the kernel is rebuilt, since the cached '%s' cannot be used: %s", path,
                        why);
    }
    text_free(&entry.content);
    warnings_deliver(warnings, &messages);
    return found;
}

static int entries_compare(const void *a, const void *b)
{
    const struct timespec *first = &((const CacheEntry *)a)->used, *second = &((const CacheEntry *)b)->used;
    if (first->tv_sec != second->tv_sec) return first->tv_sec < second->tv_sec ? -1 : 1;
    return first->tv_nsec < second->tv_nsec ? -1 : first->tv_nsec > second->tv_nsec;
}

static const char ending[] = ".bin";
enum { ENTRY_NAME_LENGTH = 16 + sizeof ending - 1 };

static bool starts_with_entry_name(const char *name)
{
    return strspn(name, "0123456789abcdef") == 16 && strncmp(name + 16, ending, strlen(ending)) == 0;
}

// Returns whether the file is the temporary of an entry, which a killed process may leave behind.
static bool is_temporary(const char *name)
{
    if (name[0] != '.' || !starts_with_entry_name(name + 1)) return false;
    OWNED char *entry = memory_copy_part(name + 1, ENTRY_NAME_LENGTH);
    return output_is_temporary(name, entry);
}

void cache_entries_free(CacheEntries *entries)
{
    for (size_t i = 0; i < entries->count; i++) {
        free(entries->items[i].name);
        free(entries->items[i].device);
    }
    free(entries->items);
    *entries = (CacheEntries){0};
}

// Returns the next name in a folder, or NULL at its end or on failure. errno is 0 at the end.
static const char *folder_next(DIR *items)
{
    errno = 0;
    const struct dirent *item = readdir(items);
    return item ? item->d_name : NULL;
}

// Adds a file of the folder if its name is an entry's.
static void entries_add(CacheEntries *entries, int folder, const char *name)
{
    struct stat status;
    if (!starts_with_entry_name(name) || name[ENTRY_NAME_LENGTH] != '\0') return;
    if (fstatat(folder, name, &status, AT_SYMLINK_NOFOLLOW) != 0 || S_ISDIR(status.st_mode)) return;
    const CacheEntry entry = {
        .name = memory_copy_text(name), .size = (uint64_t)status.st_size, .used = status.st_mtim};
    array_push(*entries, entry);
    entries->size += entry.size;
}

// Lists the entries, the least recently used first, and removes stale temporaries. Leaves other files alone.
// Returns false with a message and no entries if the folder cannot be read to its end.
static bool entries_list(CacheEntries *entries, int folder, MessageList *messages)
{
    *entries = (CacheEntries){0};
    int descriptor = openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *items = descriptor < 0 ? NULL : fdopendir(descriptor);
    for (const char *name = items ? folder_next(items) : NULL; name; name = folder_next(items)) {
        if (is_temporary(name)) output_remove_stale(folder, name);
        entries_add(entries, folder, name);
    }
    const int error = errno; // of the last call
    if (items) closedir(items);
    if (!items && descriptor >= 0) close(descriptor);
    if (error != 0) {
        cache_entries_free(entries);
        return message_error(messages, "cannot list the kernel cache: %s", strerror(error));
    }
    if (entries->count > 0) qsort(entries->items, entries->count, sizeof *entries->items, entries_compare);
    return true;
}

// Removes the least recently used entries beyond `bytes_max`, including those too large to load, or all
// entries if it is 0. Returns false with messages if a removal fails.
static bool folder_trim(int folder, uint64_t bytes_max, MessageList *messages)
{
    CacheEntries entries;
    if (!entries_list(&entries, folder, messages)) return false;
    uint64_t left = entries.size;
    bool is_trimmed = true;
    for (size_t i = 0; i < entries.count; i++)
        if (entries.items[i].size > CACHE_ENTRY_BYTES_MAX) left -= entries.items[i].size;
    for (size_t i = 0; i < entries.count; i++) {
        bool is_too_large = entries.items[i].size > CACHE_ENTRY_BYTES_MAX;
        if (bytes_max > 0 && left <= bytes_max && !is_too_large) continue; // an entry may be empty
        const char *name = entries.items[i].name;
        if (unlinkat(folder, name, 0) != 0 && errno != ENOENT)
            is_trimmed =
                message_error(messages, "cannot remove '%s' of the kernel cache: %s", name, strerror(errno));
        if (!is_too_large) left -= entries.items[i].size;
    }
    cache_entries_free(&entries);
    return is_trimmed;
}

void cache_store(const char *key, const Text *binary, WarningReceiver *warnings)
{
    const size_t key_length = strlen(key);
    if (sizeof(CacheHeader) + key_length + binary->count > CACHE_ENTRY_BYTES_MAX) return;
    MessageList messages = {0};
    OwnedDescriptor folder = cache_folder_open(true, &messages);
    OutputFile output;
    // a failure only costs a later run a build
    if (folder >= 0 && output_open_private(&output, folder, entry_name(key).text, NULL)) {
        const CacheHeader header = header_of(key, key_length, text_c(binary), binary->count);
        if (output_write(&output, &header, sizeof header, NULL) &&
            output_write(&output, key, key_length, NULL) &&
            output_write(&output, binary->items, binary->count, NULL))
            output_commit(&output, NULL);
        else
            output_abandon(&output);
        folder_trim(folder, CACHE_BYTES_MAX, NULL);
    }
    warnings_deliver(warnings, &messages);
}

// Sets the entry's fault or its device.
static void entry_describe(CacheEntry *entry, int folder)
{
    Entry read;
    entry->fault = entry_read(&read, folder, entry->name);
    if (entry->fault == absent) {
        entry->fault = NULL;
    } else if (!entry->fault) {
        OWNED char *key = memory_copy_part(read.key, read.key_length);
        static const char start[] = "\ndevice ";
        char *device = strstr(key, start);
        if (device) {
            device += strlen(start);
            device[strcspn(device, "\n")] = '\0';
        }
        entry->device = memory_copy_text(device ? device : "");
    }
    text_free(&read.content);
}

bool cache_list(CacheEntries *entries, MessageList *messages)
{
    *entries = (CacheEntries){0};
    const size_t earlier_count = messages->count;
    OwnedDescriptor folder = cache_folder_open(false, messages);
    if (folder < 0) return messages->count == earlier_count;
    const bool is_listed = entries_list(entries, folder, messages);
    for (size_t i = 0; i < entries->count; i++)
        entry_describe(&entries->items[i], folder);
    return is_listed;
}

bool cache_clear(MessageList *messages)
{
    const size_t earlier_count = messages->count;
    OwnedDescriptor folder = cache_folder_open(false, messages);
    if (folder < 0) return messages->count == earlier_count;
    return folder_trim(folder, 0, messages);
}
