// Reads `include` of YAML scenes, whose materials, definitions, lights and objects come before the scene's.
#pragma once

#include "host/import/yaml/fields.h"

// Adds the files that the reader's tree includes, directly or indirectly, to the tree, to the scene and to
// the sources after `source`, which is the report's. Reports errors and returns false if a file cannot be
// read.
bool yaml_include(YamlReader *reader, Source *source);
void yaml_included_free(YamlReader *reader);
