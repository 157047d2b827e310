// Reads meshes through assimp without its post-processing. Its vertex joining and normal generation use
// absolute distances, which distorts small meshes. Its triangulation reads missing vertices and drops parts
// of concave polygons.
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/import/mesh/assimp_process.h"
#include "host/import/number.h"
#include "host/scene/affine.h"
#include "host/scene/polygon.h"
#include "host/scene/portable.h"

#include <assimp/cimport.h>
#include <assimp/scene.h>
#include <stdlib.h>
#include <string.h>

// A material of the file. Only meshes that have its set of texture coordinates show its texture.
typedef struct {
    uint32_t scene_index[2]; // without and with the texture; DRAFT_NONE: not added yet
    uint32_t texture;        // of the scene; 0: none
    unsigned uv_set;
    struct aiUVTransform uv_transform;
} ImportedMaterial;

typedef struct {
    MeshDraft *draft;
    const struct aiScene *file;
    ImportedMaterial *materials;       // one for each of the file's; NULL: not used
    const struct aiMaterial *material; // of the file, which is being converted
} Importer;

static const char *file_name(const char *path)
{
    const char *slash = strrchr(path, '/'), *backslash = strrchr(slash ? slash : path, '\\');
    return backslash ? backslash + 1 : slash ? slash + 1 : path;
}

static Vector3 vector_of(const struct aiVector3D *v)
{
    return (Vector3){v->x, v->y, v->z};
}

static Affine affine_of_node(const struct aiMatrix4x4 *m)
{
    return (Affine){
        {{m->a1, m->a2, m->a3, m->a4}, {m->b1, m->b2, m->b3, m->b4}, {m->c1, m->c2, m->c3, m->c4}}};
}

static void warn_default(const Importer *importer, const char *what)
{
    struct aiString name = {0};
    aiGetMaterialString(importer->material, AI_MATKEY_NAME, &name);
    draft_warn(importer->draft, "a %s of material '%.40s' is out of range; the default is used", what,
               name.data);
}

// Returns the material's color, or `otherwise`. assimp's AI_MATKEY_… macros expand to key, type and index.
static Color color_of(const Importer *importer, const char *key, unsigned type, unsigned index,
                      Color otherwise)
{
    struct aiColor4D color;
    if (aiGetMaterialColor(importer->material, key, type, index, &color) != aiReturn_SUCCESS)
        return otherwise;
    const Color read = {color.r, color.g, color.b};
    if (numbers_are_sound(read)) return read;
    warn_default(importer, "color");
    return otherwise;
}

static double number_of(const Importer *importer, const char *key, unsigned type, unsigned index,
                        double largest, double otherwise)
{
    ai_real number;
    if (aiGetMaterialFloatArray(importer->material, key, type, index, &number, NULL) != aiReturn_SUCCESS)
        return otherwise;
    if (number >= 0 && number <= largest) return number;
    warn_default(importer, "number");
    return otherwise;
}

// Returns the image embedded in the file under the name, or NULL.
static const struct aiTexture *embedded_texture(const struct aiScene *file, const char *name)
{
    if (name[0] == '*') {
        const unsigned long index = strtoul(name + 1, NULL, 10);
        return index < file->mNumTextures ? file->mTextures[index] : NULL;
    }
    for (unsigned i = 0; i < file->mNumTextures; i++)
        if (strcmp(file_name(file->mTextures[i]->mFilename.data), file_name(name)) == 0)
            return file->mTextures[i];
    return NULL;
}

static uint32_t assimp_texture_add(const Importer *importer, const char *name, const char *owner)
{
    MeshDraft *draft = importer->draft;
    const struct aiTexture *embedded = embedded_texture(importer->file, name);
    if (embedded) {
        // glint reads only compressed images
        const Source bytes = {.bytes = (const char *)embedded->pcData,
                              .length = embedded->mHeight == 0 ? embedded->mWidth : 0};
        return draft_add_embedded_texture(draft, &bytes, TEXTURE_COLORS, name);
    }
    bool is_moved;
    OWNED char *path = draft_find_file(draft->import->path, name, strlen(name), &is_moved);
    const uint32_t texture = draft_add_texture(draft, path, TEXTURE_COLORS, owner);
    if (is_moved && texture > 0) draft_warn(draft, "%s: " DRAFT_MOVED_FILE, owner, 100, name, path);
    return texture;
}

static TextureWrap wrap_of(enum aiTextureMapMode mode)
{
    return mode == aiTextureMapMode_Clamp    ? TEXTURE_CLAMPED
           : mode == aiTextureMapMode_Mirror ? TEXTURE_MIRRORED
                                             : TEXTURE_REPEATED;
}

