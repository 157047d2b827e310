// libFuzzer's target: whatever a reader gets, it must neither crash nor leak, nor believe what is not there.
// GLINT_FUZZ names the reader; tools/fuzz runs them. Memory that a file claims is bounded by what it has.
#include "host/base/fault.h"
#include "host/base/text.h"
#include "host/image/image.h"
#include "host/import/load.h"
#include "host/import/mesh/assimp_process.h"
#include "host/measure/baseline.h"
#include "host/opencl/cache.h"
#include "host/render/checkpoint.h"
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[PATH_MAX - 16]; // in TMPDIR

static void image_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    Image image;
    if (image_read(&image, path, messages)) image_free(&image);
}

static void mesh_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    const Source scene_source = {.file = "scene.yaml", .bytes = "", .length = 0};
    Report report = report_open(&scene_source, messages);
    const MeshImport import = {
        .path = path, .transform.scale = {1, 1, 1}, .own_materials = true, .report = &report};
    Scene scene = {0};
    uint32_t index;
    mesh_import(&scene, &import, &index);
    report_close(&report);
    scene_free(&scene);
}

// The file is the one that a mesh names.
static void mtl_fuzz(const char *path, const Source *source, MessageList *messages)
{
    static const char obj[] =
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1 2 3\n";
    char obj_path[PATH_MAX];
    snprintf(obj_path, sizeof obj_path, "%.*sobj", (int)(strlen(path) - strlen("mtl")), path);
    FILE *file = fopen(obj_path, "wb");
    if (!file || fputs(obj, file) < 0 || fclose(file) != 0) abort();
    mesh_fuzz(obj_path, source, messages);
    unlink(obj_path);
}

// What a process that runs assimp may write.
static void reply_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    const Source scene_source = {.file = "scene.yaml", .bytes = "", .length = 0};
    Report report = report_open(&scene_source, messages);
    const MeshImport import = {
        .path = "a.fbx", .transform.scale = {1, 1, 1}, .own_materials = true, .report = &report};
    Scene scene = {0};
    MeshDraft draft = {.import = &import, .scene = &scene, .source = scene_source, .places = DRAFT_NO_PLACES};
    Mesh mesh = {0};
    bool read;
    FILE *file = fopen(path, "rb");
    if (!file) abort();
    if (assimp_reply_read(&draft, file, &read) && draft_check(&draft)) draft_finish(&draft, &mesh);
    fclose(file);
    mesh_free(&mesh);
    draft_free(&draft);
    report_close(&report);
    scene_free(&scene);
}

static const SceneOptions scene_options = {.lenient = true};

static void yaml_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)path;
    Scene scene;
    if (scene_read_yaml(&scene, source, &scene_options, messages)) scene_free(&scene);
}

static void rt_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)path;
    Scene scene;
    if (scene_read_rt(&scene, source, &scene_options, messages)) scene_free(&scene);
}

static void cfg_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)path;
    Scene scene;
    if (scene_read_cfg(&scene, source, messages)) scene_free(&scene);
}

static void nff_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)path;
    Scene scene;
    if (scene_read_nff(&scene, source, messages)) scene_free(&scene);
}

// Each band that it has can be read, or the checkpoint fails: it never holds rows that the image has not.
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

// Nothing but what was stored is ever loaded.
static void cache_fuzz(const char *path, const Source *source, MessageList *messages)
{
    static const char key[] = "fuzz", stored[] = "machine code";
    (void)path;
    (void)messages;
    static char *entry;
    Text binary = {0};
    if (!entry) {
        text_append(&binary, stored, sizeof stored);
        cache_store(key, &binary);
        text_free(&binary);
        entry = cache_entry_path(key);
        if (!entry) abort();
    }
    FILE *file = fopen(entry, "wb");
    if (!file || fwrite(source->bytes, 1, source->length, file) != source->length || fclose(file) != 0)
        abort();
    if (cache_load(key, &binary) &&
        (binary.count != sizeof stored || memcmp(binary.items, stored, sizeof stored) != 0))
        abort();
    text_free(&binary);
}

static void baseline_fuzz(const char *path, const Source *source, MessageList *messages)
{
    (void)source;
    Baseline *baseline = baseline_open(path, messages);
    if (baseline) baseline_close(baseline);
}

static const struct {
    const char *name, *file;
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
    {"yaml", "a.yaml", yaml_fuzz},
    {"rt", "a.rt", rt_fuzz},
    {"cfg", "a.cfg", cfg_fuzz},
    {"nff", "a.nff", nff_fuzz},
    {"checkpoint", "a", checkpoint_fuzz},
    {"cache", "a", cache_fuzz},
    {"baseline", "a.json", baseline_fuzz},
};

static size_t reader;
static char path[PATH_MAX];

static void scratch_remove(void)
{
    unlink(path);
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

int LLVMFuzzerInitialize(int *argument_count, char ***arguments);
// NOLINTNEXTLINE(readability-non-const-parameter): libFuzzer's signature
int LLVMFuzzerInitialize(int *argument_count, char ***arguments)
{
    (void)argument_count;
    (void)arguments;
    const char *name = getenv("GLINT_FUZZ");
    const size_t count = sizeof readers / sizeof *readers;
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
    snprintf(path, sizeof path, "%s/%s", folder, readers[reader].file);
    setenv("XDG_CACHE_HOME", folder, 1);
    image_limit_pixels(1 << 16);
    atexit(scratch_remove);
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(bytes, 1, size, file) != size || fclose(file) != 0) exit(EXIT_MACHINE);
    // readers of text expect a NUL behind it, as text_read_file gives it
    Text text = {0};
    text_append(&text, (const char *)bytes, size);
    const Source source = {.file = path, .bytes = text_c(&text), .length = text.count};
    MessageList messages = {0};
    readers[reader].read(path, &source, &messages);
    message_list_free(&messages);
    text_free(&text);
    return 0;
}
