// Meshes read from files and placed in the world.
#pragma once

#include "host/base/text.h"
#include "host/import/report.h"
#include "host/scene/mesh.h"

// Scaled, then turned about x, y and z in this order, then moved.
typedef struct {
    Vector3 translate;
    Vector3 rotate; // degrees
    Vector3 scale;  // no component is 0; may be negative
} MeshTransform;

// Where normals come from: the file if it has some, nowhere, the file or else the triangles around a vertex.
typedef enum { SMOOTH_AS_FILE, SMOOTH_NEVER, SMOOTH_ALWAYS } MeshSmoothing;

typedef struct {
    const char *path; // to open, and in messages
    MeshTransform transform;
    MeshSmoothing smoothing;
    bool own_materials; // the file's materials join the scene's
} MeshImport;

// Adds the file's triangles to the scene as one more mesh; *index is its place. False, reported at `offset`:
// the file is no mesh that can be read, or a vertex of a face is not finite, beyond NUMBER_LARGEST or
// missing.
bool mesh_import(Scene *scene, const MeshImport *import, Report *report, size_t offset, uint32_t *index);

// What is wrong with an OBJ file's vertices or with a face that names them, as `line N: what`, first with
// what faces use; false where nothing is, or the file cannot be read.
bool obj_find_fault(const char *path, char *fault, size_t size);

// What a glTF file holds that assimp would crash on, or never be done with, told likewise.
bool gltf_find_fault(const char *path, char *fault, size_t size);

// Reads a PLY file and writes it anew, as assimp reads it right. False where it promises more than it holds
// or is not PLY: then the fault is told as `line N: what` or, in a binary file's body, as `byte N: what`.
bool ply_read(Text *clean, const char *path, char *fault, size_t size);
