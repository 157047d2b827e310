// A mesh as its file stores it, before it is placed in the world. Every reader of meshes fills a draft, which
// is then checked, cut into triangles, transformed and made one Mesh.
#pragma once

#include "host/base/array.h"
#include "host/import/mesh/mesh_import.h"

// Marks a corner without a normal or without texture coordinates.
#define DRAFT_NONE         UINT32_MAX
#define DRAFT_VERTICES_MAX (DRAFT_NONE - 1)

typedef enum { DRAFT_POSITION, DRAFT_UV, DRAFT_NORMAL, DRAFT_PART_COUNT } DraftPart;

typedef ARRAY_OF(uint32_t) DraftIndices;

// The material of all triangles from a corner on.
typedef struct {
    size_t first_corner;
    uint32_t material; // of the scene
} DraftMaterialRun;

enum { DRAFT_POLYGON_MAX = 1 << 14 }; // corners of a face

// A face of more than three corners.
typedef struct {
    size_t first_corner, corner_count;
} DraftPolygon;

// An index and its offset in the file.
typedef struct {
    size_t index, offset;
} DraftPlace;

// The places that messages name, which are the lines of a text, the bytes of a binary file, or none.
typedef enum { DRAFT_LINES, DRAFT_BYTES, DRAFT_NO_PLACES } DraftPlaces;

typedef struct {
    const MeshImport *import;
    Scene *scene;
    Source source; // the file
    Stage *stage;  // counts its bytes; may be NULL
    DraftPlaces places;
    Report report; // of the file

    ARRAY_OF(Vector3) positions, normals;
    struct {
        double (*items)[2];
        size_t count, capacity;
    } uvs;
    // One index per part for each corner of all faces. The list is empty for a part that no corner has, or
    // that shares the indices of the positions and has one value for each of them.
    DraftIndices corners[DRAFT_PART_COUNT];
    bool is_shared[DRAFT_PART_COUNT];
    ARRAY_OF(DraftPolygon) polygons; // all other corners are those of triangles
    ARRAY_OF(DraftMaterialRun) materials;
    // Positions that are not numbers. They are an error only if a face uses them.
    ARRAY_OF(DraftPlace) unread;
    // One more than the largest index per part that a corner names before the file defines it. draft_check
    // compares it with the final count.
    DraftPlace needed[DRAFT_PART_COUNT];
    size_t first_index;   // the first index in the file, 0 or 1, for messages
    size_t face_start;    // the first corner of the face that is being added
    size_t crossed_count; // polygons that cross themselves, for a warning
    bool has_short_faces; // whether faces of one or two corners were warned of
} MeshDraft;

extern const char *const draft_part_names[DRAFT_PART_COUNT];

