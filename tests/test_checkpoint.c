// Tests checkpoints: appended bands are read back whatever a crash left at the end of the file, and a file of
// another image is refused and stays unchanged.
#include "host/render/scheduler.h"
#include "tests/check.h"
#include "tests/files.h"
#include <errno.h>
#include <sys/stat.h>
#include <sys/syscall.h>

enum { WIDTH = 5, ROWS = 12, BAND_ROWS = 4, BANDS = ROWS / BAND_ROWS, COLOR_VALUES = BAND_ROWS * WIDTH * 3 };
static const char key[] = "size: 5x12\nscene: 1234\n";
static const FilmHeader film = {.width = WIDTH,
                                .row_count = ROWS,
                                .light_count = 2,
                                .real_size = sizeof(float),
                                .layers = AOV_COLOR | AOV_OBJECT};
static char path[64];

static float color_value(uint32_t row, uint32_t i)
{
    return (float)(row * 100 + i);
}

// A band with a color and an integer layer.
typedef struct {
    float color[COLOR_VALUES];
    uint32_t object[BAND_ROWS * WIDTH];
} Values;

static Film band_make(Values *values, uint32_t first_row)
{
    for (uint32_t i = 0; i < COLOR_VALUES; i++)
        values->color[i] = color_value(first_row, i);
    for (uint32_t i = 0; i < BAND_ROWS * WIDTH; i++)
        values->object[i] = first_row + i;
    Film band = {.width = WIDTH,
                 .height = BAND_ROWS,
                 .light_count = 2,
                 .first_row = first_row,
                 .real_size = sizeof(float)};
    band.layers[LAYER_COLOR] = values->color;
    band.layers[LAYER_OBJECT] = values->object;
    return band;
}

// Opens the checkpoint. Expects a warning of the bytes that are cut off, if there are any.
static Checkpoint *open_cut(size_t cut_bytes)
{
    OwnedMessageList messages = {0};
    OWNED char *warning = text_format("the last %zu bytes of the checkpoint '%s' do not", cut_bytes, path);
    Checkpoint *checkpoint = checkpoint_open(path, key, &film, &messages);
    if (cut_bytes == 0) message_list_print(&messages, stderr);
    assert_non_null(checkpoint);
    assert_int_equal(messages.count, cut_bytes > 0);
    if (cut_bytes > 0 && !strstr(messages.items[0].text, warning)) fail_msg("%s", messages.items[0].text);
    return checkpoint;
}

static Checkpoint *open_checked(void)
{
    return open_cut(0);
}

static void close_checked(Checkpoint *checkpoint, bool is_complete)
{
    MessageList messages = {0};
    checkpoint_close(checkpoint, is_complete, &messages);
    assert_int_equal(messages.count, 0);
}

static size_t band_count(const Checkpoint *checkpoint)
{
    size_t count;
    checkpoint_bands(checkpoint, &count);
    return count;
}

static void append(Checkpoint *checkpoint, uint32_t first_row)
{
    Values values;
    const Film band = band_make(&values, first_row);
    assert_true(checkpoint_append(checkpoint, &band));
}

static void read_checked(Checkpoint *checkpoint, uint32_t first_row)
{
    Values values;
    const Film expected = band_make(&values, first_row);
    OwnedFilm band;
    assert_true(checkpoint_read(checkpoint, first_row, &band));
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        assert_int_equal(band.layers[layer] != NULL, expected.layers[layer] != NULL);
        if (band.layers[layer])
            assert_memory_equal(band.layers[layer], expected.layers[layer],
                                film_layer_size(&expected, layer));
    }
    assert_int_equal(band.first_row, first_row);
    assert_int_equal(band.light_count, expected.light_count);
}

// Makes a file with all bands, the last first. Returns its bytes.
static Text file_make(void)
{
    unlink(path);
    Checkpoint *checkpoint = open_checked();
    for (uint32_t i = BANDS; i-- > 0;)
        append(checkpoint, i * BAND_ROWS);
    close_checked(checkpoint, false);
    return file_text(path);
}

