// The file consists of a FileHeader, the key with its NUL and, for each band, a RecordHeader and its layers.
// Numbers are in native byte order, so a checkpoint can be resumed only on a machine with the byte order of
// the one that wrote it.
//
// The states of the file:
//
//     LOCKED ──head fits───▶ CHECKED ──records found──▶ OPEN ──complete───────▶ removed
//       └─refused─▶ unchanged  └─unreadable─▶ unchanged  ├─────ended early────▶ kept
//                                                        └─▶ FAILED ──────────▶ kept
//
// These invariants hold in OPEN and FAILED whenever the mutex is free:
//
//  1. This process has the lock on the file, from file_open to checkpoint_close.
//  2. Below `end` there are only the head, the key and whole records. What follows, after a failed write, is
//     cut off by the next process that opens the file.
//  3. `bands` and `offsets` have an element for each record, in the order of the file. No row is in two
//     bands.
//  4. `failure` is set once and never cleared. While it is set, nothing is appended.
//  5. The first append that is `sync_seconds` later than the last sync syncs all records, and so does
//     checkpoint_close if it keeps the file.
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
static const uint64_t file_format = 3;
static const double sync_seconds = 1; // the minimum between two syncs, which are slow

enum { HASH_BYTES = 16, KEY_BYTES_MAX = 1 << 16 };

typedef struct {
    char magic[16];
    uint64_t format;
    unsigned char hash[HASH_BYTES]; // the key's hash
} FileHeader;

typedef struct {
    FilmHeader film;
    unsigned char hash[HASH_BYTES]; // the hash of the film's header and layers
} RecordHeader;

typedef enum { RECORD_WHOLE, RECORD_TORN, RECORD_FAILED } RecordState;

struct Checkpoint {
    char *path;      // as the user gave it
    char *file_path; // behind symbolic links; NULL until the file is open
    FilmHeader film; // describes all rows
    int descriptor;
    pthread_mutex_t mutex;
    off_t end; // the end of the last record
    double synced_seconds;
    char *failure; // the first failure, or NULL
    ARRAY_OF(BandRows) bands;
    ARRAY_OF(off_t) offsets; // in the order of `bands`
};

// Reads bytes at an offset, which advances. Returns false at the end of the file, or if it cannot be read.
static bool bytes_read(int descriptor, void *bytes, size_t size, off_t *offset)
{
    for (size_t done = 0; done < size;) {
        ssize_t count = pread(descriptor, (char *)bytes + done, size - done, *offset);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) {
            if (count == 0) errno = EIO;
            return false;
        }
        done += (size_t)count;
        *offset += count;
    }
    return true;
}

static bool bytes_write(int descriptor, const void *bytes, size_t size, off_t *offset)
{
    for (size_t done = 0; done < size;) {
        ssize_t count = pwrite(descriptor, (const char *)bytes + done, size - done, *offset);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return false;
        done += (size_t)count;
        *offset += count;
    }
    return true;
}

static RecordHeader record_of(const Film *band)
{
    RecordHeader record = {.film = film_header(band)};
    crypto_generichash_state hash;
    crypto_generichash_init(&hash, NULL, 0, HASH_BYTES);
    crypto_generichash_update(&hash, (const unsigned char *)&record.film, sizeof record.film);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (band->layers[layer])
            crypto_generichash_update(&hash, band->layers[layer], film_layer_size(band, layer));
    crypto_generichash_final(&hash, record.hash, HASH_BYTES);
    return record;
}

// Reads the band of the record at the offset, which film_free frees in any case. RECORD_TORN means that the
// offset does not hold a whole record of this image, RECORD_FAILED that the file cannot be read.
static RecordState record_read(const Checkpoint *checkpoint, off_t offset, Film *band)
{
    RecordHeader record;
    struct stat status;
    *band = (Film){0};
    if (fstat(checkpoint->descriptor, &status) != 0) return RECORD_FAILED;
    if (status.st_size - offset < (off_t)sizeof record) return RECORD_TORN;
    if (!bytes_read(checkpoint->descriptor, &record, sizeof record, &offset)) return RECORD_FAILED;
    // the header decides how much memory the band takes
    if (!film_header_fits(&record.film, &checkpoint->film) ||
        film_header_size(&record.film) > (uint64_t)(status.st_size - offset))
        return RECORD_TORN;
    *band = film_of_header(&record.film);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (band->layers[layer] &&
            !bytes_read(checkpoint->descriptor, band->layers[layer], film_layer_size(band, layer), &offset))
            return RECORD_FAILED;
    const RecordHeader expected = record_of(band);
    return memcmp(&record, &expected, sizeof record) == 0 ? RECORD_WHOLE : RECORD_TORN;
}

