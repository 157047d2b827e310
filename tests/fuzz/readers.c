// Passes libFuzzer's inputs to the readers. Whatever a reader gets, it must not crash, leak, or rely on data
// that is not there. GLINT_FUZZ names the reader. tools/fuzz runs all of them, and tests/test_readers.c those
// without assimp. The memory that a file claims is bounded by what it has.
#include "tests/fuzz/readers.h"
#include "host/base/array.h"
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/golden_file.h"
#include "host/image/image.h"
#include "host/import/load.h"
#include "host/import/mesh/assimp_process.h"
#include "host/measure/baseline.h"
#include "host/opencl/cache.h"
#include "host/render/checkpoint.h"
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[PATH_MAX - 16]; // in TMPDIR
static int input = -1; // the one that is read; it stays open, since disks are slow to create files

enum { PIXELS_MAX = 1 << 16 }; // of an image
static const SceneOptions scene_options = {.lenient = true, .max_pixels = PIXELS_MAX};

static void input_write(const Source *source)
{
    const ssize_t length = (ssize_t)source->length;
    if (pwrite(input, source->bytes, source->length, 0) != length || ftruncate(input, length) != 0) abort();
}

// Checks that the errors and the verdict agree.
static void verdict_check(bool is_read, const MessageList *messages)
{
    if (is_read == (message_count(messages, MESSAGE_ERROR) > 0)) abort();
}

static void image_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    Image image;
    const bool is_read = image_read(&image, path, &(ImageReadOptions){.max_pixels = PIXELS_MAX}, messages);
    verdict_check(is_read, messages);
    if (is_read) image_free(&image);
}

static void mesh_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    const Source scene_source = {.file = "scene.yaml", .bytes = "", .length = 0};
    Report report = report_open(&scene_source, messages);
    const MeshImport import = {
        .path = path, .transform = affine_identity, .own_materials = true, .report = &report};
    Scene scene = {0};
    uint32_t index;
    const bool is_read = mesh_import(&scene, &import, &index), is_sound = report_close(&report);
    verdict_check(is_read && is_sound, messages);
    scene_free(&scene);
}

static void mesh_scene_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    Scene scene;
    if (scene_read_mesh(&scene, path, &scene_options, messages)) scene_free(&scene);
}

// The path of the mesh's file. A material library that it names is in the same folder.
static char obj_path[PATH_MAX];

static void obj_write(void)
{
    snprintf(obj_path, sizeof obj_path, "%s/a.obj", folder);
    FILE *file = fopen(obj_path, "wb");
    if (!file ||
        fputs("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1 2 3\n",
              file) < 0 ||
        fclose(file) != 0)
        abort();
}

static void mtl_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)path;
    mesh_fuzz(obj_path, source, messages);
}

static void draft_fuzz(const char *path, bool (*read)(MeshDraft *draft), MessageList *messages)
{
    const Source scene_source = {.file = "scene.yaml", .bytes = "", .length = 0};
    Report report = report_open(&scene_source, messages);
    const MeshImport import = {
        .path = path, .transform = affine_identity, .own_materials = true, .report = &report};
    Scene scene = {0};
    MeshDraft draft = {.import = &import, .scene = &scene, .source = scene_source, .places = DRAFT_NO_PLACES};
    Mesh mesh = {0};
    if (read(&draft) && draft_check(&draft)) draft_finish(&draft, &mesh);
    mesh_free(&mesh);
    draft_free(&draft);
    report_close(&report);
    scene_free(&scene);
}

// Reads a reply, which a process that runs assimp may have written.
static bool reply_read(MeshDraft *draft)
{
    FILE *reply = fopen(draft->import->path, "rb");
    if (!reply) abort();
    bool read;
    const bool whole = assimp_reply_read(draft, reply, &read);
    fclose(reply);
    return whole;
}

static void reply_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    draft_fuzz(path, reply_read, messages);
}

// Runs assimp in this process. Its faults are found like glint's.
static void assimp_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    draft_fuzz(path, assimp_read, messages);
}

#define SCENE_READER(format, is_read)                                                                        \
    static void format##_fuzz(const char *path, const Source *source, MessageList *messages)                 \
    {                                                                                                        \
        (void)path;                                                                                          \
        Scene scene;                                                                                         \
        verdict_check(is_read, messages);                                                                    \
        scene_free(&scene);                                                                                  \
    }

SCENE_READER(yaml, scene_read_yaml(&scene, source, &scene_options, messages))
SCENE_READER(rt, scene_read_rt(&scene, source, &scene_options, messages))
SCENE_READER(cfg, scene_read_cfg(&scene, source, messages))
SCENE_READER(nff, scene_read_nff(&scene, source, messages))
SCENE_READER(dat, scene_read_dat(&scene, source, &scene_options, messages))

