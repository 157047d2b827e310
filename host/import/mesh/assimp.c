// Meshes by assimp, without its post-processing: joining vertices and generating normals there use absolute
// distances, which distorts small meshes; its triangulation reads missing vertices and drops parts of concave
// polygons.
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/import/mesh/affine.h"
#include "host/import/mesh/assimp_process.h"
#include "host/import/number.h"
#include "host/scene/polygon.h"

#include <assimp/cimport.h>
#include <assimp/scene.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    MeshDraft *draft;
    const struct aiScene *file;
    uint32_t *materials; // scene index of each of the file's materials; UINT32_MAX: not added yet
} Importer;

static Vector3 vector_of(const struct aiVector3D *v)
{
    return (Vector3){v->x, v->y, v->z};
}

static Affine affine_of_node(const struct aiMatrix4x4 *m)
{
    return (Affine){
        {{m->a1, m->a2, m->a3, m->a4}, {m->b1, m->b2, m->b3, m->b4}, {m->c1, m->c2, m->c3, m->c4}}};
}

static bool color_is_sound(const struct aiColor4D *color)
{
    return fabs(color->r) <= NUMBER_MAX && fabs(color->g) <= NUMBER_MAX && fabs(color->b) <= NUMBER_MAX;
}

static void warn_default(const Importer *importer, const struct aiMaterial *material, const char *what)
{
    struct aiString name = {0};
    aiGetMaterialString(material, AI_MATKEY_NAME, &name);
    draft_warn(importer->draft, "a %s of material '%.40s' is not finite or too large: using the default",
               what, name.data);
}

// Key, type and index: what assimp's AI_MATKEY_… expand to.
static Color color_of(const Importer *importer, const struct aiMaterial *material, const char *key,
                      unsigned type, unsigned index, Color otherwise)
{
    struct aiColor4D color;
    if (aiGetMaterialColor(material, key, type, index, &color) != aiReturn_SUCCESS) return otherwise;
    if (color_is_sound(&color)) return (Color){fmax(color.r, 0), fmax(color.g, 0), fmax(color.b, 0)};
    warn_default(importer, material, "color");
    return otherwise;
}

static double number_of(const Importer *importer, const struct aiMaterial *material, const char *key,
                        unsigned type, unsigned index, double otherwise)
{
    ai_real number;
    if (aiGetMaterialFloatArray(material, key, type, index, &number, NULL) != aiReturn_SUCCESS)
        return otherwise;
    if (fabs(number) <= NUMBER_MAX) return number >= 0 ? number : otherwise;
    warn_default(importer, material, "number");
    return otherwise;
}

// One warning for each texture of the material: meshes get theirs from the scene.
static void warn_of_textures(const Importer *importer, const struct aiMaterial *material, const char *name)
{
    struct aiString previous = {0};
    for (int type = aiTextureType_DIFFUSE; type <= AI_TEXTURE_TYPE_MAX; type++) {
        struct aiString path = {0};
        if (aiGetMaterialTextureCount(material, (enum aiTextureType)type) == 0) continue;
        aiGetMaterialTexture(material, (enum aiTextureType)type, 0, &path, NULL, NULL, NULL, NULL, NULL,
                             NULL);
        // assimp lists a glTF base color under two types
        if (strcmp(path.data, previous.data) == 0) continue;
        draft_warn(
            importer->draft,
            "the texture '%.100s' of material '%.40s' is not used: give the mesh a material with an image",
            path.data, name);
        previous = path;
    }
}

// glint's highlights have the light's color; only the strength of the file's specular color is kept.
static Material material_of(const Importer *importer, const struct aiMaterial *file_material)
{
    Material material = material_default();
    Color specular = color_of(importer, file_material, AI_MATKEY_COLOR_SPECULAR, (Color){0, 0, 0});
    material.color = color_of(importer, file_material, AI_MATKEY_COLOR_DIFFUSE, material.color);
    material.specular = (specular.x + specular.y + specular.z) / 3;
    material.shininess = number_of(importer, file_material, AI_MATKEY_SHININESS, material.shininess);
    material.transmission = fmax(0, 1 - number_of(importer, file_material, AI_MATKEY_OPACITY, 1));
    double ior = number_of(importer, file_material, AI_MATKEY_REFRACTI, 0);
    if (ior > 0) material.ior = ior;
    return material;
}

static uint32_t material_index(Importer *importer, unsigned index)
{
    uint32_t *known = &importer->materials[index];
    if (*known != UINT32_MAX) return *known;
    const struct aiMaterial *file_material = importer->file->mMaterials[index];
    struct aiString name = {0};
    aiGetMaterialString(file_material, AI_MATKEY_NAME, &name);
    Material material = material_default();
    // assimp's default where the file has none
    if (strcmp(name.data, AI_DEFAULT_MATERIAL_NAME) != 0) {
        material = material_of(importer, file_material);
        warn_of_textures(importer, file_material, name.data);
    }
    *known = scene_add_material(importer->draft->scene, &material, name.data);
    return *known;
}

