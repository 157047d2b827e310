// Reads scene files. The ending of the file's name chooses the reader.
#pragma once

#include "host/base/stage.h"
#include "host/import/report.h"
#include "host/scene/scene.h"

typedef struct {
    bool lenient; // skips unknown elements of .rt with a warning
    // Values that replace those of a YAML scene or are added to it, in this order. Each is PATH=VALUE, such
    // as camera.fov=60.
    const char *const *overrides;
    size_t override_count;
    const char *override_name; // names their source in messages
    double frame;              // of an animated YAML scene
    uint32_t max_pixels;       // of each image; 0 for the default
    const char *camera;        // the path of a scene whose camera replaces the scene's, or NULL
    // Called with each mesh, image and scene that the file names before it is read, unless it is NULL.
    void (*file_named)(void *context, const char *path);
    void *context;
    Stage *stage; // shows what is being read, or NULL
    // The program that reads assimp's formats by assimp_process_main. It is searched in PATH. NULL means this
    // process's program.
    const char *mesh_program;
} SceneOptions;

// Passes the path of a file that the scene names to the options' file_named. The options may be NULL.
void scene_file_named(const SceneOptions *options, const char *path);

// Returns whether the name's ending is that of a scene or a mesh that glint reads.
bool scene_is_known(const char *path);
// Returns whether the name's ending is that of a YAML scene.
bool scene_is_yaml(const char *path);

// Reads a scene. The file's ending determines the format (.yaml .yml .json .rt .cfg .nff .dat, or a mesh
// format); a .dat scene is also recognized by its first word. The camera's file is read without the
// overrides. On a mistake in either file, returns false with errors in `messages` and an empty scene.
// Warnings may be added in either case.
bool scene_load(Scene *scene, const char *path, const SceneOptions *options, MessageList *messages);

// Each of these reads a scene from memory; `source->file` is used in messages only.
bool scene_read_yaml(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages);
bool scene_read_rt(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages);
bool scene_read_cfg(Scene *scene, const Source *source, MessageList *messages);
bool scene_read_nff(Scene *scene, const Source *source, MessageList *messages);
bool scene_read_dat(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages);

// Reads the triangles, materials, camera and lights of a file that mesh_is_known accepts. Adds a camera that
// frames the mesh if the file has no camera, and two lights if it has no lights.
bool scene_read_mesh(Scene *scene, const char *path, const SceneOptions *options, MessageList *messages);

// Makes a scene of a gray mesh, a camera that frames it and two lights. Takes ownership of the mesh.
void scene_of_mesh(Scene *scene, Mesh *mesh);

// Decodes the images of a scene unless there are errors, closes its reader's report and warns of causes of a
// black image. Returns false and frees the scene if there are errors.
bool scene_finish(Scene *scene, Report *report, const SceneOptions *options);
