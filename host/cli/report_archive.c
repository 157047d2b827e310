#include "host/cli/report_archive.h"

#include "host/api/version.h"
#include "host/base/array.h"
#include "host/cli/archive.h"
#include <dirent.h>
#include <stdlib.h>
#include <string.h>

// The meanings of the archive's files, by their names or, below kernels/, by their endings.
static const struct {
    const char *name, *meaning;
} meanings[] = {
    {"index.txt", "this list"},
    {"versions.txt",
     "versions of glint, of its libraries and of the system, and variables that OpenCL reads"},
    {"devices.json", "the OpenCL devices: glint devices --json"},
    {"devices.log", "messages of this command"},
    {"passports.json", "the devices and what their arithmetic really does: glint devices --probe --json"},
    {"passports.log", "messages of this command"},
    {"verify.json", "the hard cases: glint verify --quick --json"},
    {"verify.txt", "the hard cases as text, up to a crash if there was one"},
    {"verify.log", "messages of this command"},
    {"scene.yaml", "the scene of glint bench"},
    {"bench.json", "times of scene.yaml: glint bench --json"},
    {"bench.txt", "these times as text"},
    {"bench.log", "messages of this command"},
    {".cl", "the text of a kernel, named by its hash"},
    {".log", "options, status and log of each build of this kernel"},
};

static const char *meaning_of(const char *name)
{
    const bool is_kernel = strchr(name, '/') != NULL;
    const char *key = is_kernel ? strrchr(name, '.') : name;
    for (size_t i = 0; i < COUNT_OF(meanings); i++)
        if (strcmp(meanings[i].name, key) == 0) return meanings[i].meaning;
    return "";
}

typedef struct {
    Text tar, list; // `list` has a line per file
    size_t count;
    time_t now;
    const char *folder;
    const Scrubber *scrubber;
} Archive;

static void file_add(Archive *archive, const char *name, const Text *contents)
{
    archive_add(&archive->tar, name, contents, archive->now);
    text_appendf(&archive->list, "  %-29s %s\n", name, meaning_of(name));
    archive->count++;
}

// Adds a file of the folder unless it is empty or missing. Kernels have only glint's text; they are kept.
static void folder_file_add(Archive *archive, const char *name)
{
    char *path = text_format("%s/%s", archive->folder, name);
    Text contents = {0};
    MessageList ignored = {0};
    const char *ending = strrchr(name, '.');
    if (text_read_file(&contents, path, &ignored) && contents.count > 0) {
        Text scrubbed = strcmp(ending, ".cl") == 0 ? contents : scrub(archive->scrubber, &contents);
        file_add(archive, name, &scrubbed);
        if (scrubbed.items != contents.items) text_free(&scrubbed);
    }
    message_list_free(&ignored);
    text_free(&contents);
    free(path);
}

static int is_kernel_file(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static void kernels_add(Archive *archive)
{
    char *path = text_format("%s/kernels", archive->folder);
    struct dirent **entries;
    const int count = scandir(path, &entries, is_kernel_file, alphasort);
    for (int i = 0; i < count; i++) {
        char *name = text_format("kernels/%s", entries[i]->d_name);
        folder_file_add(archive, name);
        free(name);
        free(entries[i]);
    }
    if (count >= 0) free(entries);
    free(path);
}

static Text index_text(const Archive *archive, const char *steps)
{
    Text text = {0};
    char date[32] = "";
    struct tm utc;
    if (gmtime_r(&archive->now, &utc)) strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &utc);
    text_appendf(&text,
                 "Report of glint %s, %s. Folders are replaced by ~ or PATH, and the names of the user and "
                 "the host by USER\nand HOST.\n\nSteps\n\n%s\nFiles\n\n  %-29s %s\n%s",
                 glint_version(), date, steps, "index.txt", meaning_of("index.txt"), text_c(&archive->list));
    return text;
}

size_t report_archive_write(OutputFile *output, const char *folder, const Scrubber *scrubber,
                            const Text *versions, const char *steps, MessageList *messages)
{
    Archive archive = {.now = time(NULL), .folder = folder, .scrubber = scrubber};
    Text tar = {0};
    file_add(&archive, "versions.txt", versions);
    for (size_t i = 0; i < COUNT_OF(meanings); i++)
        if (strchr(meanings[i].name, '.') != meanings[i].name) folder_file_add(&archive, meanings[i].name);
    kernels_add(&archive);
    Text index = index_text(&archive, steps);
    archive_add(&tar, "index.txt", &index, archive.now);
    text_append(&tar, text_c(&archive.tar), archive.tar.count);
    const bool is_written = archive_write(&tar, output, messages) && output_commit(output, messages);
    text_free(&tar);
    text_free(&index);
    text_free(&archive.tar);
    text_free(&archive.list);
    return is_written ? archive.count + 1 : 0;
}
