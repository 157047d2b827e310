// Chooses a mesh's reader and adds the resulting mesh to the scene.
#include "host/import/mesh/mesh_import.h"
#include "host/base/array.h"
#include "host/base/file.h"
#include "host/import/mesh/assimp_process.h"

#include <string.h>
#include <strings.h>

static bool (*reader_of(const char *path))(MeshDraft *draft)
{
    static const struct {
        const char *ending;
        bool (*read)(MeshDraft *draft);
    } readers[] = {{".obj", obj_read},
                   {".ply", ply_read},
                   {".stl", stl_read},
                   {".gltf", gltf_read},
                   {".glb", gltf_read}};
    const char *ending = strrchr(path, '.');
    for (size_t i = 0; ending && i < COUNT_OF(readers); i++)
        if (!strcasecmp(ending, readers[i].ending)) return readers[i].read;
    return assimp_process_read;
}

bool mesh_is_known(const char *path)
{
    return reader_of(path) != assimp_process_read || assimp_knows(path);
}

// Reads the file, and frees its text before the draft becomes a mesh, which also needs memory.
static bool mesh_file_read(MeshDraft *draft, Mesh *mesh)
{
    bool (*read)(MeshDraft *) = reader_of(draft->import->path);
    OwnedText text = {0};
    const char *obstacle = file_obstacle(draft->import->path);
    if (obstacle) return draft_refuse(draft, "cannot read the file: %s", obstacle);
    if (read != assimp_process_read) {
        OwnedMessageList problems = {0};
        if (!text_read_file(&text, draft->import->path, &problems))
            return report_error(draft->import->report, draft->import->offset, "%s", problems.items[0].text);
        draft->source.bytes = text_c(&text);
        draft->source.length = text.count;
        stage_begin(draft->stage, "reading", draft->import->path, text.count);
    }
    if (!read(draft) || !draft_check(draft)) return false;
    text_free(&text);
    stage_begin(draft->stage, "joining the vertices of", draft->import->path, 0);
    draft_finish(draft, mesh);
    return true;
}

static void warn_of_triangles(MeshDraft *draft, const Mesh *mesh)
{
    const size_t degenerate_count = mesh_degenerate_count(mesh);
    if (degenerate_count > 0)
        draft_warn(draft, "%zu triangle%s no area and %s never hit", degenerate_count,
                   degenerate_count == 1 ? " has" : "s have", text_is_are(degenerate_count));
    if (draft->crossed_count > 0)
        draft_warn(draft, "%zu polygon%s far from planar; only parts are filled", draft->crossed_count,
                   draft->crossed_count == 1 ? " intersects itself or is" : "s intersect themselves or are");
}

// Bounds the triangles of all copies of mesh files that a scene names more than once, and so the cost of a
// hostile file.
enum { COPIED_TRIANGLES_MAX = 1 << 24 };

static bool copies_fit(MeshDraft *draft, Mesh *mesh)
{
    Scene *scene = draft->scene;
    mesh->file = file_id(draft->import->path);
    size_t i = scene->meshes.count;
    while (i > 0 && !file_is_same(scene->meshes.items[i - 1].file, mesh->file))
        i--;
    if (i == 0) return true;
    const size_t count = scene->copied_triangle_count + mesh->triangle_count;
    if (count > COPIED_TRIANGLES_MAX)
        return draft_refuse(draft, "copies of mesh files have %zu triangles in total; at most %d are allowed",
                            count, COPIED_TRIANGLES_MAX);
    scene->copied_triangle_count = count;
    return true;
}

bool mesh_import(Scene *scene, const MeshImport *import, uint32_t *index)
{
    MessageList messages = {0};
    MeshDraft draft = {.import = import,
                       .scene = scene,
                       .source = {.file = import->path, .bytes = ""},
                       .stage = import->options ? import->options->stage : NULL};
    stage_begin(draft.stage, "reading", import->path, 0);
    draft.report = report_open(&draft.source, &messages);
    Mesh mesh = {0};
    const bool read = mesh_file_read(&draft, &mesh) && copies_fit(&draft, &mesh);
    if (read) {
        mesh_join_vertices(&mesh);
        if (import->smoothing == SMOOTH_ALWAYS && !mesh.normals) mesh_make_normals(&mesh);
        warn_of_triangles(&draft, &mesh);
        *index = (uint32_t)scene->meshes.count;
        array_push(scene->meshes, mesh);
    }
    if (!read) mesh_free(&mesh);
    draft_free(&draft);
    report_include(import->report, &draft.report);
    return read;
}