static size_t file_size(void)
{
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    return (size_t)status.st_size;
}

TEST(bands_are_read_again)
{
    Text bytes = file_make();
    text_free(&bytes);
    Checkpoint *checkpoint = open_checked();
    assert_int_equal(band_count(checkpoint), BANDS);
    for (uint32_t i = 0; i < BANDS; i++)
        read_checked(checkpoint, i * BAND_ROWS);
    close_checked(checkpoint, true);
    assert_int_not_equal(access(path, F_OK), 0); // the image is complete
}

// If the file is cut off at any byte, it has the bands before that byte, and a render resumes from them.
TEST(torn_writes)
{
    OwnedText bytes = file_make();
    size_t header_size, kept = 0;
    unlink(path);
    close_checked(open_checked(), false);
    header_size = file_size();
    const size_t record_size = (bytes.count - header_size) / BANDS;
    assert_int_equal(record_size * BANDS, bytes.count - header_size);
    for (size_t size = 0; size <= bytes.count; size++) {
        file_write_bytes(path, bytes.items, size);
        kept = size < header_size ? 0 : (size - header_size) / record_size;
        Checkpoint *checkpoint = open_cut(size < header_size ? 0 : (size - header_size) % record_size);
        assert_int_equal(band_count(checkpoint), kept);
        assert_int_equal(file_size(), header_size + kept * record_size);
        if (kept < BANDS) {
            const uint32_t first_row = (uint32_t)(BANDS - 1 - kept) * BAND_ROWS;
            append(checkpoint, first_row);
            read_checked(checkpoint, first_row);
        }
        close_checked(checkpoint, false);
    }
}

// A wrong byte ends the bands that are used.
TEST(wrong_bytes)
{
    OwnedText bytes = file_make();
    unlink(path);
    close_checked(open_checked(), false);
    const size_t header_size = file_size(), record_size = (bytes.count - header_size) / BANDS;
    for (size_t at = header_size; at < bytes.count; at++) {
        bytes.items[at] ^= 0x10;
        file_write_bytes(path, bytes.items, bytes.count);
        const size_t kept = (at - header_size) / record_size;
        Checkpoint *checkpoint = open_cut((BANDS - kept) * record_size);
        assert_int_equal(band_count(checkpoint), kept);
        close_checked(checkpoint, false);
        bytes.items[at] ^= 0x10;
    }
}

// Returns the size of the file before the band.
static size_t append_film(const Film *band)
{
    Checkpoint *checkpoint = open_checked();
    const size_t before = file_size();
    assert_true(checkpoint_append(checkpoint, band));
    close_checked(checkpoint, false);
    return before;
}

// Whole records that do not fit the image are not used.
TEST(other_sizes)
{
    Values values;
    const Film right = band_make(&values, ROWS - BAND_ROWS);
    for (int i = 0; i < 8; i++) {
        Film band = right;
        if (i == 0) band.width--;
        if (i == 1) band.light_count++;
        if (i == 2) band.real_size = 1;
        if (i == 3) band.is_double = true;
        if (i == 4) band.layers[LAYER_OBJECT] = NULL;
        if (i == 5) band.first_row++; // one row below the last
        if (i == 6) band.first_row = UINT32_MAX - 1;
        if (i == 7) band.height = 0;
        unlink(path);
        const size_t before = append_film(&band);
        Checkpoint *checkpoint = open_cut(file_size() - before);
        assert_int_equal(band_count(checkpoint), 0);
        close_checked(checkpoint, false);
    }
    unlink(path);
    append_film(&right);
    Film again = right;
    again.first_row--; // some of the same rows
    const size_t before = append_film(&again);
    Checkpoint *checkpoint = open_cut(file_size() - before);
    assert_int_equal(band_count(checkpoint), 1);
    close_checked(checkpoint, false);
}

