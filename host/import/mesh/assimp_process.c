#include "host/import/mesh/assimp_process.h"
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/import/number.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { REPLY_DESCRIPTOR = 3, MESSAGES_MAX = 64, MATERIALS_MAX = 1 << 20, LIGHTS_MAX = 1 << 16 };

static const char command[] = "--read-mesh";
static const char magic[8] = "glntmsh";

typedef struct {
    char magic[8];
    uint64_t is_read, message_count, texture_count, material_count, has_normals, has_uvs;
    uint64_t has_camera, light_count;
    Camera camera;
    uint64_t counts[6]; // of the arrays
} ReplyHeader;

// Describes a texture. The bytes of an image embedded in the file follow.
typedef struct {
    char path[1024];
    uint64_t byte_count;
} ReplyTexture;

typedef struct {
    uint64_t is_error;
    char text[512];
} ReplyMessage;

// A material, whose image is 1 + the index of a texture of the reply.
typedef struct {
    Material look;
    char name[64];
} ReplyMaterial;

typedef struct {
    void **items;
    size_t *count, *capacity, size;
} ReplyArray;

#define REPLY_ARRAY(array)                                                                                   \
    {                                                                                                        \
        (void **)&(array).items, &(array).count, &(array).capacity, sizeof *(array).items                    \
    }

typedef struct {
    ReplyArray items[6];
} ReplyArrays;

static ReplyArrays arrays_of(MeshDraft *draft)
{
    return (ReplyArrays){{REPLY_ARRAY(draft->positions), REPLY_ARRAY(draft->normals), REPLY_ARRAY(draft->uvs),
                          REPLY_ARRAY(draft->corners[DRAFT_POSITION]), REPLY_ARRAY(draft->polygons),
                          REPLY_ARRAY(draft->materials)}};
}

static void limit(__rlimit_resource_t resource, rlim_t most)
{
    struct rlimit now;
    if (getrlimit(resource, &now) != 0 || now.rlim_cur <= most) return;
    now.rlim_cur = most;
    setrlimit(resource, &now);
}

