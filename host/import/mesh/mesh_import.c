// Mesh files through assimp, without its post-processing: joining vertices and generating normals there use
// absolute distances, which distorts small meshes; its triangulation reads missing vertices and drops parts
// of concave polygons.
#include "host/import/mesh/mesh_import.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/load.h"
#include "host/import/number.h"
#include "host/scene/polygon.h"

#include <assimp/cimport.h>
#include <assimp/scene.h>
#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum { MESH_TRIANGLES_MAX = 1 << 28, MESH_POLYGON_MAX = 1 << 14 };

// Three rows of a matrix, the last column the translation.
typedef struct {
    double rows[3][4];
} Affine;

// An instance: a mesh of the file under the transform of one of its nodes.
typedef struct {
    const struct aiMesh *mesh;
    Affine affine;
} MeshInstance;

typedef struct {
    const MeshImport *import;
    Report *report;
    size_t offset;
    Scene *scene;
    const struct aiScene *file;
    struct {
        MeshInstance *items;
        size_t count, capacity;
    } instances;
    uint32_t *materials; // scene index of each of the file's materials; UINT32_MAX: not added yet
    struct {
        Vector3 *items;
        size_t count, capacity;
    } corners; // of the current polygon
    PolygonTriangles cut;
    size_t crossed_count;
    Mesh mesh;
} Importer;

static Affine affine_multiply(const Affine *a, const Affine *b)
{
    Affine product;
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 4; column++) {
            double sum = column == 3 ? a->rows[row][3] : 0;
            for (int k = 0; k < 3; k++)
                sum += a->rows[row][k] * b->rows[k][column];
            product.rows[row][column] = sum;
        }
    }
    return product;
}