// Expects a refusal with a reason, which leaves the file unchanged.
static void refused(const char *other_key, const char *reason)
{
    OwnedText before = file_text(path);
    OwnedMessageList messages = {0};
    assert_null(checkpoint_open(path, other_key, &film, &messages));
    assert_int_equal(messages.count, 1);
    if (!strstr(messages.items[0].text, reason)) fail_msg("%s", messages.items[0].text);
    OwnedText after = file_text(path);
    assert_int_equal(before.count, after.count);
    assert_memory_equal(before.items, after.items, before.count);
}

TEST(refusals)
{
    OwnedText bytes = file_make();
    unlink(path);
    close_checked(open_checked(), false);
    const size_t header_size = file_size();
    file_write_bytes(path, bytes.items, bytes.count);
    refused("size: 6x12\nscene: 1234\n", "belongs to another image (size: 5x12, not 6x12)");
    refused("size: 5x12\nscene: 9\n", "belongs to another image (scene: 1234, not 9)");
    refused("size: 5x12\nlanes: 4\nscene: 1234\n", "belongs to another image (lanes: none, not 4)");
    Checkpoint *checkpoint = open_checked();
    refused(key, "is in use by another process");
    close_checked(checkpoint, false);
    for (size_t at = 24; at < bytes.count && at < header_size; at++) { // after magic and format
        bytes.items[at] ^= 0x10;
        file_write_bytes(path, bytes.items, bytes.count);
        refused(key, "is damaged");
        bytes.items[at] ^= 0x10;
    }
    file_write_bytes(path, "camera: {position: [0, 0, 0]}\n", 30);
    refused(key, "is not a checkpoint of this version of glint");
    bytes.items[16]++; // the format
    file_write_bytes(path, bytes.items, bytes.count);
    refused(key, "is not a checkpoint of this version of glint");

    OwnedMessageList messages = {0};
    assert_null(checkpoint_open("/dev/null", key, &film, &messages));
    assert_null(checkpoint_open("/nowhere/file", key, &film, &messages));
    assert_int_equal(messages.count, 2);
}

