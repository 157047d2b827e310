// `include` of YAML scenes: files whose materials, definitions, lights and objects come before the scene's.
#pragma once

#include "host/import/yaml/fields.h"

// Adds the files that the reader's tree includes, and those that they include, to the tree, to the sources
// behind `source`, which is that of the report, and to the scene. Reports errors and returns false if one
// cannot be read.
bool yaml_include(YamlReader *reader, Source *source);
void yaml_included_free(YamlReader *reader);