// Reads the color texture and warns about all other textures.
static void textures_read(Importer *importer, const struct aiMaterial *from, const char *name,
                          ImportedMaterial *to, TextureWrap wraps[2])
{
    const enum aiTextureType color = aiGetMaterialTextureCount(from, aiTextureType_BASE_COLOR) > 0
                                         ? aiTextureType_BASE_COLOR
                                         : aiTextureType_DIFFUSE;
    for (int type = aiTextureType_DIFFUSE; type <= AI_TEXTURE_TYPE_MAX; type++)
        if (type != aiTextureType_BASE_COLOR && type != aiTextureType_DIFFUSE &&
            aiGetMaterialTextureCount(from, (enum aiTextureType)type) > 0)
            draft_warn(importer->draft, "all textures except those of the color are ignored");
    if (aiGetMaterialTextureCount(from, color) == 0) return;
    struct aiString path = {0};
    enum aiTextureMapMode modes[2] = {aiTextureMapMode_Wrap, aiTextureMapMode_Wrap};
    to->uv_transform = (struct aiUVTransform){.mScaling = {1, 1}};
    if (aiGetMaterialTexture(from, color, 0, &path, NULL, &to->uv_set, NULL, NULL, modes, NULL) !=
        aiReturn_SUCCESS)
        return;
    aiGetMaterialUVTransform(from, AI_MATKEY_UVTRANSFORM(color, 0), &to->uv_transform);
    if (to->uv_transform.mRotation != 0) draft_warn(importer->draft, "rotations of textures are ignored");
    if (to->uv_set >= AI_MAX_NUMBER_OF_TEXTURECOORDS) to->uv_set = 0;
    wraps[0] = wrap_of(modes[0]);
    wraps[1] = wrap_of(modes[1]);
    to->texture = assimp_texture_add(importer, path.data, name);
}

// Converts a material. Keeps only its specular strength, because glint's highlights have the light's color.
static Material material_convert(const Importer *importer)
{
    Material material = material_default();
    const Color specular = color_of(importer, AI_MATKEY_COLOR_SPECULAR, (Color){0, 0, 0});
    material.emission = color_of(importer, AI_MATKEY_COLOR_EMISSIVE, (Color){0, 0, 0});
    material.color = color_of(importer, AI_MATKEY_COLOR_DIFFUSE, material.color);
    // assimp sets a specular color even for Lambertian materials, which have none
    int shading = aiShadingMode_Phong;
    aiGetMaterialIntegerArray(importer->material, AI_MATKEY_SHADING_MODEL, &shading, NULL);
    if (shading != aiShadingMode_Gouraud) material.specular.largest = vector_mean(specular);
    material.shininess = number_of(importer, AI_MATKEY_SHININESS, NUMBER_MAX, material.shininess);
    if (importer->draft->import->view) material.ambient = 0;
    const double opacity = number_of(importer, AI_MATKEY_OPACITY, 1, 1),
                 ior = number_of(importer, AI_MATKEY_REFRACTI, NUMBER_MAX, 0);
    if (opacity < 1) material_set_opacity(&material, opacity);
    if (opacity < 1 && ior > 0) material.ior = ior;
    return material;
}

// Adds the material twice, without and with its texture, which is multiplied by the diffuse color.
static void material_add(Importer *importer, const struct aiMaterial *from, ImportedMaterial *to)
{
    struct aiString name = {0};
    aiGetMaterialString(from, AI_MATKEY_NAME, &name);
    importer->material = from;
    Material material = material_default();
    TextureWrap wraps[2] = {TEXTURE_REPEATED, TEXTURE_REPEATED};
    // assimp's default where the file has none
    if (strcmp(name.data, AI_DEFAULT_MATERIAL_NAME) != 0) {
        material = material_convert(importer);
        textures_read(importer, from, name.data, to, wraps);
    } else if (importer->draft->import->view) {
        material.ambient = 0;
    }
    Scene *scene = importer->draft->scene;
    to->scene_index[0] = to->scene_index[1] = scene_add_material(scene, &material, name.data);
    if (to->texture == 0) return;
    const Color color = material.color;
    material.image.texture = to->texture;
    memcpy(material.image.wraps, wraps, sizeof wraps);
    material.diffuse = vector_multiply(material.diffuse, color);
    material.ambient *= importer->draft->import->view ? 0 : vector_mean(color);
    to->scene_index[1] = scene_add_material(scene, &material, name.data);
}