void assimp_process_limit(void)
{
#ifndef __SANITIZE_ADDRESS__ // its shadow memory exceeds the limit
    limit(RLIMIT_AS, (rlim_t)ASSIMP_MEBIBYTES_MAX << 20);
#endif
    limit(RLIMIT_CPU, ASSIMP_PROCESSOR_SECONDS_MAX);
    limit(RLIMIT_CORE, 0);
    alarm(ASSIMP_SECONDS_MAX);
    // a terminal also signals the parent, which ends this process when it ends
    signal(SIGINT, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
}

static void messages_write(FILE *reply, const MessageList *messages)
{
    for (size_t i = 0; i < messages->count; i++) {
        ReplyMessage message = {.is_error = messages->items[i].severity == MESSAGE_ERROR};
        snprintf(message.text, sizeof message.text, "%s", messages->items[i].text);
        fwrite(&message, sizeof message, 1, reply);
    }
}

static void textures_write(FILE *reply, const Scene *scene)
{
    for (size_t i = 0; i < scene->textures.count; i++) {
        const SceneTexture *from = &scene->textures.items[i];
        ReplyTexture texture = {.byte_count = from->bytes.count};
        snprintf(texture.path, sizeof texture.path, "%s", from->path);
        fwrite(&texture, sizeof texture, 1, reply);
        fwrite(text_c(&from->bytes), 1, from->bytes.count, reply);
    }
}

static void materials_write(FILE *reply, const Scene *scene)
{
    for (size_t i = 0; i < scene->materials.count; i++) {
        ReplyMaterial material = {.look = scene->materials.items[i]};
        snprintf(material.name, sizeof material.name, "%s", scene->material_names.items[i]);
        fwrite(&material, sizeof material, 1, reply);
    }
}

static void reply_write(FILE *reply, MeshDraft *draft, bool is_read)
{
    ReplyHeader header = {.is_read = is_read,
                          .message_count = draft->import->report->messages->count,
                          .texture_count = draft->scene->textures.count,
                          .material_count = draft->scene->materials.count,
                          .has_normals = draft->is_shared[DRAFT_NORMAL],
                          .has_uvs = draft->is_shared[DRAFT_UV]};
    const ReplyArrays arrays = arrays_of(draft);
    const MeshView *view = draft->import->view;
    if (view) {
        header.has_camera = view->has_camera;
        header.camera = view->camera;
        header.light_count = view->lights.count;
    }
    memcpy(header.magic, magic, sizeof magic);
    for (size_t i = 0; i < 6; i++)
        header.counts[i] = is_read ? *arrays.items[i].count : 0;
    fwrite(&header, sizeof header, 1, reply);
    messages_write(reply, draft->import->report->messages);
    textures_write(reply, draft->scene);
    materials_write(reply, draft->scene);
    if (header.light_count > 0)
        fwrite(view->lights.items, sizeof *view->lights.items, view->lights.count, reply);
    for (size_t i = 0; i < 6; i++)
        if (header.counts[i] > 0)
            fwrite(*arrays.items[i].items, arrays.items[i].size, *arrays.items[i].count, reply);
    fwrite(magic, sizeof magic, 1, reply);
}

int assimp_process_main(int argument_count, char **arguments)
{
    if (argument_count != 4 || strcmp(arguments[1], command) != 0) return -1;
    assimp_process_limit();
    FILE *reply = fdopen(REPLY_DESCRIPTOR, "wb");
    if (!reply) return EXIT_FAILURE;
    MessageList messages = {0};
    const Source source = {.file = arguments[2], .bytes = ""};
    Report report = report_open(&source, &messages);
    Scene scene = {0};
    MeshView view = {0};
    const bool is_scene = strcmp(arguments[3], "scene") == 0;
    const MeshImport import = {.path = arguments[2],
                               .own_materials = is_scene || strcmp(arguments[3], "own") == 0,
                               .view = is_scene ? &view : NULL,
                               .report = &report,
                               .offset = MESSAGE_WHOLE_FILE};
    MeshDraft draft = {.import = &import, .scene = &scene, .source = source, .places = DRAFT_NO_PLACES};
    const bool is_read = assimp_read(&draft);
    report_close(&report);
    reply_write(reply, &draft, is_read);
    // assimp's destructors are not needed
    _exit(fflush(reply) == 0 ? EXIT_SUCCESS : EXIT_FAILURE);
}

static bool messages_read(MeshDraft *draft, FILE *reply, uint64_t count)
{
    if (count > MESSAGES_MAX) return false;
    for (uint64_t i = 0; i < count; i++) {
        ReplyMessage message;
        if (fread(&message, sizeof message, 1, reply) != 1) return false;
        message.text[sizeof message.text - 1] = '\0';
        if (message.is_error)
            draft_refuse(draft, "%s", message.text);
        else
            draft_warn(draft, "%s", message.text);
    }
    return true;
}

static bool number_is_sound(double number)
{
    return number >= 0 && number <= NUMBER_MAX;
}

// Sets `textures` to the scene's index of each texture. Memory grows only with the bytes that arrive.
static bool textures_read(MeshDraft *draft, FILE *reply, uint64_t count,
                          uint32_t textures[SCENE_TEXTURES_MAX])
{
    if (count > SCENE_TEXTURES_MAX) return false;
    for (uint64_t i = 0; i < count; i++) {
        ReplyTexture from;
        Text bytes = {0};
        if (fread(&from, sizeof from, 1, reply) != 1) return false;
        from.path[sizeof from.path - 1] = '\0';
        char chunk[1 << 12];
        while (bytes.count < from.byte_count) {
            const uint64_t left = from.byte_count - bytes.count;
            const size_t length = fread(chunk, 1, left < sizeof chunk ? (size_t)left : sizeof chunk, reply);
            text_append(&bytes, chunk, length);
            if (length == 0) break;
        }
        const bool is_whole = bytes.count == from.byte_count;
        char owner[32];
        snprintf(owner, sizeof owner, "image %u", (unsigned)i);
        if (is_whole && bytes.count > 0)
            textures[i] = draft_add_embedded_texture(
                draft, &(Source){.bytes = bytes.items, .length = bytes.count}, TEXTURE_COLORS, owner);
        else if (is_whole)
            textures[i] = draft_add_texture(draft, from.path, TEXTURE_COLORS, owner);
        text_free(&bytes);
        if (!is_whole) return false;
    }
    return true;
}

// Copies the members of a material that assimp_read sets. Returns false if one is out of range.
static bool material_copy(const Material *from, const uint32_t *textures, uint64_t texture_count,
                          Material *material)
{
    const uint32_t texture = from->image.texture;
    if (!color_is_sound(from->color) || !color_is_sound(from->diffuse) || !color_is_sound(from->emission) ||
        !number_is_sound(from->ambient) || !number_is_sound(from->specular.largest) ||
        !number_is_sound(from->shininess) || !range_holds(&range_unit, from->transmission.largest) ||
        !(from->ior > 0 && from->ior <= NUMBER_MAX) || texture > texture_count ||
        from->image.wraps[0] > TEXTURE_MIRRORED || from->image.wraps[1] > TEXTURE_MIRRORED)
        return false;
    *material = material_default();
    material->color = from->color;
    material->ambient = from->ambient;
    material->diffuse = from->diffuse;
    material->specular.largest = from->specular.largest;
    material->shininess = from->shininess;
    material->transmission.largest = from->transmission.largest;
    material->emission = from->emission;
    material->ior = from->ior;
    memcpy(material->image.wraps, from->image.wraps, sizeof from->image.wraps);
    material->image.texture = texture > 0 ? textures[texture - 1] : 0;
    return true;
}

static bool materials_read(MeshDraft *draft, FILE *reply, uint64_t count, const uint32_t *textures,
                           uint64_t texture_count)
{
    if (count > MATERIALS_MAX) return false;
    for (uint64_t i = 0; i < count; i++) {
        ReplyMaterial from;
        Material material;
        if (fread(&from, sizeof from, 1, reply) != 1 ||
            !material_copy(&from.look, textures, texture_count, &material))
            return false;
        from.name[sizeof from.name - 1] = '\0';
        scene_add_material(draft->scene, &material, from.name);
    }
    return true;
}

// Reads the camera and the lights, whose values mesh_scene.c checks.
static bool view_read(MeshDraft *draft, FILE *reply, const ReplyHeader *header)
{
    MeshView *view = draft->import->view;
    if (header->light_count > LIGHTS_MAX || (!view && (header->light_count > 0 || header->has_camera)))
        return false;
    for (uint64_t i = 0; i < header->light_count; i++) {
        Light light;
        if (fread(&light, sizeof light, 1, reply) != 1) return false;
        array_push(view->lights, light);
    }
    if (header->has_camera) {
        view->has_camera = true;
        view->camera = header->camera;
    }
    return true;
}

// Reads the arrays. Memory grows only with the bytes that arrive.
static bool arrays_read(MeshDraft *draft, FILE *reply, const uint64_t counts[6])
{
    enum { CHUNK = 1 << 16 };
    const ReplyArrays arrays = arrays_of(draft);
    for (size_t i = 0; i < 6; i++) {
        const ReplyArray *array = &arrays.items[i];
        while (*array->count < counts[i]) {
            const uint64_t left = counts[i] - *array->count;
            const size_t count = left < CHUNK ? (size_t)left : CHUNK;
            if (*array->count + count > *array->capacity)
                *array->items =
                    array_grow(*array->items, array->capacity, *array->count + count, array->size);
            if (fread((char *)*array->items + *array->count * array->size, array->size, count, reply) !=
                count)
                return false;
            *array->count += count;
        }
    }
    return true;
}

// Returns whether the polygons are in order, within the corners, and separated by whole triangles.
static bool polygons_are_sound(const MeshDraft *draft)
{
    const size_t corner_count = draft->corners[DRAFT_POSITION].count;
    size_t at = 0;
    for (size_t i = 0; i < draft->polygons.count; i++) {
        const DraftPolygon *polygon = &draft->polygons.items[i];
        if (polygon->first_corner < at || polygon->first_corner > corner_count ||
            (polygon->first_corner - at) % 3 > 0 || polygon->corner_count < 4 ||
            polygon->corner_count > DRAFT_POLYGON_MAX ||
            polygon->corner_count > corner_count - polygon->first_corner)
            return false;
        at = polygon->first_corner + polygon->corner_count;
    }
    return (corner_count - at) % 3 == 0;
}

static bool runs_are_sound(MeshDraft *draft, uint64_t material_count)
{
    const uint32_t first_material = (uint32_t)(draft->scene->materials.count - material_count);
    size_t at = 0;
    for (size_t i = 0; i < draft->materials.count; i++) {
        DraftMaterialRun *run = &draft->materials.items[i];
        if ((i == 0 && run->first_corner > 0) || run->first_corner < at ||
            run->first_corner > draft->corners[DRAFT_POSITION].count || run->material >= material_count)
            return false;
        at = run->first_corner;
        run->material += first_material;
    }
    return true;
}

static bool draft_is_sound(MeshDraft *draft, const ReplyHeader *header)
{
    const size_t position_count = draft->positions.count;
    if (position_count >= DRAFT_NONE || draft->normals.count != (header->has_normals ? position_count : 0) ||
        draft->uvs.count != (header->has_uvs ? position_count : 0))
        return false;
    draft->is_shared[DRAFT_NORMAL] = header->has_normals != 0;
    draft->is_shared[DRAFT_UV] = header->has_uvs != 0;
    const DraftIndices *corners = &draft->corners[DRAFT_POSITION];
    for (size_t i = 0; i < corners->count; i++)
        if (corners->items[i] >= position_count) return false;
    return polygons_are_sound(draft) && runs_are_sound(draft, header->material_count);
}

bool assimp_reply_read(MeshDraft *draft, FILE *reply, bool *read)
{
    ReplyHeader header;
    char end[sizeof magic];
    uint32_t textures[SCENE_TEXTURES_MAX];
    if (fread(&header, sizeof header, 1, reply) != 1 || memcmp(header.magic, magic, sizeof magic) != 0 ||
        !messages_read(draft, reply, header.message_count) ||
        !textures_read(draft, reply, header.texture_count, textures) ||
        !materials_read(draft, reply, header.material_count, textures, header.texture_count) ||
        !view_read(draft, reply, &header) || !arrays_read(draft, reply, header.counts) ||
        fread(end, sizeof end, 1, reply) != 1 || memcmp(end, magic, sizeof magic) != 0 ||
        !draft_is_sound(draft, &header))
        return false;
    *read = header.is_read != 0;
    return true;
}

// Starts the process. Returns 0 and sets *reply to the reading end of the pipe, or returns an errno value.
static int child_start(const MeshDraft *draft, pid_t *process, int *reply)
{
    char *arguments[] = {"glint", (char *)command, (char *)draft->import->path,
                         draft->import->view            ? "scene"
                         : draft->import->own_materials ? "own"
                                                        : "none",
                         NULL};
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return errno;
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    // glint ignores the first two; who started it may ignore the others, which end this process in time
    static const int ending[] = {SIGPIPE, SIGXFSZ, SIGXCPU, SIGALRM};
    sigset_t none, defaults;
    sigemptyset(&none);
    sigemptyset(&defaults);
    for (size_t i = 0; i < COUNT_OF(ending); i++)
        sigaddset(&defaults, ending[i]);
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    // first, because the pipe may have a standard descriptor that was closed
    posix_spawn_file_actions_adddup2(&actions, ends[1], REPLY_DESCRIPTOR);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    const SceneOptions *options = draft->import->options;
    const char *program = options && options->mesh_program ? options->mesh_program : "/proc/self/exe";
    const int error = posix_spawnp(process, program, &actions, &attributes, arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (error != 0)
        close(ends[0]);
    else
        *reply = ends[0];
    return error;
}

static bool child_fails(MeshDraft *draft, int status)
{
    const int by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (by == SIGXCPU)
        return draft_refuse(draft, "assimp needs more than %d s of processor time to read it",
                            ASSIMP_PROCESSOR_SECONDS_MAX);
    if (by == SIGALRM)
        return draft_refuse(draft, "assimp needs more than %d s to read it", ASSIMP_SECONDS_MAX);
    if (WIFEXITED(status) && WEXITSTATUS(status) == EXIT_MACHINE)
        return draft_refuse(draft, "assimp needs more than %d MiB to read it", ASSIMP_MEBIBYTES_MAX);
    return draft_refuse(draft, "assimp %s on it", by != 0 ? "crashes" : "fails");
}

bool assimp_process_read(MeshDraft *draft)
{
    draft->places = DRAFT_NO_PLACES;
    pid_t process = -1;
    int descriptor = -1, status = 0;
    const int error = child_start(draft, &process, &descriptor);
    if (error != 0) return draft_refuse(draft, "no process to read it in: %s", strerror(error));
    FILE *reply = fdopen(descriptor, "rb");
    bool read = false;
    const bool is_whole = reply && assimp_reply_read(draft, reply, &read);
    if (reply)
        fclose(reply);
    else
        close(descriptor);
    while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    return is_whole ? read : child_fails(draft, status);
}
