// Values of a YAML document that change from frame to frame, each given as `{keys: {FRAME: VALUE, …}}`.
#pragma once

#include "host/import/yaml/fields.h"

// Replaces each such mapping of the reader's tree by its value at the frame that the options name, a number
// or a list of numbers, and notes in the scene that it is animated. Reports errors and returns false if one
// cannot be read.
bool yaml_animate(YamlReader *reader);

// Returns whether a node of the tree is such a mapping.
bool yaml_has_keys(const YamlReader *reader, const YamlNode *node);
