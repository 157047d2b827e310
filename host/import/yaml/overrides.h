// Replaces values of a YAML document by overrides of the form PATH=VALUE.
#pragma once

#include "host/import/yaml/fields.h"

// Applies, in order, the texts that follow the document in the report's source: replaces the value at each
// PATH of the reader's tree, adds it, or removes it if VALUE is empty. Reports errors and returns false if
// an override does not fit.
bool yaml_override(YamlReader *reader);
