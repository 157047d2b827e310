// Meshes read from files and placed in the world.
#pragma once

#include "host/import/load.h"
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
    const SceneOptions *options;
    Report *report; // of the scene
    size_t offset;  // of the file's name in the scene
} MeshImport;

// Adds the file's triangles to the scene as one mesh and sets *index to its index. Reports an error and
// returns false if the file cannot be read as a mesh, or if a vertex of a face is missing, not finite or
// beyond NUMBER_MAX. Where no triangle has a material of the file, the mesh has none.
bool mesh_import(Scene *scene, const MeshImport *import, uint32_t *index);