static void record_list(Checkpoint *checkpoint, const Film *band)
{
    array_push(checkpoint->bands, ((BandRows){band->first_row, band->height}));
    array_push(checkpoint->offsets, checkpoint->end);
    checkpoint->end += (off_t)(sizeof(RecordHeader) + film_size(band));
}

// Marks the band's rows as saved. Returns false if an earlier band has some of them.
static bool rows_mark(bool *is_saved, const Film *band)
{
    if (memchr(is_saved + band->first_row, true, band->height)) return false;
    memset(is_saved + band->first_row, true, band->height);
    return true;
}

// Finds the records and cuts off what follows the last whole one, with a warning. Does not change a file that
// cannot be read. Returns what failed, as open_failed reports it, or NULL.
static const char *records_find(Checkpoint *checkpoint, MessageList *messages)
{
    struct stat status;
    OWNED bool *is_saved = memory_allocate_zeroed(checkpoint->film.row_count, sizeof *is_saved);
    Film band;
    RecordState state;
    while ((state = record_read(checkpoint, checkpoint->end, &band)) == RECORD_WHOLE &&
           rows_mark(is_saved, &band)) {
        record_list(checkpoint, &band);
        film_free(&band);
    }
    film_free(&band);
    if (state == RECORD_FAILED || fstat(checkpoint->descriptor, &status) != 0) return "read";
    if (status.st_size == checkpoint->end) return NULL;
    if (ftruncate(checkpoint->descriptor, checkpoint->end) != 0) return "write";
    message_warning(messages,
                    "the last %lld bytes of the checkpoint '%s' do not begin with a whole band of the image; "
                    "they are removed, and their rows are re-rendered",
                    (long long)(status.st_size - checkpoint->end), checkpoint->path);
    return NULL;
}

// Returns the value in the key's line with the name of `line`, as messages print it. The caller frees it.
static char *key_value(const char *key, const char *line)
{
    const size_t name_length = strcspn(line, ":") + 1;
    while (*key && strncmp(key, line, name_length) != 0) {
        key += strcspn(key, "\n");
        key += *key == '\n';
    }
    if (*key) key += name_length;
    key += *key == ' ';
    const size_t length = strcspn(key, "\n");
    return length > 0 ? memory_copy_part(key, length) : memory_copy_text("none");
}

static void damage_report(const char *path, MessageList *messages)
{
    message_error(messages, "the checkpoint '%s' is damaged; remove it or name another file", path);
}

// Reports the first line in which the keys differ.
static void difference_report(const char *path, const char *key, const char *found, MessageList *messages)
{
    bool differs = false;
    for (const char *line = key; *line && !differs; line += strcspn(line, "\n") + 1) {
        OWNED char *expected = key_value(key, line), *stored = key_value(found, line);
        differs = strcmp(expected, stored) != 0;
        if (differs)
            message_error(
                messages,
                "the checkpoint '%s' belongs to another image (%.*s: %s, not %s); remove it or name "
                "another file",
                path, (int)strcspn(line, ":"), line, stored, expected);
    }
    if (!differs) damage_report(path, messages); // the key in the file has further lines
}

static bool open_failed(const char *path, const char *doing, MessageList *messages)
{
    return message_error(messages, "cannot %s the checkpoint '%s': %s", doing, path, strerror(errno));
}

// Returns the bytes with which the file of a key begins.
static Text head_of(const char *key)
{
    const size_t size = strlen(key) + 1;
    FileHeader header = {.format = file_format};
    Text head = {0};
    memcpy(header.magic, file_magic, sizeof header.magic);
    crypto_generichash(header.hash, HASH_BYTES, (const unsigned char *)key, size, NULL, 0);
    text_append(&head, (const char *)&header, sizeof header);
    text_append(&head, key, size);
    return head;
}

// Reports why a file that begins with these bytes, after which there is a NUL, cannot be resumed.
static void refusal_report(const char *path, const char *key, const char *found, MessageList *messages)
{
    FileHeader header;
    memcpy(&header, found, sizeof header);
    const char *found_key = found + sizeof header;
    OwnedText head = head_of(found_key);
    if (memcmp(header.magic, file_magic, sizeof header.magic) != 0 || header.format != file_format)
        message_error(messages,
                      "'%s' is not a checkpoint of this version of glint; delete it, or pass another file to "
                      "--checkpoint",
                      path);
    else if (memcmp(found, head.items, head.count) != 0)
        damage_report(path, messages);
    else
        difference_report(path, key, found_key, messages);
}

