// The file consists of a FileHeader, the key and, for each band, a RecordHeader and its layers. Numbers are
// in native byte order, so a checkpoint can be resumed only on a machine with the byte order of the one that
// wrote it.
//
// `bands` and `offsets` list the whole records, and `end` is where the last of them ends. After a `failure`
// nothing is appended, because a reader stops at a torn record.
#include "host/render/checkpoint.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char file_magic[] = "glint checkpoint"; // stored without its null
static const uint64_t file_format = 2;
static const double SYNC_SECONDS = 1; // the minimum between two syncs, which are slow

enum { HASH_BYTES = 16, KEY_BYTES_MAX = 1 << 16, CHUNK_BYTES = 1 << 20 };

typedef struct {
    char magic[16];
    uint64_t format, key_length;
    unsigned char hash[HASH_BYTES]; // the key's hash
} FileHeader;

typedef struct {
    FilmHeader film;
    uint64_t size;                  // the size of the layers
    unsigned char hash[HASH_BYTES]; // the hash of everything above and of the layers
} RecordHeader;

typedef enum { RECORD_WHOLE, RECORD_TORN, RECORD_FAILED } RecordState;

struct Checkpoint {
    char *path;
    FilmHeader film; // describes all rows
    int descriptor;
    pthread_mutex_t mutex;
    off_t end; // the end of the last record
    double synced_seconds;
    char *failure; // the first failure, or NULL
    ARRAY_OF(BandRows) bands;
    ARRAY_OF(off_t) offsets; // in the order of `bands`
};

// Reads bytes at an offset. Returns false at the end of the file, or if it cannot be read.
static bool bytes_read(int descriptor, void *bytes, size_t size, off_t offset)
{
    for (size_t done = 0; done < size;) {
        ssize_t count = pread(descriptor, (char *)bytes + done, size - done, offset + (off_t)done);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) {
            if (count == 0) errno = EIO;
            return false;
        }
        done += (size_t)count;
    }
    return true;
}

static bool bytes_write(int descriptor, const void *bytes, size_t size, off_t offset)
{
    for (size_t done = 0; done < size;) {
        ssize_t count = pwrite(descriptor, (const char *)bytes + done, size - done, offset + (off_t)done);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return false;
        done += (size_t)count;
    }
    return true;
}

static void hash_begin(crypto_generichash_state *hash, const RecordHeader *record)
{
    crypto_generichash_init(hash, NULL, 0, HASH_BYTES);
    crypto_generichash_update(hash, (const unsigned char *)record, offsetof(RecordHeader, hash));
}

static FileHeader file_header(const char *key)
{
    FileHeader header = {.format = file_format, .key_length = strlen(key)};
    memcpy(header.magic, file_magic, sizeof header.magic);
    crypto_generichash(header.hash, HASH_BYTES, (const unsigned char *)key, header.key_length, NULL, 0);
    return header;
}

static RecordHeader record_of(const Film *band)
{
    RecordHeader record = {.film = film_header(band), .size = film_size(band)};
    crypto_generichash_state hash;
    hash_begin(&hash, &record);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (band->layers[layer])
            crypto_generichash_update(&hash, band->layers[layer], film_layer_size(band, layer));
    crypto_generichash_final(&hash, record.hash, HASH_BYTES);
    return record;
}

// Returns whether the record holds rows of the image and nothing else. Its sizes decide how much is read into
// memory.
static bool record_fits(const Checkpoint *checkpoint, const RecordHeader *record)
{
    return film_header_fits(&record->film, &checkpoint->film) &&
           record->size == film_header_size(&record->film);
}

// Reads and checks the record at the offset. RECORD_TORN means that the offset does not hold a whole record
// of this image, RECORD_FAILED that the file cannot be read.
static RecordState record_check(const Checkpoint *checkpoint, off_t offset, off_t file_size,
                                RecordHeader *record, unsigned char *chunk)
{
    if (file_size - offset < (off_t)sizeof *record) return RECORD_TORN;
    if (!bytes_read(checkpoint->descriptor, record, sizeof *record, offset)) return RECORD_FAILED;
    offset += (off_t)sizeof *record;
    if (!record_fits(checkpoint, record) || record->size > (uint64_t)(file_size - offset)) return RECORD_TORN;
    crypto_generichash_state hash;
    hash_begin(&hash, record);
    for (uint64_t left = record->size; left > 0;) {
        size_t size = left < CHUNK_BYTES ? (size_t)left : CHUNK_BYTES;
        if (!bytes_read(checkpoint->descriptor, chunk, size, offset)) return RECORD_FAILED;
        crypto_generichash_update(&hash, chunk, size);
        offset += (off_t)size;
        left -= size;
    }
    unsigned char expected[HASH_BYTES];
    crypto_generichash_final(&hash, expected, HASH_BYTES);
    return memcmp(record->hash, expected, HASH_BYTES) == 0 ? RECORD_WHOLE : RECORD_TORN;
}

