// A YAML document as a tree of nodes with byte offsets. libfyaml parses it. Aliases share their target's
// children, so that no document expands while it is read.
#pragma once

#include "host/base/array.h"
#include "host/base/stage.h"
#include "host/import/report.h"
#include <stdint.h>

typedef enum { YAML_SCALAR, YAML_SEQUENCE, YAML_MAPPING } YamlType;

// A node. It is small because a scene of ten million spheres has 120 million of them.
typedef struct {
    uint32_t offset, end; // the offsets of its first byte in the source and past its last
    uint32_t next;        // sibling, or 0 for none
    union {
        uint32_t first; // child, or 0 for none
        uint32_t text;  // the start of a scalar's text in the tree's texts
    };
    uint32_t child_count; // a mapping's keys and values both count
    YamlType type;
} YamlNode;

typedef struct {
    ARRAY_OF(YamlNode) nodes; // the root is the first
    Text texts;               // of all scalars, each ended by a NUL
    bool has_aliases;
} YamlTree;

// Adds the nodes of the report's source to the tree, the root first, with offsets that begin at `base`.
// Reports errors and returns false if the text is malformed, empty, nested too deeply, or has several
// documents or tags, or if all texts are larger than 2 GiB. The stage, which may be NULL, is set to the bytes
// that were read.
bool yaml_tree_read(YamlTree *tree, Report *report, size_t base, Stage *stage);
// Adds the value that begins at a byte of the source, and skips the bytes before it.
bool yaml_value_read(YamlTree *tree, Report *report, size_t base, size_t start);
void yaml_tree_free(YamlTree *tree);

// Copies the children of a node if an alias may share them.
void yaml_children_unshare(YamlTree *tree, uint32_t node);

// Returns the node of an index. It moves when nodes are added.
static inline YamlNode *yaml_node(const YamlTree *tree, uint32_t index)
{
    return &tree->nodes.items[index];
}

// Returns the next child, or NULL at the end. A mapping's children are key, value, key, value …
const YamlNode *yaml_first(const YamlTree *tree, const YamlNode *node);
const YamlNode *yaml_next(const YamlTree *tree, const YamlNode *node);

// Returns the text of a scalar, or "" for a list or a mapping.
const char *yaml_text(const YamlTree *tree, const YamlNode *node);
// Returns whether the node is a scalar with the text, which is not empty.
bool yaml_is(const YamlTree *tree, const YamlNode *node, const char *text);
