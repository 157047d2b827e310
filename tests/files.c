#include "tests/files.h"
#include "tests/check.h"

#include "host/base/fault.h"
#include <dirent.h>
#include <ftw.h>
#include <sys/stat.h>

char *folder_make(void)
{
    char folder[] = "/tmp/glint-test-XXXXXX";
    if (!mkdtemp(folder)) fault("no folder for a test");
    return memory_copy_text(folder);
}

static int remove_one(const char *path, const struct stat *status, int type, struct FTW *place)
{
    (void)status, (void)type, (void)place;
    return remove(path);
}

void folder_remove(char *folder)
{
    nftw(folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    free(folder);
}

static char *working_folder;

int folder_open(void **state)
{
    (void)state;
    working_folder = folder_make();
    return chdir(working_folder);
}

int folder_close(void **state)
{
    (void)state;
    const unsigned temporary_count = folder_count(".glint-");
    if (chdir("/") != 0) return -1;
    folder_remove(working_folder);
    return temporary_count == 0 ? 0 : -1;
}

unsigned folder_count(const char *part)
{
    unsigned count = 0;
    DIR *here = opendir(".");
    assert_non_null(here);
    for (const struct dirent *item; (item = readdir(here)) != NULL;) {
        const bool is_file = strcmp(item->d_name, ".") != 0 && strcmp(item->d_name, "..") != 0;
        count += is_file && strstr(item->d_name, part) != NULL;
    }
    closedir(here);
    return count;
}

char *scratch_open(void)
{
    char *folder = folder_make();
    setenv("XDG_CACHE_HOME", folder, 1);
    setenv("POCL_CACHE_DIR", folder, 1);
    setenv("TMPDIR", folder, 1);
    return folder;
}

void scratch_close(char *folder)
{
    folder_remove(folder);
}

char *scratch;

int scratch_set_up(void **state)
{
    (void)state;
    scratch = scratch_open();
    return 0;
}

int scratch_tear_down(void **state)
{
    (void)state;
    scratch_close(scratch);
    return 0;
}

void file_write(const char *path, const char *text)
{
    file_write_bytes(path, text, strlen(text));
}

void file_write_bytes(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

Text file_text(const char *path)
{
    Text text = {0};
    MessageList messages = {0};
    if (!text_read_file(&text, path, &messages)) fail_msg("%s", messages.items[0].text);
    return text;
}

void check_content(const char *path, const char *expected)
{
    OwnedText text = file_text(path);
    assert_string_equal(text_c(&text), expected);
}

mode_t mode_of(const char *path)
{
    struct stat status;
    assert_int_equal(lstat(path, &status), 0);
    return status.st_mode & 0777;
}
