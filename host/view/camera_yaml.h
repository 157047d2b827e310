// A camera as a scene file in YAML has it.
#pragma once

#include "host/base/text.h"
#include "host/scene/scene.h"

// Writes a number with the fewest digits that read back as the same.
void number_write_yaml(Text *text, double value);
// Writes a list of three such numbers.
void vector_write_yaml(Text *text, Vector3 v);

// One line, `camera: {…}`, from which the reader gets the same camera bit for bit; but for an angle of view
// that no number of degrees gives, which other formats may have: the nearest. `aspect`: width over height of
// the image.
void camera_write_yaml(Text *text, const Camera *camera, double aspect);
