// Meshes read from files and placed in the world.
#pragma once

#include "host/base/text.h"
#include "host/import/report.h"
#include "host/scene/mesh.h"

// Scales, then rotates about x, y and z in this order, then translates.
typedef struct {
    Vector3 translate;
    Vector3 rotate; // degrees
    Vector3 scale;  // no component is 0; may be negative
} MeshTransform;

// Source of shading normals: the file if it has any; none; the file, else the triangles around each vertex.
typedef enum { SMOOTH_AS_FILE, SMOOTH_NEVER, SMOOTH_ALWAYS } MeshSmoothing;

typedef struct {
    const char *path; // to open, and in messages
    MeshTransform transform;
    MeshSmoothing smoothing;
    bool own_materials; // the file's materials join the scene's
} MeshImport;

// Adds the file's triangles to the scene as one mesh and sets *index to its index. Reports an error at
// `offset` and returns false if the file cannot be read as a mesh, or if a vertex of a face is missing, not
// finite or beyond NUMBER_MAX.
bool mesh_import(Scene *scene, const MeshImport *import, Report *report, size_t offset, uint32_t *index);

// Writes the first error in an OBJ file's vertices or faces as `line N: what`; vertices that faces use come
// first. False if there is none or the file cannot be read.
bool obj_find_fault(const char *path, char *fault, size_t size);

// Writes the name of the first material file (mtllib) that an OBJ file names and that cannot be read. False
// if there is none, or one of the OBJ file's own name, which assimp reads instead.
bool obj_find_missing_material_file(const char *path, char *name, size_t size);

// Writes what would make assimp crash or never finish on a glTF file. False if there is nothing.
bool gltf_find_fault(const char *path, char *fault, size_t size);

// Reads a PLY file and rewrites it in a form that assimp reads correctly. False if the file is not PLY or is
// shorter than its header claims; `fault` is then `line N: what`, or `byte N: what` in a binary body.
bool ply_read(Text *clean, const char *path, char *fault, size_t size);