static ImportedMaterial *imported_material(Importer *importer, unsigned index)
{
    ImportedMaterial *material = &importer->materials[index];
    if (material->scene_index[0] == DRAFT_NONE)
        material_add(importer, importer->file->mMaterials[index], material);
    return material;
}

static void assimp_vertices_add(MeshDraft *draft, const struct aiMesh *from, const Affine *affine,
                                const ImportedMaterial *material)
{
    const Affine for_normals = affine_for_normals(affine);
    const struct aiVector3D *uvs = from->mTextureCoords[material ? material->uv_set : 0];
    struct aiUVTransform change = {.mScaling = {1, 1}};
    if (material && material->texture > 0) change = material->uv_transform;
    if (from->mNormals) draft_share_part(draft, DRAFT_NORMAL);
    if (uvs) draft_share_part(draft, DRAFT_UV);
    for (unsigned i = 0; i < from->mNumVertices; i++) {
        array_push(draft->positions, affine_point(affine, vector_of(&from->mVertices[i])));
        if (from->mNormals)
            array_push(draft->normals,
                       vector_normalize(affine_direction(&for_normals, vector_of(&from->mNormals[i]))));
        if (uvs)
            draft_add_uv(draft, (double)uvs[i].x * change.mScaling.x + change.mTranslation.x,
                         (double)uvs[i].y * change.mScaling.y + change.mTranslation.y);
    }
}

// Returns false for a triangle without an area before the node's transform, whose rounding could create one.
static bool face_has_area(const struct aiMesh *mesh, const struct aiFace *face)
{
    if (face->mNumIndices != 3) return true;
    const Vector3 a = vector_of(&mesh->mVertices[face->mIndices[0]]),
                  b = vector_of(&mesh->mVertices[face->mIndices[1]]),
                  c = vector_of(&mesh->mVertices[face->mIndices[2]]);
    return triangle_has_area(a, b, c);
}

static bool assimp_face_add(MeshDraft *draft, const struct aiMesh *from, const struct aiFace *face,
                            size_t first, bool mirrored)
{
    const unsigned count = face->mNumIndices;
    for (unsigned i = 0; i < count; i++)
        if (face->mIndices[i] >= from->mNumVertices)
            return draft_refuse(draft, "a face names vertex %u (counted from 0), but its mesh has only %u",
                                face->mIndices[i], from->mNumVertices);
    const bool has_area = face_has_area(from, face);
    for (unsigned i = 0; i < count; i++) {
        const unsigned index = face->mIndices[!has_area ? 0 : mirrored ? (count - i) % count : i];
        array_push(draft->corners[DRAFT_POSITION], (uint32_t)(first + index));
    }
    return draft_end_face(draft, 0);
}

static bool assimp_mesh_add(Importer *importer, const struct aiMesh *from, const Affine *affine)
{
    MeshDraft *draft = importer->draft;
    const size_t first = draft->positions.count;
    if (first + from->mNumVertices > DRAFT_VERTICES_MAX) return draft_refuse_vertices(draft);
    if (importer->materials && from->mMaterialIndex >= importer->file->mNumMaterials)
        return draft_refuse(draft, "a mesh names material %u (counted from 0), but the file has only %u",
                            from->mMaterialIndex, importer->file->mNumMaterials);
    const ImportedMaterial *material =
        importer->materials ? imported_material(importer, from->mMaterialIndex) : NULL;
    if (material) {
        const bool is_textured = material->texture > 0 && from->mTextureCoords[material->uv_set];
        if (material->texture > 0 && !is_textured) draft_warn(importer->draft, "%s", draft_no_uvs);
        array_push(draft->materials,
                   ((DraftMaterialRun){draft->face_start, material->scene_index[is_textured]}));
    }
    if (from->mNumBones > 0) draft_warn(importer->draft, "%s", draft_skins);
    if (from->mNumAnimMeshes > 0) draft_warn(importer->draft, "%s", draft_morphs);
    if (from->mColors[0]) draft_warn(importer->draft, "%s", draft_colors);
    assimp_vertices_add(draft, from, affine, material);
    const bool mirrored = affine_determinant(affine) < 0;
    for (unsigned i = 0; i < from->mNumFaces; i++)
        if (!assimp_face_add(draft, from, &from->mFaces[i], first, mirrored)) return false;
    return true;
}