// A symbolic link stays. The file behind it is removed, and the next render creates it.
TEST(symbolic_links)
{
    const char *file = formatted("%s-file", path);
    unlink(path);
    assert_int_equal(symlink(file, path), 0);
    for (int i = 0; i < 2; i++) {
        Checkpoint *checkpoint = open_checked();
        append(checkpoint, 0);
        assert_int_equal(access(file, F_OK), 0);
        close_checked(checkpoint, true);
        assert_int_not_equal(access(file, F_OK), 0);
    }
    struct stat status;
    assert_int_equal(lstat(path, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    unlink(path);
}

static bool removal_fails;

int __real_unlink(const char *name);
int __wrap_unlink(const char *name);
int __wrap_unlink(const char *name)
{
    errno = EPERM;
    return removal_fails ? -1 : __real_unlink(name);
}

TEST(a_file_that_stays)
{
    Checkpoint *checkpoint = open_checked();
    OwnedMessageList messages = {0};
    removal_fails = true;
    checkpoint_close(checkpoint, true, &messages);
    removal_fails = false;
    assert_int_equal(messages.count, 1);
    assert_non_null(strstr(messages.items[0].text, "cannot remove the checkpoint"));
    assert_non_null(strstr(messages.items[0].text, strerror(EPERM)));
    assert_int_equal(unlink(path), 0);
}

static int sync_error; // 0 if syncs succeed

int fsync(int descriptor) // NOLINT(readability-inconsistent-declaration-parameter-name)
{
    if (sync_error == 0) return (int)syscall(SYS_fsync, descriptor);
    errno = sync_error;
    return -1;
}

// The bands of the last second are synced when the file is closed. Not every file system can sync.
TEST(syncs_that_fail)
{
    unlink(path);
    Checkpoint *checkpoint = open_checked();
    append(checkpoint, 0);
    OwnedMessageList messages = {0};
    sync_error = EIO;
    checkpoint_close(checkpoint, false, &messages);
    assert_int_equal(messages.count, 1);
    assert_non_null(strstr(messages.items[0].text, "cannot write the checkpoint"));
    assert_non_null(strstr(messages.items[0].text, strerror(EIO)));
    refused("size: 6x12\nscene: 1234\n", "belongs to another image"); // which has nothing to sync
    unlink(path);
    sync_error = EINVAL;
    checkpoint = open_checked();
    append(checkpoint, 0);
    close_checked(checkpoint, false);
    sync_error = 0;
}

static bool truncation_fails;

int ftruncate(int descriptor, off_t length) // NOLINT(readability-inconsistent-declaration-parameter-name)
{
    char name[64];
    snprintf(name, sizeof name, "/proc/self/fd/%d", descriptor);
    if (!truncation_fails) return truncate(name, length);
    errno = EPERM;
    return -1;
}

TEST(torn_record_that_stays)
{
    OwnedText bytes = file_make();
    file_write_bytes(path, bytes.items, bytes.count - 1);
    truncation_fails = true;
    refused(key, "cannot write the checkpoint");
    truncation_fails = false;
}

// Another process completes its image and removes the file before this one has locked it.
static bool file_is_removed;

int __real_flock(int descriptor, int operation);
int __wrap_flock(int descriptor, int operation);
int __wrap_flock(int descriptor, int operation)
{
    if (file_is_removed) unlink(path);
    file_is_removed = false;
    return __real_flock(descriptor, operation);
}

TEST(a_file_removed_before_the_lock)
{
    unlink(path);
    file_is_removed = true;
    Checkpoint *checkpoint = open_checked();
    assert_false(file_is_removed);
    append(checkpoint, 0);
    close_checked(checkpoint, false);
    checkpoint = open_checked();
    assert_int_equal(band_count(checkpoint), 1);
    close_checked(checkpoint, true);
}

typedef struct {
    uint32_t rows, rendered;
    bool is_right;
} ResumedRows;

static bool band_sink(void *context, const Film *band)
{
    ResumedRows *sink = context;
    const float *color = band->layers[LAYER_COLOR];
    sink->is_right = sink->is_right && band->first_row == sink->rows;
    for (uint32_t i = 0; i < COLOR_VALUES; i++)
        sink->is_right = sink->is_right && color[i] == color_value(band->first_row, i);
    sink->rows += band->height;
    return true;
}

// Only missing bands are handed out, and all reach the sink in order.
TEST(a_render_resumes)
{
    for (unsigned done = 0; done < 1 << BANDS; done++) {
        unlink(path);
        Checkpoint *checkpoint = open_checked();
        unsigned done_count = 0;
        for (uint32_t i = BANDS; i-- > 0;)
            if (done >> i & 1) {
                append(checkpoint, i * BAND_ROWS);
                done_count++;
            }
        close_checked(checkpoint, false);
        checkpoint = open_checked();
        ResumedRows sink = {.is_right = true};
        Scheduler *scheduler = scheduler_open(&(SchedulerSettings){.row_count = ROWS,
                                                                   .worker_count = 1,
                                                                   .sink = band_sink,
                                                                   .context = &sink,
                                                                   .checkpoint = checkpoint});
        for (BandRows rows; (rows = scheduler_acquire(scheduler, 0, BAND_ROWS, 1)).row_count > 0;) {
            Values values;
            const Film band = band_make(&values, rows.first_row);
            assert_int_equal(rows.row_count, BAND_ROWS);
            assert_false(done >> rows.first_row / BAND_ROWS & 1);
            assert_true(scheduler_deliver(scheduler, 0, &band));
        }
        WorkerShare share;
        assert_true(scheduler_close(scheduler, &share));
        assert_true(sink.is_right);
        assert_int_equal(sink.rows, ROWS);
        assert_int_equal(share.bands, BANDS - done_count);
        assert_int_equal(band_count(checkpoint), BANDS);
        close_checked(checkpoint, true);
    }
}

static int set_up(void **state)
{
    scratch_set_up(state);
    snprintf(path, sizeof path, "%s/checkpoint", scratch);
    return 0;
}

TEST_MAIN(set_up, scratch_tear_down)
