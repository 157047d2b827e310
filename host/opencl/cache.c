// An entry is a CacheHeader, the key without its NUL, and the binary. Numbers are in native byte order, as
// the binary is for this machine.
#include "host/opencl/cache.h"

#include "host/base/array.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include <dirent.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char cache_magic[8] = "glintprg";
static const uint64_t cache_format = 1;

typedef struct {
    char magic[8];
    uint64_t format, key_length, binary_length;
    uint64_t checksum; // of the fields above, the key and the binary
} CacheHeader;

static CacheHeader entry_header(const char *key, const void *binary, size_t binary_length)
{
    CacheHeader header = {.format = cache_format, .key_length = strlen(key), .binary_length = binary_length};
    memcpy(header.magic, cache_magic, sizeof header.magic);
    header.checksum = hash_bytes(HASH_START, &header, offsetof(CacheHeader, checksum));
    header.checksum = hash_bytes(header.checksum, key, header.key_length);
    header.checksum = hash_bytes(header.checksum, binary, binary_length);
    return header;
}

char *cache_entry_path(const char *key)
{
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    bool has_cache = cache && cache[0] == '/', has_home = home && home[0] == '/';
    if (!has_cache && !has_home) return NULL;
    Text path = {0};
    text_appendf(&path, "%s%s/glint/%016" PRIx64 ".bin", has_cache ? cache : home, has_cache ? "" : "/.cache",
                 hash_bytes(HASH_START, key, strlen(key)));
    char *copy = memory_copy_text(text_c(&path));
    text_free(&path);
    return copy;
}

// Creates every folder above the entry, private to its owner (XDG Base Directory Specification 0.8,
// "Referencing this specification"). A failure shows when the entry is written.
static void make_folders(const char *path)
{
    char *folder = memory_copy_text(path);
    for (char *slash = strchr(folder + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        mkdir(folder, 0700);
        *slash = '/';
    }
    free(folder);
}

static bool entry_open(const Text *entry, const char *key, Text *binary)
{
    CacheHeader header;
    size_t key_length = strlen(key), before = sizeof header + key_length;
    if (entry->count < before) return false;
    const char *bytes = entry->items + before;
    size_t length = entry->count - before;
    header = entry_header(key, bytes, length);
    if (memcmp(entry->items, &header, sizeof header) != 0) return false;
    if (memcmp(entry->items + sizeof header, key, key_length) != 0) return false;
    text_append(binary, bytes, length);
    return true;
}

// Loaded code is executed: only regular files of the user are read, and opening never blocks.
static bool is_own_file(const struct stat *status)
{
    return S_ISREG(status->st_mode) && status->st_uid == geteuid();
}

static bool entry_read(Text *entry, const char *path)
{
    int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    if (descriptor < 0) return false;
    struct stat status;
    bool is_own = fstat(descriptor, &status) == 0 && is_own_file(&status);
    FILE *file = is_own ? fdopen(descriptor, "rb") : NULL;
    if (!file) {
        close(descriptor);
        return false;
    }
    MessageList ignored = {0};
    bool read = text_read_open_file(entry, file, path, &ignored);
    message_list_free(&ignored);
    fclose(file);
    return read;
}

bool cache_load(const char *key, Text *binary)
{
    char *path = cache_entry_path(key);
    if (!path) return false;
    Text entry = {0};
    bool found = entry_read(&entry, path) && entry_open(&entry, key, binary);
    if (found) utimensat(AT_FDCWD, path, NULL, 0); // most recently used
    text_free(&entry);
    free(path);
    return found;
}

typedef struct {
    char *name;
    struct timespec used;
    uint64_t size;
} CacheFile;

typedef struct {
    CacheFile *items;
    size_t count, capacity;
    uint64_t size;
} CacheFiles;

static int file_compare(const void *a, const void *b)
{
    const struct timespec *first = &((const CacheFile *)a)->used, *second = &((const CacheFile *)b)->used;
    if (first->tv_sec != second->tv_sec) return first->tv_sec < second->tv_sec ? -1 : 1;
    return first->tv_nsec < second->tv_nsec ? -1 : first->tv_nsec > second->tv_nsec;
}

// Whether it names an entry, or the temporary that a killed process left: other files are not ours.
static bool is_entry_name(const char *name)
{
    static const char ending[] = ".bin";
    bool temporary = *name == '.';
    name += temporary;
    if (strspn(name, "0123456789abcdef") != 16 || strncmp(name + 16, ending, strlen(ending)) != 0)
        return false;
    const char *rest = name + 16 + strlen(ending);
    return temporary ? *rest == '.' && strlen(rest) == strlen(".XXXXXX") : *rest == '\0';
}

static void files_list(CacheFiles *files, DIR *folder)
{
    for (const struct dirent *item; (item = readdir(folder)) != NULL;) {
        struct stat status;
        if (!is_entry_name(item->d_name)) continue;
        if (fstatat(dirfd(folder), item->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0) continue;
        if (!S_ISREG(status.st_mode)) continue;
        uint64_t size = (uint64_t)status.st_size;
        array_push(*files, ((CacheFile){memory_copy_text(item->d_name), status.st_mtim, size}));
        files->size += size;
    }
}

void cache_trim(const char *folder, uint64_t bytes_max)
{
    DIR *open_folder = opendir(folder);
    if (!open_folder) return;
    CacheFiles files = {0};
    files_list(&files, open_folder);
    if (files.size > bytes_max) qsort(files.items, files.count, sizeof *files.items, file_compare);
    for (size_t i = 0; i < files.count; i++) {
        if (files.size > bytes_max) {
            unlinkat(dirfd(open_folder), files.items[i].name, 0);
            files.size -= files.items[i].size;
        }
        free(files.items[i].name);
    }
    free(files.items);
    closedir(open_folder);
}

void cache_store(const char *key, const Text *binary)
{
    char *path = cache_entry_path(key);
    if (!path) return;
    make_folders(path);
    struct stat status;
    bool is_own = lstat(path, &status) == 0 && is_own_file(&status);
    if (!is_own || access(path, R_OK | W_OK) != 0) unlink(path); // output_open would refuse it
    CacheHeader header = entry_header(key, binary->items, binary->count);
    MessageList ignored = {0};
    OutputFile output;
    if (output_open(&output, path, &ignored)) {
        if (output_write(&output, &header, sizeof header, &ignored) &&
            output_write(&output, key, header.key_length, &ignored) &&
            output_write(&output, binary->items, binary->count, &ignored))
            output_commit(&output, &ignored);
        else
            output_abandon(&output);
    }
    message_list_free(&ignored);
    *strrchr(path, '/') = '\0';
    cache_trim(path, CACHE_BYTES_MAX);
    free(path);
}
