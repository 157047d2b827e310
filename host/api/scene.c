#include "host/api/handles.h"

#include "host/base/memory.h"
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
    GlintSceneOptions own = {0};
    *options = (SceneOptions){.mesh_program = "glint"};
    if (given && !struct_read(&own, sizeof own, given, "GlintSceneOptions", messages)) return false;
    if (own.override_count > 0 && !own.overrides)
        return message_error(messages, "override_count is not 0, but overrides is NULL");
    for (size_t i = 0; i < own.override_count; i++)
        if (!own.overrides[i]) return message_error(messages, "overrides[%zu] is NULL", i);
    if (!isfinite(own.frame)) return message_error(messages, "the frame is not finite");
    options->overrides = own.overrides;
    options->override_name = "overrides";
    options->override_count = own.override_count;
    options->frame = own.frame;
    options->camera = own.camera;
    options->max_pixels = own.max_pixels;
    return true;
}

GlintStatus glint_scene_load(const char *path, const GlintSceneOptions *options, GlintScene **scene,
                             char **messages)
{
    MessageList list = {0};
    Scene read = {0};
    SceneOptions own;
    const bool is_read = options_read(&own, options, &list) && scene_load(&read, path, &own, &list);
    return scene_return(scene, &read, is_read, &list, messages);
}

GlintStatus glint_scene_parse(const char *text, size_t length, const char *name,
                              const GlintSceneOptions *options, GlintScene **scene, char **messages)
{
    MessageList list = {0};
    Scene read = {0};
    SceneOptions own;
    const Source source = {.file = name, .bytes = text, .length = length};
    bool is_read = options_read(&own, options, &list);
    if (is_read && own.camera)
        is_read = message_error(&list, "only glint_scene_load takes the camera of another scene");
    is_read = is_read && scene_read_yaml(&read, &source, &own, &list);
    return scene_return(scene, &read, is_read, &list, messages);
}

// Copies vectors. Returns false with a message if one is not finite or is too far away.
static bool vectors_read(Vector3 *vectors, GlintReal real, const void *reals, size_t count,
                         MessageList *messages)
{
    for (size_t i = 0; i < count; i++) {
        vectors[i] = (Vector3){real_at(real, reals, 3 * i), real_at(real, reals, 3 * i + 1),
                               real_at(real, reals, 3 * i + 2)};
        if (!(fabs(vectors[i].x) <= NUMBER_MAX && fabs(vectors[i].y) <= NUMBER_MAX &&
              fabs(vectors[i].z) <= NUMBER_MAX))
            return message_error(messages, "vertex %zu: expected numbers up to %g", i, NUMBER_MAX);
    }
    return true;
}

static bool mesh_is_sound(const GlintMesh *given, MessageList *messages)
{
    enum { TRIANGLES_MAX = 1 << 24 };
    if (!real_is_known(given->real, messages)) return false;
    if (!given->vertices || !given->triangles || given->triangle_count == 0 ||
        given->triangle_count > TRIANGLES_MAX || given->vertex_count > UINT32_MAX)
        return message_error(messages, "expected 1 to %d triangles and at most %u vertices, not %zu and %zu",
                             TRIANGLES_MAX, UINT32_MAX, given->triangle_count, given->vertex_count);
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
        Mesh own = {.vertex_count = given.vertex_count, .triangle_count = given.triangle_count};
        own.vertices = memory_allocate(given.vertex_count, sizeof *own.vertices);
        own.triangles = memory_allocate(given.triangle_count, sizeof *own.triangles);
        memcpy(own.triangles, given.triangles, given.triangle_count * sizeof *own.triangles);
        if (given.normals) own.normals = memory_allocate(given.vertex_count, sizeof *own.normals);
        is_read = vectors_read(own.vertices, given.real, given.vertices, given.vertex_count, &list) &&
                  (!given.normals ||
                   vectors_read(own.normals, given.real, given.normals, given.vertex_count, &list));
        for (size_t i = 0; own.normals && i < own.vertex_count; i++)
            if (!vector_is_zero(own.normals[i])) own.normals[i] = vector_normalize(own.normals[i]);
        if (is_read)
            scene_of_mesh(&read, &own);
        else
            mesh_free(&own);
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