static void record_list(Checkpoint *checkpoint, const RecordHeader *record)
{
    array_push(checkpoint->bands, ((BandRows){record->film.first_row, record->film.row_count}));
    array_push(checkpoint->offsets, checkpoint->end);
    checkpoint->end += (off_t)(sizeof *record + record->size);
}

// Marks the rows of the record as saved. Returns false if an earlier record has some of them.
static bool rows_mark(bool *is_saved, const FilmHeader *film)
{
    for (uint32_t i = 0; i < film->row_count; i++) {
        if (is_saved[film->first_row + i]) return false;
        is_saved[film->first_row + i] = true;
    }
    return true;
}

// Finds the records and cuts off what follows the last whole one. Does not change a file that cannot be read.
static bool records_find(Checkpoint *checkpoint)
{
    struct stat status;
    if (fstat(checkpoint->descriptor, &status) != 0) return false;
    unsigned char *chunk = memory_allocate(CHUNK_BYTES, 1);
    bool *is_saved = memory_allocate_zeroed(checkpoint->film.row_count, sizeof *is_saved);
    RecordHeader record;
    RecordState state;
    while ((state = record_check(checkpoint, checkpoint->end, status.st_size, &record, chunk)) ==
               RECORD_WHOLE &&
           rows_mark(is_saved, &record.film))
        record_list(checkpoint, &record);
    free(is_saved);
    free(chunk);
    return state != RECORD_FAILED && ftruncate(checkpoint->descriptor, checkpoint->end) == 0;
}

// Returns the value in the line of the key whose name is at `line`, or an empty value if no line has that
// name.
static const char *key_value(const char *key, const char *line, size_t name_length, size_t *length)
{
    for (const char *at = key; *at;) {
        size_t line_length = strcspn(at, "\n");
        if (line_length >= name_length + 2 && strncmp(at, line, name_length) == 0 && at[name_length] == ':') {
            *length = line_length - name_length - 2;
            return at + name_length + 2;
        }
        at += line_length + (at[line_length] == '\n');
    }
    *length = 0;
    return "";
}

static void damage_report(const char *path, MessageList *messages)
{
    message_error(messages, "the checkpoint '%s' is damaged; remove it or name another file", path);
}

// Returns a key's value as messages print it.
static char *value_text(const char *value, size_t length)
{
    return length > 0 ? memory_copy_part(value, length) : memory_copy_text("none");
}

// Reports the first line in which the keys differ.
static void difference_report(const char *path, const char *key, const char *found, MessageList *messages)
{
    for (const char *line = key; *line; line += strcspn(line, "\n") + 1) {
        size_t name_length = strcspn(line, ":"), length, other_length;
        const char *value = key_value(key, line, name_length, &length);
        const char *other = key_value(found, line, name_length, &other_length);
        if (length == other_length && strncmp(value, other, length) == 0) continue;
        char *expected = value_text(value, length), *stored = value_text(other, other_length);
        message_error(
            messages,
            "the checkpoint '%s' belongs to another image (%.*s: %s, not %s); remove it or name another file",
            path, (int)name_length, line, stored, expected);
        free(expected);
        free(stored);
        return;
    }
    damage_report(path, messages); // the key in the file has further lines
}

static bool open_failed(const char *path, const char *doing, MessageList *messages)
{
    return message_error(messages, "cannot %s the checkpoint '%s': %s", doing, path, strerror(errno));
}

// Writes the header and the key of a new file.
static bool header_write(Checkpoint *checkpoint, const FileHeader *header, const char *key,
                         MessageList *messages)
{
    bool is_written = ftruncate(checkpoint->descriptor, 0) == 0 &&
                      bytes_write(checkpoint->descriptor, header, sizeof *header, 0) &&
                      bytes_write(checkpoint->descriptor, key, strlen(key), sizeof *header) &&
                      fsync(checkpoint->descriptor) == 0;
    return is_written || open_failed(checkpoint->path, "write", messages);
}

