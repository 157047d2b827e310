// Writes a camera in the form of a YAML scene file.
#pragma once

#include "host/base/text.h"
#include "host/scene/scene.h"

// Writes a number with the fewest digits that read back as the same.
void number_write_yaml(Text *text, double value);
// Writes a list of three such numbers.
void vector_write_yaml(Text *text, Vector3 v);

// Writes one line, `camera: {…}`, from which the reader gets the same camera bit for bit. Only an angle of
// view that no number of degrees gives, which other formats may have, is replaced by the nearest. `aspect`
// is the image's width over its height.
void camera_write_yaml(Text *text, const Camera *camera, double aspect);