// Checks that each band can be read, or the checkpoint fails, and that no band has rows outside the image.
static void checkpoint_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    const FilmHeader film = {
        .width = 2, .row_count = 8, .light_count = 1, .real_size = sizeof(float), .layers = AOV_COLOR};
    Checkpoint *checkpoint = checkpoint_open(path, "size: 2x8\nscene: 1\n", &film, messages);
    if (!checkpoint) return;
    size_t count;
    const BandRows *bands = checkpoint_bands(checkpoint, &count);
    for (size_t i = 0; i < count; i++) {
        Film band;
        if (bands[i].row_count == 0 || bands[i].first_row + bands[i].row_count > film.row_count) abort();
        if (checkpoint_read(checkpoint, bands[i].first_row, &band)) film_free(&band);
    }
    checkpoint_close(checkpoint, false, messages);
}

// Loads an entry. What has the right hash is loaded, which libFuzzer may find by tracing its comparison.
static void cache_fuzz(const char *path, const Source *source, MessageList *messages)
{
    static const char key[] = "fuzz", stored[] = "machine code";
    (void)path;
    (void)messages;
    static char *entry;
    Text binary = {0};
    if (!entry) {
        text_append(&binary, stored, sizeof stored);
        cache_store(key, &binary, NULL);
        text_free(&binary);
        entry = cache_entry_path(key);
        if (!entry) abort();
        input = open(entry, O_WRONLY | O_CLOEXEC);
    }
    input_write(source);
    cache_load(key, &binary, NULL);
    text_free(&binary);
}

static void baseline_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    Baseline *baseline = baseline_open(path, false, messages);
    if (baseline) baseline_close(baseline);
}

static void golden_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    GoldenFile file = {0};
    verdict_check(golden_file_read(&file, path, messages), messages);
    golden_file_free(&file);
}

static const struct {
    const char *name, *file; // without one it reads only the source
    void (*read)(const char *path, const Source *source, MessageList *messages);
} readers[] = {
    {"png", "a.png", image_fuzz},
    {"jpeg", "a.jpg", image_fuzz},
    {"ppm", "a.ppm", image_fuzz},
    {"exr", "a.exr", image_fuzz},
    {"npy", "a.npy", image_fuzz},
    {"obj", "a.obj", mesh_fuzz},
    {"mtl", "a.mtl", mtl_fuzz},
    {"ply", "a.ply", mesh_fuzz},
    {"reply", "a", reply_fuzz},
    {"stl", "a.stl", mesh_fuzz},
    {"gltf", "a.gltf", mesh_scene_fuzz},
    {"glb", "a.glb", mesh_scene_fuzz},
    {"fbx", "a.fbx", assimp_fuzz},
    {"dae", "a.dae", assimp_fuzz},
    {"3ds", "a.3ds", assimp_fuzz},
    {"off", "a.off", assimp_fuzz},
    {"yaml", NULL, yaml_fuzz},
    {"rt", NULL, rt_fuzz},
    {"cfg", NULL, cfg_fuzz},
    {"nff", NULL, nff_fuzz},
    {"dat", NULL, dat_fuzz},
    {"checkpoint", "a", checkpoint_fuzz},
    {"cache", NULL, cache_fuzz},
    {"baseline", "a.json", baseline_fuzz},
    {"golden", "a.txt", golden_fuzz},
};

static size_t reader;
static char path[PATH_MAX];

static void scratch_remove(void)
{
    unlink(path);
    unlink(obj_path);
    char *entries = cache_folder_path();
    if (entries) {
        MessageList ignored = {0};
        cache_clear(&ignored);
        message_list_free(&ignored);
        rmdir(entries);
    }
    free(entries);
    rmdir(folder);
}

// NOLINTNEXTLINE(readability-non-const-parameter): libFuzzer's signature
int LLVMFuzzerInitialize(int *argument_count, char ***arguments)
{
    (void)argument_count;
    (void)arguments;
    const char *name = getenv("GLINT_FUZZ");
    const size_t count = COUNT_OF(readers);
    while (reader < count && (!name || strcmp(readers[reader].name, name) != 0))
        reader++;
    if (reader == count) {
        fputs("GLINT_FUZZ must be one of", stderr);
        for (size_t i = 0; i < count; i++)
            fprintf(stderr, " %s", readers[i].name);
        fputs("\n", stderr);
        exit(EXIT_USER);
    }
    const char *parent = getenv("TMPDIR");
    const int length =
        snprintf(folder, sizeof folder, "%s/glint-fuzz-XXXXXX", parent && *parent ? parent : "/tmp");
    if (length >= (int)sizeof folder || !mkdtemp(folder)) exit(EXIT_MACHINE);
    snprintf(path, sizeof path, "%s/%s", folder, readers[reader].file ? readers[reader].file : "a");
    if (readers[reader].file) input = open(path, O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    if (readers[reader].read == mtl_fuzz) obj_write();
    setenv("XDG_CACHE_HOME", folder, 1);
    atexit(scratch_remove);
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    // of its exact length, which AddressSanitizer guards; readers of text expect a NUL behind it
    char *text = memory_allocate(size + 1, 1);
    memcpy(text, bytes, size);
    text[size] = '\0';
    const Source source = {.file = path, .bytes = text, .length = size};
    if (readers[reader].file) input_write(&source);
    MessageList messages = {0};
    readers[reader].read(path, &source, &messages);
    message_list_free(&messages);
    free(text);
    return 0;
}