// Checks the key in the file.
static bool key_check(const Checkpoint *checkpoint, const FileHeader *header, const char *key,
                      MessageList *messages)
{
    const size_t length = (size_t)header->key_length; // at most KEY_BYTES_MAX
    char *found = memory_allocate_zeroed(length + 1, 1);
    bool is_same = false;
    if (!bytes_read(checkpoint->descriptor, found, length, sizeof *header)) {
        open_failed(checkpoint->path, "read", messages);
    } else {
        const FileHeader of_found = file_header(found);
        is_same = strcmp(found, key) == 0;
        if (memcmp(header, &of_found, sizeof of_found) != 0) {
            damage_report(checkpoint->path, messages);
            is_same = false;
        } else if (!is_same) {
            difference_report(checkpoint->path, key, found, messages);
        }
    }
    free(found);
    return is_same;
}

// Checks the header of the file. Writes the header of a new file, or of a file whose process ended while
// writing it.
static bool header_check(Checkpoint *checkpoint, const char *key, MessageList *messages)
{
    const FileHeader expected = file_header(key);
    FileHeader header = {0};
    struct stat status;
    if (fstat(checkpoint->descriptor, &status) != 0) return open_failed(checkpoint->path, "read", messages);
    size_t size = status.st_size < (off_t)sizeof header ? (size_t)status.st_size : sizeof header;
    if (S_ISREG(status.st_mode) && !bytes_read(checkpoint->descriptor, &header, size, 0))
        return open_failed(checkpoint->path, "read", messages);
    size_t magic_size = size < sizeof header.magic ? size : sizeof header.magic;
    bool is_checkpoint = S_ISREG(status.st_mode) && memcmp(header.magic, file_magic, magic_size) == 0 &&
                         (size < sizeof header || (header.format == file_format && header.key_length > 0 &&
                                                   header.key_length <= KEY_BYTES_MAX));
    if (!is_checkpoint)
        return message_error(messages, "'%s' is not a checkpoint of this version of glint", checkpoint->path);
    if (size == sizeof header && (uint64_t)status.st_size >= sizeof header + header.key_length)
        return key_check(checkpoint, &header, key, messages);
    if (size < sizeof header || memcmp(&header, &expected, sizeof header) == 0)
        return header_write(checkpoint, &expected, key, messages);
    damage_report(checkpoint->path, messages);
    return false;
}

// Returns the name of the open file itself, which differs from the checkpoint's if that is a symbolic link.
// Returns NULL if the file does not have a name.
static char *file_name(const Checkpoint *checkpoint)
{
    char *name = realpath(checkpoint->path, NULL);
    if (name && file_has_name(checkpoint->descriptor, AT_FDCWD, name)) return name;
    free(name);
    return NULL;
}

// Syncs the folder, so that a new file's name outlives a power failure. Not every file system can sync a
// folder.
static void folder_sync(const Checkpoint *checkpoint)
{
    char *name = file_name(checkpoint);
    int folder = file_folder_open(name ? name : checkpoint->path);
    if (folder >= 0) {
        file_sync(folder);
        close(folder);
    }
    free(name);
}

