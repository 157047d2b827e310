#include "host/api/handles.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/import/number.h"
#include "host/scene/mesh.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static GlintStatus scene_return(GlintScene **scene, Scene *read, bool is_read, MessageList *list,
                                char **messages)
{
    *scene = NULL;
    if (is_read) {
        *scene = memory_allocate_zeroed(1, sizeof **scene);
        (*scene)->scene = *read;
    }
    return call_end(list, NULL, is_read ? GLINT_DONE : GLINT_WRONG_INPUT, messages);
}

static bool options_read(SceneOptions *options, const GlintSceneOptions *given, MessageList *messages)
{
    GlintSceneOptions read = {0};
    *options = (SceneOptions){.mesh_program = "glint"};
    if (given && !struct_read(&read, sizeof read, given, "GlintSceneOptions", messages)) return false;
    if (read.override_count > 0 && !read.overrides)
        return message_error(messages, "override_count is not 0, but overrides is NULL");
    for (size_t i = 0; i < read.override_count; i++)
        if (!read.overrides[i]) return message_error(messages, "overrides[%zu] is NULL", i);
    if (!isfinite(read.frame)) return message_error(messages, "the frame is not finite");
    options->overrides = read.overrides;
    options->override_name = "overrides";
    options->override_count = read.override_count;
    options->frame = read.frame;
    options->camera = read.camera;
    options->max_pixels = read.max_pixels;
    return true;
}

GlintStatus glint_scene_load(const char *path, const GlintSceneOptions *options, GlintScene **scene,
                             char **messages)
{
    MessageList list = {0};
    Scene read = {0};
    SceneOptions scene_options;
    const bool is_read =
        options_read(&scene_options, options, &list) && scene_load(&read, path, &scene_options, &list);
    return scene_return(scene, &read, is_read, &list, messages);
}

GlintStatus glint_scene_parse(const char *text, size_t length, const char *name,
                              const GlintSceneOptions *options, GlintScene **scene, char **messages)
{
    MessageList list = {0};
    Scene read = {0};
    SceneOptions scene_options;
    const Source source = {.file = name, .bytes = text, .length = length};
    bool is_read = options_read(&scene_options, options, &list);
    if (is_read && scene_options.camera)
        is_read = message_error(&list, "only glint_scene_load takes the camera of another scene");
    is_read = is_read && scene_read_yaml(&read, &source, &scene_options, &list);
    return scene_return(scene, &read, is_read, &list, messages);
}

// Copies vectors. Returns false with a message that starts with `noun` if one is not finite or too large.
static bool vectors_read(Vector3 *vectors, GlintReal real, const void *reals, size_t count, const char *noun,
                         MessageList *messages)
{
    numbers_widen((double *)vectors, reals, 3 * count, real == GLINT_FLOAT64);
    for (size_t i = 0; i < count; i++)
        if (!vector_is_within(vectors[i], NUMBER_MAX))
            return message_error(messages,
                                 "%s %zu is (%g, %g, %g); expected finite numbers of at most %g in size",
                                 noun, i, vectors[i].x, vectors[i].y, vectors[i].z, NUMBER_MAX);
    return true;
}

static bool mesh_is_sound(const GlintMesh *given, MessageList *messages)
{
    enum { TRIANGLES_MAX = 1 << 24 };
    if (!real_is_known(given->real, messages)) return false;
    if (given->triangle_count == 0 || given->triangle_count > TRIANGLES_MAX ||
        given->vertex_count > UINT32_MAX)
        return message_error(messages, "expected 1 to %d triangles and at most %u vertices, not %zu and %zu",
                             TRIANGLES_MAX, UINT32_MAX, given->triangle_count, given->vertex_count);
    if (!given->vertices || !given->triangles)
        return message_error(messages, "a mesh needs vertices and triangles");
    for (size_t i = 0; i < 3 * given->triangle_count; i++)
        if (given->triangles[i] >= given->vertex_count)
            return message_error(messages, "triangle %zu: there is no vertex %u of %zu", i / 3,
                                 given->triangles[i], given->vertex_count);
    return true;
}

GlintStatus glint_scene_of_mesh(const GlintMesh *mesh, GlintScene **scene, char **messages)
{
    MessageList list = {0};
    Scene read = {0};
    GlintMesh given;
    bool is_read =
        struct_read(&given, sizeof given, mesh, "GlintMesh", &list) && mesh_is_sound(&given, &list);
    if (is_read) {
        Mesh copy = {.vertex_count = given.vertex_count, .triangle_count = given.triangle_count};
        copy.vertices = memory_allocate(given.vertex_count, sizeof *copy.vertices);
        copy.triangles = memory_allocate(given.triangle_count, sizeof *copy.triangles);
        memcpy(copy.triangles, given.triangles, given.triangle_count * sizeof *copy.triangles);
        if (given.normals) copy.normals = memory_allocate(given.vertex_count, sizeof *copy.normals);
        is_read =
            vectors_read(copy.vertices, given.real, given.vertices, given.vertex_count, "vertex", &list) &&
            (!given.normals ||
             vectors_read(copy.normals, given.real, given.normals, given.vertex_count, "normal", &list));
        for (size_t i = 0; copy.normals && i < copy.vertex_count; i++)
            if (!vector_is_zero(copy.normals[i])) copy.normals[i] = vector_normalize(copy.normals[i]);
        if (is_read)
            scene_of_mesh(&read, &copy);
        else
            mesh_free(&copy);
    }
    return scene_return(scene, &read, is_read, &list, messages);
}

void glint_scene_free(GlintScene *scene)
{
    if (scene) scene_free(&scene->scene);
    free(scene);
}

size_t glint_scene_object_count(const GlintScene *scene)
{
    return scene_primitive_count(&scene->scene);
}

size_t glint_scene_light_count(const GlintScene *scene)
{
    return scene->scene.lights.count;
}

uint32_t glint_scene_frame_count(const GlintScene *scene)
{
    return scene->scene.animation.frame_count;
}

void glint_scene_image_size(const GlintScene *scene, uint32_t *width, uint32_t *height)
{
    *width = *height = 0;
    scene_choose_image_size(&scene->scene, width, height);
}
