// The camera in a scene's file in YAML.
#pragma once

#include "host/base/text.h"
#include "host/import/report.h"
#include "host/scene/scene.h"

// Replaces position, look_at and up of the camera in the file's text; all other bytes stay, including
// comments. Returns false with a message if the text is not a scene, or these have no separate place in it,
// as in an alias.
bool camera_replace(Text *text, const Source *source, const Camera *camera, MessageList *messages);
