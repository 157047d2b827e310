// Replaces the camera in a scene's YAML file.
#pragma once

#include "host/base/text.h"
#include "host/import/report.h"
#include "host/scene/scene.h"

// Replaces position, look_at, up and height of the camera in the file's text. All other bytes stay,
// including comments. With a `frame`, position, look_at and height get a key there, and so does an `up` that
// has keys. Returns false with a message if the text is not a scene, if these have no separate place in it,
// as in an alias, or if they have keys and `frame` is NULL.
bool camera_replace(Text *text, const Source *source, const Camera *camera, const uint32_t *frame,
                    MessageList *messages);