// Adds the cameras and lights that have the node's name. They lie in the node's space.
static void assimp_view_add(Importer *importer, const struct aiNode *node, const Affine *affine)
{
    const struct aiScene *file = importer->file;
    MeshView *view = importer->draft->import->view;
    for (unsigned i = 0; i < file->mNumCameras && view; i++) {
        const struct aiCamera *camera = file->mCameras[i];
        if (strcmp(camera->mName.data, node->mName.data) != 0) continue;
        if (view->has_camera) {
            draft_warn(importer->draft, "%s", draft_cameras);
            continue;
        }
        view->camera = (Camera){.up = affine_direction(affine, vector_of(&camera->mUp)),
                                .field_axis = FIELD_HORIZONTAL,
                                .half_tangent = portable_tangent(camera->mHorizontalFOV / 2),
                                .frame_aspect = fmax(camera->mAspect, 0)};
        camera_look_along(&view->camera, affine_point(affine, vector_of(&camera->mPosition)),
                          vector_normalize(affine_direction(affine, vector_of(&camera->mLookAt))));
        view->has_camera = true;
    }
    for (unsigned i = 0; i < file->mNumLights && view; i++) {
        const struct aiLight *light = file->mLights[i];
        const bool is_sun = light->mType == aiLightSource_DIRECTIONAL,
                   is_spot = light->mType == aiLightSource_SPOT;
        if (strcmp(light->mName.data, node->mName.data) != 0) continue;
        if (!is_sun && !is_spot && light->mType != aiLightSource_POINT) {
            draft_warn(importer->draft,
                       "the light '%.40s' is neither directional, point nor spot; it is ignored",
                       light->mName.data);
            continue;
        }
        const double outer = fmin(fmax(light->mAngleOuterCone, 1e-3), M_PI) * (90 / M_PI),
                     inner = fmin(fmax(light->mAngleInnerCone, 0) * (90 / M_PI), outer);
        const Light added = {
            .type = is_sun    ? LIGHT_DIRECTIONAL
                    : is_spot ? LIGHT_SPOT
                              : LIGHT_POINT,
            .color = {light->mColorDiffuse.r, light->mColorDiffuse.g, light->mColorDiffuse.b},
            .position = affine_point(affine, vector_of(&light->mPosition)),
            .direction = vector_normalize(affine_direction(affine, vector_of(&light->mDirection))),
            .spot.half_angle = outer,
            .spot.penumbra = outer - inner,
            .fading = {light->mAttenuationConstant, light->mAttenuationLinear, light->mAttenuationQuadratic}};
        array_push(view->lights, added);
    }
}

static bool assimp_node_add(Importer *importer, const struct aiNode *node, const Affine *parent)
{
    const Affine local = affine_of_node(&node->mTransformation), affine = affine_multiply(parent, &local);
    assimp_view_add(importer, node, &affine);
    for (unsigned i = 0; i < node->mNumMeshes; i++)
        if (node->mMeshes[i] < importer->file->mNumMeshes &&
            !assimp_mesh_add(importer, importer->file->mMeshes[node->mMeshes[i]], &affine))
            return false;
    for (unsigned i = 0; i < node->mNumChildren; i++)
        if (!assimp_node_add(importer, node->mChildren[i], &affine)) return false;
    return true;
}

static bool assimp_file_add(Importer *importer)
{
    const size_t material_count = importer->file->mNumMaterials;
    if (importer->draft->import->own_materials) {
        importer->materials = memory_allocate(material_count, sizeof *importer->materials);
        for (size_t i = 0; i < material_count; i++)
            importer->materials[i] = (ImportedMaterial){.scene_index = {DRAFT_NONE, DRAFT_NONE}};
    }
    if (importer->file->mNumAnimations > 0) draft_warn(importer->draft, "%s", draft_animations);
    if (!importer->draft->import->view && importer->file->mNumCameras + importer->file->mNumLights > 0)
        draft_warn(importer->draft, "%s", draft_view);
    const bool added =
        !importer->file->mRootNode || assimp_node_add(importer, importer->file->mRootNode, &affine_identity);
    free(importer->materials);
    draft_fill_parts(importer->draft);
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
        return draft_refuse(
            draft, "a mesh's name must have a known ending, such as .obj, .ply, .stl, .gltf, .fbx or .dae");
    Importer importer = {.draft = draft, .file = aiImportFile(path, 0)};
    if (!importer.file) {
        const char *error = aiGetErrorString();
        if (strstr(error, "bad_alloc")) exit(EXIT_MACHINE);
        return draft_refuse(draft, "%.*s", (int)strcspn(error, "\r\n"), error);
    }
    const bool added = assimp_file_add(&importer);
    aiReleaseImport(importer.file);
    return added;
}