static void vertices_add(MeshDraft *draft, const struct aiMesh *from, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    const struct aiVector3D *uvs = from->mTextureCoords[0];
    if (from->mNormals) draft_share_part(draft, DRAFT_NORMAL, draft->positions.count);
    if (uvs) draft_share_part(draft, DRAFT_UV, draft->positions.count);
    for (unsigned i = 0; i < from->mNumVertices; i++) {
        array_push(draft->positions, affine_point(affine, vector_of(&from->mVertices[i])));
        if (from->mNormals)
            array_push(draft->normals,
                       vector_normalize(affine_direction(&for_normals, vector_of(&from->mNormals[i]))));
        if (uvs) draft_add_uv(draft, uvs[i].x, uvs[i].y);
    }
}

// Tested before the node's transform, whose rounding could give a degenerate triangle an area.
static bool face_has_area(const struct aiMesh *mesh, const struct aiFace *face)
{
    if (face->mNumIndices != 3) return true;
    const Vector3 a = vector_of(&mesh->mVertices[face->mIndices[0]]),
                  b = vector_of(&mesh->mVertices[face->mIndices[1]]),
                  c = vector_of(&mesh->mVertices[face->mIndices[2]]);
    return triangle_has_area(a, b, c);
}

static bool face_add(MeshDraft *draft, const struct aiMesh *from, const struct aiFace *face, size_t first,
                     bool mirrored)
{
    const unsigned count = face->mNumIndices;
    for (unsigned i = 0; i < count; i++)
        if (face->mIndices[i] >= from->mNumVertices)
            return draft_refuse(draft, "a face names vertex %u (from 0); there are %u", face->mIndices[i],
                                from->mNumVertices);
    const bool has_area = face_has_area(from, face);
    for (unsigned i = 0; i < count; i++) {
        const unsigned index = face->mIndices[!has_area ? 0 : mirrored ? (count - i) % count : i];
        array_push(draft->corners[DRAFT_POSITION], (uint32_t)(first + index));
    }
    return draft_end_face(draft, 0);
}

static bool mesh_add(Importer *importer, const struct aiMesh *from, const Affine *affine)
{
    MeshDraft *draft = importer->draft;
    const size_t first = draft->positions.count;
    if (first + from->mNumVertices >= DRAFT_NONE) return draft_refuse(draft, "too many vertices");
    if (importer->materials && from->mMaterialIndex >= importer->file->mNumMaterials)
        return draft_refuse(draft, "material %u (from 0) is not there", from->mMaterialIndex);
    if (importer->materials)
        array_push(draft->materials,
                   ((DraftMaterialRun){draft->face_start, material_index(importer, from->mMaterialIndex)}));
    vertices_add(draft, from, affine);
    const bool mirrored = affine_determinant(affine) < 0;
    for (unsigned i = 0; i < from->mNumFaces; i++)
        if (!face_add(draft, from, &from->mFaces[i], first, mirrored)) return false;
    return true;
}

static bool node_add(Importer *importer, const struct aiNode *node, const Affine *parent)
{
    const Affine own = affine_of_node(&node->mTransformation), affine = affine_multiply(parent, &own);
    for (unsigned i = 0; i < node->mNumMeshes; i++)
        if (node->mMeshes[i] < importer->file->mNumMeshes &&
            !mesh_add(importer, importer->file->mMeshes[node->mMeshes[i]], &affine))
            return false;
    for (unsigned i = 0; i < node->mNumChildren; i++)
        if (!node_add(importer, node->mChildren[i], &affine)) return false;
    return true;
}

static bool file_add(Importer *importer)
{
    static const Affine identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    const size_t material_count = importer->file->mNumMaterials;
    if (importer->draft->import->own_materials) {
        importer->materials = memory_allocate(material_count + 1, sizeof *importer->materials);
        memset(importer->materials, 0xff, material_count * sizeof *importer->materials);
    }
    const bool added = !importer->file->mRootNode || node_add(importer, importer->file->mRootNode, &identity);
    free(importer->materials);
    for (DraftPart part = DRAFT_UV; part <= DRAFT_NORMAL; part++)
        if (importer->draft->is_shared[part])
            draft_share_part(importer->draft, part, importer->draft->positions.count);
    return added;
}

bool assimp_knows(const char *path)
{
    const char *ending = strrchr(path, '.');
    return ending && aiIsExtensionSupported(ending);
}

bool assimp_read(MeshDraft *draft)
{
    const char *path = draft->import->path;
    if (!assimp_knows(path))
        return draft_refuse(draft,
                            "no mesh that is known by its ending: .obj, .ply, .stl, .gltf, .fbx, .dae, …");
    Importer importer = {.draft = draft, .file = aiImportFile(path, 0)};
    if (!importer.file) {
        const char *error = aiGetErrorString();
        if (strstr(error, "bad_alloc")) exit(EXIT_MACHINE);
        return draft_refuse(draft, "%.*s", (int)strcspn(error, "\r\n"), error);
    }
    const bool added = file_add(&importer);
    aiReleaseImport(importer.file);
    return added;
}
