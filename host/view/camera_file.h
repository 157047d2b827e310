// The camera in a scene's file in YAML.
#pragma once

#include "host/base/text.h"
#include "host/import/report.h"
#include "host/scene/scene.h"

// The file's text with another position, look_at and up of its camera; all other bytes stay, comments too.
// False with a message where the text is no scene, or these have no place of their own in it: an alias.
bool camera_replace(Text *text, const Source *source, const Camera *camera, MessageList *messages);
