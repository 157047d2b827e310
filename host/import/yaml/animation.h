// Evaluates YAML values that change from frame to frame, written `{keys: {FRAME: VALUE, …}}`.
#pragma once

#include "host/import/yaml/fields.h"

// Replaces each such mapping of the reader's tree with its value at the options' frame, a number or a list
// of numbers, and marks the scene as animated. Reports errors and returns false if a mapping cannot be read.
bool yaml_animate(YamlReader *reader);

// Returns whether a node of the tree is a mapping whose `keys` are frames.
bool yaml_has_keys(const YamlReader *reader, const YamlNode *node);