// Checks the bytes with which the file begins. Writes those of a new file, or of a file whose process ended
// while writing them.
static bool head_check(Checkpoint *checkpoint, const char *key, MessageList *messages)
{
    enum { FOUND_MAX = sizeof(FileHeader) + KEY_BYTES_MAX };
    struct stat status;
    if (fstat(checkpoint->descriptor, &status) != 0) return open_failed(checkpoint->path, "read", messages);
    const size_t size = !S_ISREG(status.st_mode)     ? 0
                        : status.st_size < FOUND_MAX ? (size_t)status.st_size
                                                     : FOUND_MAX;
    OwnedText head = head_of(key);
    OWNED char *found = memory_allocate_zeroed(FOUND_MAX + 1, 1);
    bool is_right = bytes_read(checkpoint->descriptor, found, size, &(off_t){0});
    if (!is_right) {
        open_failed(checkpoint->path, "read", messages);
    } else if (!S_ISREG(status.st_mode) ||
               memcmp(found, head.items, size < head.count ? size : head.count) != 0) {
        refusal_report(checkpoint->path, key, found, messages);
        is_right = false;
    } else if (status.st_size < (off_t)head.count) {
        is_right = ftruncate(checkpoint->descriptor, 0) == 0 &&
                   bytes_write(checkpoint->descriptor, head.items, head.count, &(off_t){0}) &&
                   file_sync(checkpoint->descriptor);
        if (!is_right) open_failed(checkpoint->path, "write", messages);
    }
    checkpoint->end = (off_t)head.count;
    return is_right;
}

// Syncs the folder, so that a new file's name outlives a power failure. Not every file system can sync a
// folder.
static void folder_sync(const Checkpoint *checkpoint)
{
    OwnedDescriptor folder = file_folder_open(checkpoint->file_path);
    if (folder >= 0) file_sync(folder);
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
    bool is_open = file_open(checkpoint, messages) && head_check(checkpoint, key, messages);
    const char *failed = is_open ? records_find(checkpoint, messages) : NULL;
    if (failed) is_open = open_failed(path, failed, messages);
    if (!is_open) {
        checkpoint_close(checkpoint, false, messages);
        return NULL;
    }
    checkpoint->file_path = realpath(path, NULL);
    if (!checkpoint->file_path) checkpoint->file_path = memory_copy_text(path);
    folder_sync(checkpoint);
    return checkpoint;
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
    if (!bytes_write(checkpoint->descriptor, record, sizeof *record, &offset)) return false;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (band->layers[layer] &&
            !bytes_write(checkpoint->descriptor, band->layers[layer], film_layer_size(band, layer), &offset))
            return false;
    double now = clock_seconds();
    if (now - checkpoint->synced_seconds < sync_seconds) return true;
    checkpoint->synced_seconds = now;
    return file_sync(checkpoint->descriptor);
}

bool checkpoint_append(Checkpoint *checkpoint, const Film *band)
{
    const RecordHeader record = record_of(band);
    pthread_mutex_lock(&checkpoint->mutex);
    bool is_written = !checkpoint->failure &&
                      (record_write(checkpoint, &record, band) || checkpoint_failed(checkpoint, "write"));
    if (is_written) record_list(checkpoint, band);
    pthread_mutex_unlock(&checkpoint->mutex);
    return is_written;
}

bool checkpoint_read(Checkpoint *checkpoint, uint32_t first_row, Film *band)
{
    pthread_mutex_lock(&checkpoint->mutex);
    off_t offset = 0;
    for (size_t i = 0; i < checkpoint->bands.count; i++)
        if (checkpoint->bands.items[i].first_row == first_row) offset = checkpoint->offsets.items[i];
    if (offset == 0) fault("no band of the checkpoint starts at row %u", first_row);
    const RecordState state = record_read(checkpoint, offset, band);
    if (state == RECORD_TORN) errno = EIO; // changed since it was opened
    if (state != RECORD_WHOLE) {
        checkpoint_failed(checkpoint, "read");
        film_free(band);
    }
    pthread_mutex_unlock(&checkpoint->mutex);
    return state == RECORD_WHOLE;
}

// Removes the file, unless its name now belongs to another file, such as the image itself.
static void file_remove(const Checkpoint *checkpoint, MessageList *messages)
{
    const char *path = checkpoint->file_path;
    if (file_has_name(checkpoint->descriptor, AT_FDCWD, path) && unlink(path) != 0 && errno != ENOENT)
        message_warning(messages, "cannot remove the checkpoint '%s': %s", checkpoint->path, strerror(errno));
}

void checkpoint_close(Checkpoint *checkpoint, bool is_complete, MessageList *messages)
{
    const bool is_kept = checkpoint->file_path && !is_complete;
    if (is_kept && !file_sync(checkpoint->descriptor)) checkpoint_failed(checkpoint, "write");
    if (checkpoint->failure) message_error(messages, "%s", checkpoint->failure);
    if (is_complete) file_remove(checkpoint, messages);
    if (checkpoint->descriptor >= 0) close(checkpoint->descriptor);
    pthread_mutex_destroy(&checkpoint->mutex);
    free(checkpoint->bands.items);
    free(checkpoint->offsets.items);
    free(checkpoint->failure);
    free(checkpoint->file_path);
    free(checkpoint->path);
    free(checkpoint);
}
