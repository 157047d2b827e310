// Parses parts of a long list of objects in several threads.
#pragma once

#include "host/import/yaml/tree.h"

// The usual size of a part.
enum { YAML_PART_BYTES = 1 << 20 };

// Adds the nodes of the source to the tree like yaml_tree_read. The items of the block list `objects` at the
// root are parsed in parts of about `part_bytes`, and their nodes may be stored in any order. Returns false
// and leaves the tree unchanged if the source is shorter than two parts, has no such list, or if a part
// cannot be parsed alone.
bool yaml_parts_read(YamlTree *tree, const Source *source, size_t base, size_t part_bytes, Stage *stage);