// Opens and locks the file. Between the two, another process that completed its image may remove the file.
static bool file_open(Checkpoint *checkpoint, MessageList *messages)
{
    enum { TRIES_MAX = 100 };
    for (int i = 0; i < TRIES_MAX; i++) {
        checkpoint->descriptor = open(checkpoint->path, O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
        if (checkpoint->descriptor < 0) return open_failed(checkpoint->path, "open", messages);
        FileLock lock = file_lock(checkpoint->descriptor);
        if (lock == FILE_LOCKED) return true;
        if (lock == FILE_BUSY) break;
        close(checkpoint->descriptor);
        checkpoint->descriptor = -1;
    }
    return message_error(messages, "the checkpoint '%s' is in use by another process", checkpoint->path);
}

Checkpoint *checkpoint_open(const char *path, const char *key, const FilmHeader *film, MessageList *messages)
{
    Checkpoint *checkpoint = memory_allocate_zeroed(1, sizeof *checkpoint);
    checkpoint->path = memory_copy_text(path);
    checkpoint->film = *film;
    if (pthread_mutex_init(&checkpoint->mutex, NULL) != 0) fault("out of memory: mutex");
    bool is_open = file_open(checkpoint, messages) && header_check(checkpoint, key, messages);
    checkpoint->end = (off_t)(sizeof(FileHeader) + strlen(key));
    if (is_open && !records_find(checkpoint)) is_open = open_failed(path, "read", messages);
    if (is_open) {
        folder_sync(checkpoint);
        return checkpoint;
    }
    checkpoint_close(checkpoint, false, messages);
    return NULL;
}

const BandRows *checkpoint_bands(const Checkpoint *checkpoint, size_t *count)
{
    *count = checkpoint->bands.count;
    return checkpoint->bands.items;
}

static bool checkpoint_failed(Checkpoint *checkpoint, const char *doing)
{
    if (!checkpoint->failure)
        checkpoint->failure =
            text_format("cannot %s the checkpoint '%s': %s", doing, checkpoint->path, strerror(errno));
    return false;
}

static bool record_write(Checkpoint *checkpoint, const RecordHeader *record, const Film *band)
{
    off_t offset = checkpoint->end;
    if (!bytes_write(checkpoint->descriptor, record, sizeof *record, offset)) return false;
    offset += (off_t)sizeof *record;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (!band->layers[layer]) continue;
        size_t size = film_layer_size(band, layer);
        if (!bytes_write(checkpoint->descriptor, band->layers[layer], size, offset)) return false;
        offset += (off_t)size;
    }
    double now = clock_seconds();
    if (now - checkpoint->synced_seconds < SYNC_SECONDS) return true;
    checkpoint->synced_seconds = now;
    return fdatasync(checkpoint->descriptor) == 0;
}

bool checkpoint_append(Checkpoint *checkpoint, const Film *band)
{
    const RecordHeader record = record_of(band);
    pthread_mutex_lock(&checkpoint->mutex);
    bool is_written = !checkpoint->failure &&
                      (record_write(checkpoint, &record, band) || checkpoint_failed(checkpoint, "write"));
    if (is_written) record_list(checkpoint, &record);
    pthread_mutex_unlock(&checkpoint->mutex);
    return is_written;
}

bool checkpoint_read(Checkpoint *checkpoint, uint32_t first_row, Film *band)
{
    *band = (Film){0};
    pthread_mutex_lock(&checkpoint->mutex);
    off_t offset = 0;
    for (size_t i = 0; i < checkpoint->bands.count; i++)
        if (checkpoint->bands.items[i].first_row == first_row) offset = checkpoint->offsets.items[i];
    RecordHeader record;
    bool is_read = bytes_read(checkpoint->descriptor, &record, sizeof record, offset);
    if (is_read && !record_fits(checkpoint, &record)) { // changed since it was opened
        errno = EIO;
        is_read = false;
    }
    if (is_read) *band = film_of_header(&record.film);
    offset += (off_t)sizeof record;
    for (Layer layer = 0; layer < LAYER_COUNT && is_read; layer++) {
        if (!band->layers[layer]) continue;
        size_t size = film_layer_size(band, layer);
        is_read = bytes_read(checkpoint->descriptor, band->layers[layer], size, offset);
        offset += (off_t)size;
    }
    if (!is_read) checkpoint_failed(checkpoint, "read");
    pthread_mutex_unlock(&checkpoint->mutex);
    if (!is_read) film_free(band);
    return is_read;
}

// Removes the file, unless its name now belongs to another file, such as the image itself.
static void file_remove(const Checkpoint *checkpoint, MessageList *messages)
{
    char *name = realpath(checkpoint->path, NULL);
    int error = name ? 0 : errno;
    if (name) {
        errno = 0; // stays 0 if another file has the name
        if (!file_has_name(checkpoint->descriptor, AT_FDCWD, name) || unlink(name) != 0) error = errno;
    }
    free(name);
    if (error != 0 && error != ENOENT)
        message_warning(messages, "cannot remove the checkpoint '%s': %s", checkpoint->path, strerror(error));
}

void checkpoint_close(Checkpoint *checkpoint, bool is_complete, MessageList *messages)
{
    if (checkpoint->failure) message_error(messages, "%s", checkpoint->failure);
    if (is_complete) file_remove(checkpoint, messages);
    if (checkpoint->descriptor >= 0) {
        if (!is_complete) fdatasync(checkpoint->descriptor);
        close(checkpoint->descriptor);
    }
    pthread_mutex_destroy(&checkpoint->mutex);
    free(checkpoint->bands.items);
    free(checkpoint->offsets.items);
    free(checkpoint->failure);
    free(checkpoint->path);
    free(checkpoint);
}
