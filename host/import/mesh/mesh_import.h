// Reads meshes from files and places them in the world.
#pragma once

#include "host/base/array.h"
#include "host/import/load.h"
#include "host/scene/affine.h"
#include "host/scene/mesh.h"

// The source of shading normals. It is the file if it has any, nothing, or the file and otherwise the
// triangles around each vertex.
typedef enum { SMOOTH_AS_FILE, SMOOTH_NEVER, SMOOTH_ALWAYS } MeshSmoothing;

// The camera and the lights of a file.
typedef struct {
    Camera camera;
    bool has_camera;
    ARRAY_OF(Light) lights;
} MeshView;

typedef struct {
    const char *path; // of the file, also in messages
    Affine transform; // has an inverse
    MeshSmoothing smoothing;
    bool own_materials; // whether the file's materials are added to the scene's
    MeshView *view;     // filled if the file is the whole scene, otherwise NULL
    const SceneOptions *options;
    Report *report; // of the scene
    size_t offset;  // of the file's name in the scene, or MESSAGE_WHOLE_FILE if the file is the scene
} MeshImport;

// Returns whether glint reads meshes with the name's ending.
bool mesh_is_known(const char *path);

// Adds the file's triangles to the scene as one mesh and sets *index to its index. Reports an error and
// returns false if the file cannot be read as a mesh, or if a vertex of a face is missing, not finite or
// beyond NUMBER_MAX. The mesh has no materials if no triangle has one of the file.
bool mesh_import(Scene *scene, const MeshImport *import, uint32_t *index);
