// Values that replace those of a YAML document, each given as PATH=VALUE.
#pragma once

#include "host/import/yaml/fields.h"

// Applies, in order, the texts that follow the document in the report's source: replaces the value at each
// PATH of the reader's tree, adds it, or removes it if VALUE is empty. Reports errors and returns false if
// one does not fit.
bool yaml_override(YamlReader *reader);