// Reports an error at an offset of the file and returns false.
bool draft_fails(MeshDraft *draft, size_t offset, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// Reports an error or a warning about the whole file at its name in the scene, each text once. draft_refuse
// returns false.
bool draft_refuse(MeshDraft *draft, const char *format, ...) __attribute__((format(printf, 2, 3)));
void draft_warn(MeshDraft *draft, const char *format, ...) __attribute__((format(printf, 2, 3)));
// Reports that there are more vertices than DRAFT_VERTICES_MAX and returns false.
bool draft_refuse_vertices(MeshDraft *draft);

size_t draft_part_count(const MeshDraft *draft, DraftPart part);
// Starts a part's list, with DRAFT_NONE for all corners before `corner`.
void draft_begin_part(MeshDraft *draft, DraftPart part, size_t corner);
void draft_record_index(MeshDraft *draft, DraftPart part, size_t index, size_t offset);
// Makes the part share the indices of the positions, and adds a value of 0 for each position that has none.
// A reader calls it before it adds positions with values.
void draft_share_part(MeshDraft *draft, DraftPart part);
// Adds a value of 0 to shared parts for each position that has none.
void draft_fill_parts(MeshDraft *draft);

// Drops the indices of texture coordinates and normals that the file lacks, with a warning. Removes a part
// that has no remaining index.
void draft_drop_missing(MeshDraft *draft);

// Adds a vertex. `unread` is the offset of a coordinate that is not a number in range, or 0. Returns false
// with an error if there are too many vertices.
static inline bool draft_add_vertex(MeshDraft *draft, Vector3 position, size_t unread)
{
    if (draft->positions.count == DRAFT_VERTICES_MAX) return draft_refuse_vertices(draft);
    if (unread > 0) array_push(draft->unread, ((DraftPlace){draft->positions.count, unread}));
    array_push(draft->positions, unread > 0 ? vector_all(NAN) : position);
    return true;
}

// Adds an index of the next corner. The position's index must be added first. `offset` is the index's place
// in the file. draft_check checks an index of a value that the file defines later.
static inline void draft_add_index(MeshDraft *draft, DraftPart part, uint32_t index, size_t offset)
{
    if (index >= draft_part_count(draft, part)) draft_record_index(draft, part, index, offset);
    array_push(draft->corners[part], index);
}

static inline void draft_add_uv(MeshDraft *draft, double u, double v)
{
    array_reserve(draft->uvs, 1);
    double *uv = draft->uvs.items[draft->uvs.count++];
    uv[0] = u;
    uv[1] = v;
}

// Returns the number in 4 bytes, of which the first is the least significant.
static inline uint32_t little_endian_at(const char *bytes)
{
    const unsigned char *byte = (const unsigned char *)bytes;
    return (uint32_t)byte[0] | (uint32_t)byte[1] << 8 | (uint32_t)byte[2] << 16 | (uint32_t)byte[3] << 24;
}

static inline bool draft_has(const MeshDraft *draft, DraftPart part)
{
    return draft->is_shared[part] || draft->corners[part].count > 0;
}

// Returns the path of a file that the file `from` names relative to its folder. Files often hold paths of
// another machine. If only a file of that name in the folder of `from` exists, returns its path and sets
// *is_moved. The caller frees it.
char *draft_find_file(const char *from, const char *name, size_t length, bool *is_moved);

// Describes the replacement of a missing texture, for messages.
const char *texture_fallback(TextureContent content);
// Describes why no image can be read from a file, and what replaces it. Returns NULL if one can. The caller
// frees it.
char *texture_obstacle(const char *path, TextureContent content);

// The messages that several readers have.
extern const char draft_animations[], draft_skins[], draft_morphs[], draft_colors[], draft_view[],
    draft_cameras[], draft_no_uvs[];
// With the name of a missing file, as WORD_TEXT gives it, and the path of another one.
#define DRAFT_MOVED_FILE "'%.*s' does not exist; '%s' is used"

// Adds an image to the scene's textures, from a file, also one that was checked, or from bytes, which are
// copied. Returns 0 with a warning at `owner` if the image cannot be used.
uint32_t draft_add_texture(MeshDraft *draft, const char *path, TextureContent content, const char *owner);
uint32_t draft_add_checked_texture(MeshDraft *draft, const char *path, TextureContent content,
                                   const char *owner);
uint32_t draft_add_embedded_texture(MeshDraft *draft, const Source *bytes, TextureContent content,
                                    const char *owner);

// Ends the face, which consists of the corners since the last face. Skips points and lines, and warns of them
// once. Returns false if there are too many corners.
bool draft_end_face(MeshDraft *draft, size_t offset);

// Checks the draft. Returns false with an error if a face has corners that are missing or not numbers, or if
// there are no triangles or too many.
bool draft_check(MeshDraft *draft);
// Turns a checked draft into a mesh in the world and consumes its arrays.
void draft_finish(MeshDraft *draft, Mesh *mesh);
void draft_free(MeshDraft *draft);

// Each of these readers returns false with an error on failure.
bool obj_read(MeshDraft *draft);
bool ply_read(MeshDraft *draft);
bool stl_read(MeshDraft *draft);
bool gltf_read(MeshDraft *draft);
// Reads a file with assimp in a separate process.
bool assimp_process_read(MeshDraft *draft);
