// Scene files: the reader follows from the file's name.
#pragma once

#include "host/import/load.h"
#include "host/import/report.h"
#include "host/scene/scene.h"

typedef struct {
    bool lenient; // skip unknown elements of .rt with a warning
} SceneOptions;

// Reads a scene; the format follows from the name's ending (.yaml .yml .rt .cfg .nff). On a user's fault
// returns false with the errors in `messages` and an empty scene; warnings may be there either way.
bool scene_load(Scene *scene, const char *path, const SceneOptions *options, MessageList *messages);

// The readers, from memory. `source->file` is used in messages only.
bool scene_read_yaml(Scene *scene, const Source *source, MessageList *messages);
bool scene_read_rt(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages);
bool scene_read_cfg(Scene *scene, const Source *source, MessageList *messages);
bool scene_read_nff(Scene *scene, const Source *source, MessageList *messages);

// For the readers. Closes the report. Without errors warns of what makes a picture black; with errors empties
// the scene.
bool scene_finish(Scene *scene, Report *report);
