#include "host/cli/report_archive.h"

#include "host/api/version.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include <assimp/version.h>
#include <dirent.h>
#include <jansson.h>
#include <libfyaml.h>
#include <openexr_base.h>
#include <png.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>
#include <zlib.h>

// Appends a library's version.
static void version_append(Text *text, const char *name, const char *version)
{
    text_appendf(text, "%-20s %s\n", name, version ? version : "unknown");
}

static void libraries_append(Text *text)
{
    int major = 0, minor = 0, patch = 0;
    const char *extra;
    exr_get_library_version(&major, &minor, &patch, &extra);
    OWNED char *openexr = text_format("%d.%d.%d", major, minor, patch);
    OWNED char *assimp =
        text_format("%u.%u.%u", aiGetVersionMajor(), aiGetVersionMinor(), aiGetVersionPatch());
    version_append(text, "assimp", assimp);
    version_append(text, "jansson", jansson_version_str());
    version_append(text, "libfyaml", fy_library_version());
    version_append(text, "libpng", png_get_libpng_ver(NULL));
    version_append(text, "libsodium", sodium_version_string());
    version_append(text, "OpenEXR", openexr);
    version_append(text, "zlib", zlibVersion());
}

// Appends the name of the system's release from os-release(5).
static void release_append(Text *text)
{
    OwnedText file = {0};
    static const char key[] = "PRETTY_NAME=\"";
    const char *name = text_read_file(&file, "/etc/os-release", NULL) ? strstr(text_c(&file), key) : NULL;
    if (name) {
        name += sizeof key - 1;
        text_appendf(text, "%-20s %.*s\n", "release", (int)strcspn(name, "\"\n"), name);
    }
}

// Appends the variables that change what OpenCL does. POCL_REMOTE0_PARAMETERS and the like have addresses.
static void variables_append(Text *text)
{
    static const char *const prefixes[] = {"CL_",     "CUDA_", "GALLIUM_", "GLINT_",  "GPU_",
                                           "HIP_",    "LP_",   "MESA_",    "NEO",     "OCL",
                                           "OPENCL_", "POCL_", "ROCR_",    "RUSTICL_"};
    for (char **variable = environ; *variable; variable++)
        for (size_t i = 0; i < COUNT_OF(prefixes); i++)
            if (strncmp(*variable, prefixes[i], strlen(prefixes[i])) == 0 && !strstr(*variable, "REMOTE"))
                text_appendf(text, "%s\n", *variable);
}

Text report_versions(void)
{
    Text text = {0};
    struct utsname host = {0};
    uname(&host);
    version_append(&text, "glint", glint_version());
    version_append(&text, "commit", glint_commit());
    version_append(&text, "compiler", glint_compiler());
    libraries_append(&text);
    release_append(&text);
    version_append(&text, "kernel", host.sysname);
    version_append(&text, "kernel release", host.release);
    version_append(&text, "machine", host.machine);
    text_appendf(&text, "%-20s %ld\n\n", "processors", sysconf(_SC_NPROCESSORS_ONLN));
    variables_append(&text);
    return text;
}

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
    const char *folder;
    const Scrubber *scrubber;
    MessageList *messages;
    Text names, list; // a line per file: its name, or its name and meaning
    size_t count;
    bool is_written;
} Archive;

bool report_file_write(const char *folder, const char *name, const Text *contents, MessageList *messages)
{
    OWNED char *path = text_format("%s/%s", folder, name);
    return output_write_file(path, text_c(contents), contents->count, messages);
}

// Adds a file of the folder, which is scrubbed, unless it is empty or missing. Kernels have only glint's
// text.
static void file_add(Archive *archive, const char *name)
{
    OWNED char *path = text_format("%s/%s", archive->folder, name);
    OwnedText contents = {0};
    if (!text_read_file(&contents, path, NULL) || contents.count == 0) return;
    if (strcmp(strrchr(name, '.'), ".cl") != 0) {
        OwnedText scrubbed = scrub(archive->scrubber, &contents);
        archive->is_written &= report_file_write(archive->folder, name, &scrubbed, archive->messages);
    }
    text_appendf(&archive->names, "%s\n", name);
    text_appendf(&archive->list, "  %-29s %s\n", name, meaning_of(name));
    archive->count++;
}

static int is_kernel_file(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static void kernels_add(Archive *archive)
{
    OWNED char *path = text_format("%s/kernels", archive->folder);
    struct dirent **entries;
    const int count = scandir(path, &entries, is_kernel_file, alphasort);
    for (int i = 0; i < count; i++) {
        OWNED char *name = text_format("kernels/%s", entries[i]->d_name);
        file_add(archive, name);
        free(entries[i]);
    }
    if (count >= 0) free(entries);
}

static Text index_text(const Archive *archive, const char *steps)
{
    Text text = {0};
    char date[32] = "";
    const time_t now = time(NULL);
    struct tm utc;
    if (gmtime_r(&now, &utc)) strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &utc);
    text_appendf(&text,
                 "Report of glint %s, %s. Folders are replaced by ~ or PATH, and the names of the user and "
                 "the host by USER\nand HOST.\n\nSteps\n\n%s\nFiles\n\n  %-29s %s\n%s",
                 glint_version(), date, steps, "index.txt", meaning_of("index.txt"), text_c(&archive->list));
    return text;
}

size_t report_files_prepare(const char *folder, const Scrubber *scrubber, const char *steps,
                            MessageList *messages)
{
    Archive archive = {.folder = folder, .scrubber = scrubber, .messages = messages, .is_written = true};
    text_appendf(&archive.names, "index.txt\n");
    for (size_t i = 0; i < COUNT_OF(meanings); i++)
        if (strchr(meanings[i].name, '.') != meanings[i].name) file_add(&archive, meanings[i].name);
    kernels_add(&archive);
    OwnedText index = index_text(&archive, steps);
    const bool is_written = archive.is_written && report_file_write(folder, "index.txt", &index, messages) &&
                            report_file_write(folder, REPORT_NAMES, &archive.names, messages);
    text_free(&archive.names);
    text_free(&archive.list);
    return is_written ? archive.count + 1 : 0;
}