static Vector3 affine_direction(const Affine *affine, Vector3 v)
{
    const double(*m)[4] = affine->rows;
    return (Vector3){m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
                     m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                     m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

static Vector3 affine_point(const Affine *affine, Vector3 p)
{
    Vector3 moved = affine_direction(affine, p);
    return (Vector3){moved.x + affine->rows[0][3], moved.y + affine->rows[1][3],
                     moved.z + affine->rows[2][3]};
}

static Vector3 affine_row(const Affine *affine, int row)
{
    const double *numbers = affine->rows[row];
    return (Vector3){numbers[0], numbers[1], numbers[2]};
}

static double affine_determinant(const Affine *affine)
{
    return vector_dot(affine_row(affine, 0), vector_cross(affine_row(affine, 1), affine_row(affine, 2)));
}

// Transforms normals: the transposed inverse times |determinant|, whose rows are cross products of rows.
static Affine affine_for_normals(const Affine *affine)
{
    double side = affine_determinant(affine) < 0 ? -1 : 1;
    Affine cofactors = {0};
    for (int row = 0; row < 3; row++) {
        Vector3 cross = vector_scale(
            vector_cross(affine_row(affine, (row + 1) % 3), affine_row(affine, (row + 2) % 3)), side);
        memcpy(cofactors.rows[row], (const double[3]){cross.x, cross.y, cross.z}, 3 * sizeof(double));
    }
    return cofactors;
}

static Affine affine_of_node(const struct aiMatrix4x4 *m)
{
    return (Affine){
        {{m->a1, m->a2, m->a3, m->a4}, {m->b1, m->b2, m->b3, m->b4}, {m->c1, m->c2, m->c3, m->c4}}};
}

// Sine and cosine of degrees, exact at quarter turns.
static void turn_of(double degrees, double *sine, double *cosine)
{
    int quarters;
    double rest = remquo(degrees, 90, &quarters) * (M_PI / 180);
    const double s = sin(rest), c = cos(rest);
    const double turned[4] = {s, c, -s, -c};
    *sine = turned[quarters & 3];
    *cosine = turned[(quarters + 1) & 3];
}

static Affine affine_of_transform(const MeshTransform *transform)
{
    double sx, cx, sy, cy, sz, cz;
    turn_of(transform->rotate.x, &sx, &cx);
    turn_of(transform->rotate.y, &sy, &cy);
    turn_of(transform->rotate.z, &sz, &cz);
    Vector3 move = transform->translate, scale = transform->scale;
    const Affine scaled = {{{scale.x, 0, 0, 0}, {0, scale.y, 0, 0}, {0, 0, scale.z, 0}}};
    const Affine about_x = {{{1, 0, 0, 0}, {0, cx, -sx, 0}, {0, sx, cx, 0}}};
    const Affine about_y = {{{cy, 0, sy, 0}, {0, 1, 0, 0}, {-sy, 0, cy, 0}}};
    const Affine about_z = {{{cz, -sz, 0, move.x}, {sz, cz, 0, move.y}, {0, 0, 1, move.z}}};
    Affine turned = affine_multiply(&about_x, &scaled);
    turned = affine_multiply(&about_y, &turned);
    return affine_multiply(&about_z, &turned);
}

static bool import_fails(Importer *importer, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Reports with the mesh file's name, the first line of the text only; always false.
static bool import_fails(Importer *importer, const char *format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    text[strcspn(text, "\r\n")] = '\0';
    report_error(importer->report, importer->offset, "%s: %s", importer->import->path, text);
    return false;
}

// assimp renumbers the vertices of OBJ files; the message gives the place in the file.
static bool vertex_fails(Importer *importer, const char *otherwise)
{
    char fault[200];
    return import_fails(importer, "%s",
                        obj_find_fault(importer->import->path, fault, sizeof fault) ? fault : otherwise);
}

static bool ply_open(Importer *importer)
{
    char fault[200];
    Text clean = {0};
    bool read = ply_read(&clean, importer->import->path, fault, sizeof fault);
    if (read && clean.count > UINT_MAX) {
        snprintf(fault, sizeof fault, "larger than 4 GiB");
        read = false;
    }
    if (read) importer->file = aiImportFileFromMemory(text_c(&clean), (unsigned)clean.count, 0, "ply");
    text_free(&clean);
    return read ? importer->file || import_fails(importer, "%s", aiGetErrorString())
                : import_fails(importer, "%s", fault);
}

static bool file_open(Importer *importer)
{
    static const char *const endings[] = {".obj", ".ply", ".stl", ".gltf", ".glb"};
    const char *path = importer->import->path, *ending = strrchr(path, '.');
    bool known = false;
    for (size_t i = 0; ending && i < sizeof endings / sizeof *endings; i++)
        known |= !strcasecmp(ending, endings[i]);
    if (!known) return import_fails(importer, "a mesh's name ends in .obj, .ply, .stl, .gltf or .glb");
    struct stat status;
    if (stat(path, &status) != 0) return import_fails(importer, "%s", strerror(errno));
    if (!S_ISREG(status.st_mode)) return import_fails(importer, "not a regular file");
    if (!strcasecmp(ending, ".ply")) return ply_open(importer);
    char fault[200];
    if (gltf_find_fault(path, fault, sizeof fault)) return import_fails(importer, "%s", fault);
    importer->file = aiImportFile(path, 0);
    return importer->file || vertex_fails(importer, aiGetErrorString());
}

static void node_place(Importer *importer, const struct aiNode *node, const Affine *parent)
{
    Affine own = affine_of_node(&node->mTransformation);
    Affine affine = affine_multiply(parent, &own);
    for (unsigned i = 0; i < node->mNumMeshes; i++)
        if (node->mMeshes[i] < importer->file->mNumMeshes)
            array_push(importer->instances,
                       ((MeshInstance){importer->file->mMeshes[node->mMeshes[i]], affine}));
    for (unsigned i = 0; i < node->mNumChildren; i++)
        node_place(importer, node->mChildren[i], &affine);
}

static Vector3 vector_of(const struct aiVector3D *v)
{
    return (Vector3){v->x, v->y, v->z};
}

static bool is_in_range(Vector3 v)
{
    return fabs(v.x) <= NUMBER_MAX && fabs(v.y) <= NUMBER_MAX && fabs(v.z) <= NUMBER_MAX;
}

static void warn_default(const Importer *importer, const struct aiMaterial *material, const char *what)
{
    struct aiString name = {0};
    aiGetMaterialString(material, AI_MATKEY_NAME, &name);
    name.data[strcspn(name.data, "\r\n")] = '\0';
    report_warning(importer->report, importer->offset,
                   "%s: a %s of material '%.40s' is not finite or too large: using the default",
                   importer->import->path, what, name.data);
}

// Key, type and index: what assimp's AI_MATKEY_… expand to.
static Color color_of(const Importer *importer, const struct aiMaterial *material, const char *key,
                      unsigned type, unsigned index, Color otherwise)
{
    struct aiColor4D color;
    if (aiGetMaterialColor(material, key, type, index, &color) != aiReturn_SUCCESS) return otherwise;
    if (is_in_range((Vector3){color.r, color.g, color.b}))
        return (Color){fmax(color.r, 0), fmax(color.g, 0), fmax(color.b, 0)};
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

// glint's highlights have the light's color; only the strength of the file's specular color is kept.
// One warning for each texture of the material: meshes get theirs from the scene.
static void warn_of_textures(const Importer *importer, const struct aiMaterial *material, const char *name)
{
    char previous[MAXLEN] = "";
    for (int type = aiTextureType_DIFFUSE; type <= AI_TEXTURE_TYPE_MAX; type++) {
        struct aiString path = {0};
        if (aiGetMaterialTextureCount(material, (enum aiTextureType)type) == 0) continue;
        aiGetMaterialTexture(material, (enum aiTextureType)type, 0, &path, NULL, NULL, NULL, NULL, NULL,
                             NULL);
        path.data[strcspn(path.data, "\r\n")] = '\0';
        // assimp lists a glTF base color under two types
        if (strcmp(path.data, previous) == 0) continue;
        report_warning(importer->report, importer->offset,
                       "%s: the texture '%.100s' of material '%.40s' is not used: give the mesh a material "
                       "with an image",
                       importer->import->path, path.data, name);
        memcpy(previous, path.data, sizeof previous);
    }
}

static void warn_of_missing_material_file(const Importer *importer)
{
    char name[200];
    if (obj_find_missing_material_file(importer->import->path, name, sizeof name))
        report_warning(importer->report, importer->offset,
                       "%s: the material file '%s' cannot be read: the default material is used",
                       importer->import->path, name);
}

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
    *known = scene_add_material(importer->scene, &material, name.data);
    return *known;
}

static void vertices_add(Importer *importer, const MeshInstance *instance)
{
    const struct aiMesh *from = instance->mesh;
    Mesh *mesh = &importer->mesh;
    Affine for_normals = affine_for_normals(&instance->affine);
    for (unsigned i = 0; i < from->mNumVertices; i++) {
        size_t index = mesh->vertex_count + i;
        mesh->vertices[index] = affine_point(&instance->affine, vector_of(&from->mVertices[i]));
        if (mesh->normals && from->mNormals) {
            Vector3 normal = vector_normalize(affine_direction(&for_normals, vector_of(&from->mNormals[i])));
            mesh->normals[index] = is_in_range(normal) ? normal : (Vector3){0, 0, 0};
        }
        if (mesh->uvs && from->mTextureCoords[0]) {
            mesh->uvs[index][0] = from->mTextureCoords[0][i].x;
            mesh->uvs[index][1] = from->mTextureCoords[0][i].y;
        }
    }
}

// Tested before the transform, whose rounding could give a degenerate triangle an area.
static bool face_has_area(const struct aiMesh *mesh, const unsigned corners[3])
{
    Vector3 a = vector_of(&mesh->mVertices[corners[0]]), b = vector_of(&mesh->mVertices[corners[1]]),
            c = vector_of(&mesh->mVertices[corners[2]]);
    return !vector_is_zero(vector_cross(vector_subtract(b, a), vector_subtract(c, a)));
}

// A mirroring transform inverts the winding; inverting it back keeps the triangles' outer side. Degenerate
// triangles collapse to a point, which no ray hits.
static void triangle_add(Importer *importer, const MeshInstance *instance, bool mirrored,
                         const unsigned corners[3])
{
    Mesh *mesh = &importer->mesh;
    uint32_t first = (uint32_t)mesh->vertex_count, *triangle = mesh->triangles[mesh->triangle_count];
    bool has_area = face_has_area(instance->mesh, corners);
    triangle[0] = first + corners[0];
    triangle[1] = has_area ? first + corners[mirrored ? 2 : 1] : triangle[0];
    triangle[2] = has_area ? first + corners[mirrored ? 1 : 2] : triangle[0];
    if (mesh->materials)
        mesh->materials[mesh->triangle_count] = material_index(importer, instance->mesh->mMaterialIndex);
    mesh->triangle_count++;
}

// Triangulated from the second corner, so that a convex quadrilateral is cut as a fan cuts it: by the
// diagonal from the first. A polygon without area becomes a fan.
static void polygon_add(Importer *importer, const MeshInstance *instance, bool mirrored,
                        const struct aiFace *face)
{
    const unsigned count = face->mNumIndices, *indices = face->mIndices;
    importer->corners.count = 0;
    for (unsigned i = 0; i < count; i++)
        array_push(importer->corners, vector_of(&instance->mesh->mVertices[indices[(i + 1) % count]]));
    PolygonTriangles *cut = &importer->cut;
    PolygonStatus status = polygon_triangulate(importer->corners.items, count, cut);
    importer->crossed_count += status == POLYGON_CROSSED;
    for (unsigned i = 0; i + 2 < count && status == POLYGON_WITHOUT_AREA; i++)
        triangle_add(importer, instance, mirrored,
                     (const unsigned[3]){indices[0], indices[i + 1], indices[i + 2]});
    for (size_t i = 0; i < cut->count; i++) {
        const uint32_t *at = cut->items[i];
        triangle_add(importer, instance, mirrored,
                     (const unsigned[3]){indices[(at[0] + 1) % count], indices[(at[1] + 1) % count],
                                         indices[(at[2] + 1) % count]});
    }
}

// Vertices that no face uses are not checked.
static bool corner_is_sound(Importer *importer, const struct aiMesh *from, unsigned vertex)
{
    const Mesh *mesh = &importer->mesh;
    size_t index = mesh->vertex_count + vertex;
    char fault[100];
    if (!is_in_range(mesh->vertices[index])) {
        snprintf(fault, sizeof fault, "vertex %u (from 0) of '%.40s' is not finite or too large", vertex,
                 from->mName.data);
        return vertex_fails(importer, fault);
    }
    if (mesh->uvs && !is_in_range((Vector3){mesh->uvs[index][0], mesh->uvs[index][1], 0}))
        return import_fails(
            importer, "a texture coordinate of vertex %u (from 0) of '%.40s' is not finite or too large",
            vertex, from->mName.data);
    return true;
}

static bool face_is_sound(Importer *importer, const struct aiMesh *mesh, unsigned number)
{
    const struct aiFace *face = &mesh->mFaces[number];
    char fault[100];
    if (face->mNumIndices > MESH_POLYGON_MAX)
        return import_fails(importer, "face %u (from 0) has %u corners, more than %d", number,
                            face->mNumIndices, MESH_POLYGON_MAX);
    for (unsigned i = 0; i < face->mNumIndices; i++) {
        if (face->mIndices[i] >= mesh->mNumVertices) {
            snprintf(fault, sizeof fault, "face %u (from 0) names vertex %u, which is not there", number,
                     face->mIndices[i]);
            return vertex_fails(importer, fault);
        }
        if (!corner_is_sound(importer, mesh, face->mIndices[i])) return false;
    }
    return true;
}

static bool faces_add(Importer *importer, const MeshInstance *instance)
{
    const struct aiMesh *from = instance->mesh;
    bool mirrored = affine_determinant(&instance->affine) < 0;
    if (importer->materials && from->mMaterialIndex >= importer->file->mNumMaterials)
        return import_fails(importer, "material %u (from 0) is not there", from->mMaterialIndex);
    for (unsigned i = 0; i < from->mNumFaces; i++) {
        const struct aiFace *face = &from->mFaces[i];
        if (face->mNumIndices < 3) continue; // points and lines
        if (!face_is_sound(importer, from, i)) return false;
        if (face->mNumIndices == 3)
            triangle_add(importer, instance, mirrored, face->mIndices);
        else
            polygon_add(importer, instance, mirrored, face);
    }
    return true;
}

// Upper bound on a mesh's triangles after triangulation.
static size_t triangles_count(const struct aiMesh *mesh)
{
    size_t count = 0;
    for (unsigned i = 0; i < mesh->mNumFaces; i++)
        if (mesh->mFaces[i].mNumIndices >= 3) count += mesh->mFaces[i].mNumIndices - 2;
    return count;
}

// Allocates for all instances; `normals` and `uvs` only if any of them has some.
static bool mesh_reserve(Importer *importer)
{
    size_t vertex_count = 0, triangle_count = 0;
    bool has_normals = false, has_uvs = false;
    for (size_t i = 0; i < importer->instances.count; i++) {
        const struct aiMesh *from = importer->instances.items[i].mesh;
        vertex_count += from->mNumVertices;
        triangle_count += triangles_count(from);
        has_normals |= from->mNormals != NULL;
        has_uvs |= from->mTextureCoords[0] != NULL;
    }
    if (vertex_count >= UINT32_MAX || triangle_count > MESH_TRIANGLES_MAX)
        return import_fails(importer, "%zu triangles, more than %d", triangle_count, MESH_TRIANGLES_MAX);
    Mesh *mesh = &importer->mesh;
    mesh->vertices = memory_allocate(vertex_count + 1, sizeof *mesh->vertices);
    mesh->triangles = memory_allocate(triangle_count + 1, sizeof *mesh->triangles);
    if (has_normals && importer->import->smoothing != SMOOTH_NEVER)
        mesh->normals = memory_allocate_zeroed(vertex_count + 1, sizeof *mesh->normals);
    if (has_uvs) mesh->uvs = memory_allocate_zeroed(vertex_count + 1, sizeof *mesh->uvs);
    if (importer->import->own_materials) {
        warn_of_missing_material_file(importer);
        mesh->materials = memory_allocate(triangle_count + 1, sizeof *mesh->materials);
        importer->materials = memory_allocate(importer->file->mNumMaterials + 1, sizeof *importer->materials);
        memset(importer->materials, 0xff, importer->file->mNumMaterials * sizeof *importer->materials);
    }
    return true;
}

static bool instance_add(Importer *importer, const MeshInstance *instance)
{
    vertices_add(importer, instance);
    if (!faces_add(importer, instance)) return false;
    importer->mesh.vertex_count += instance->mesh->mNumVertices;
    return true;
}

static bool mesh_read(Importer *importer)
{
    if (!file_open(importer)) return false;
    Affine transform = affine_of_transform(&importer->import->transform);
    if (importer->file->mRootNode) node_place(importer, importer->file->mRootNode, &transform);
    if (!mesh_reserve(importer)) return false;
    for (size_t i = 0; i < importer->instances.count; i++)
        if (!instance_add(importer, &importer->instances.items[i])) return false;
    if (importer->mesh.triangle_count == 0) return import_fails(importer, "no triangles");
    return true;
}

bool mesh_import(Scene *scene, const MeshImport *import, Report *report, size_t offset, uint32_t *index)
{
    Importer importer = {.import = import, .report = report, .offset = offset, .scene = scene};
    bool read = mesh_read(&importer);
    if (importer.file) aiReleaseImport(importer.file);
    free(importer.instances.items);
    free(importer.materials);
    free(importer.corners.items);
    free(importer.cut.items);
    if (!read) {
        mesh_free(&importer.mesh);
        return false;
    }
    mesh_join_vertices(&importer.mesh);
    if (import->smoothing == SMOOTH_ALWAYS && !importer.mesh.normals) mesh_make_normals(&importer.mesh);
    size_t degenerate_count = mesh_degenerate_count(&importer.mesh);
    if (degenerate_count > 0)
        report_warning(report, offset, "%s: triangles without area, which are never hit: %zu", import->path,
                       degenerate_count);
    if (importer.crossed_count > 0)
        report_warning(
            report, offset,
            "%s: polygons that cross themselves or are far from flat, filled as far as they can be: %zu",
            import->path, importer.crossed_count);
    *index = (uint32_t)scene->meshes.count;
    array_push(scene->meshes, importer.mesh);
    return true;
}
