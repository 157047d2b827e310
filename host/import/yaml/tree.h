// A YAML document as a tree of nodes that know their place. Parsing is libfyaml's; the tree is ours, because
// it keeps byte offsets, and aliases that share what they name, so that no document grows when it is read.
#pragma once

#include "host/base/text.h"
#include "host/import/report.h"
#include <stdint.h>

typedef enum { YAML_SCALAR, YAML_SEQUENCE, YAML_MAPPING } YamlKind;

typedef struct {
    YamlKind kind;
    size_t offset;        // of its first byte in the source
    size_t text;          // scalar: where its text starts in the tree's texts
    uint32_t first, next; // first child, next sibling; 0: none (the root is nobody's child)
    uint32_t child_count; // mapping: keys and values
} YamlNode;

typedef struct {
    struct {
        YamlNode *items;
        size_t count, capacity;
    } nodes;    // the first is the root
    Text texts; // of all scalars, each ended by a NUL
} YamlTree;

// False, with the errors reported: not well-formed, empty, several documents, tags, deeper than any scene
// needs.
bool yaml_tree_read(YamlTree *tree, Report *report);
void yaml_tree_free(YamlTree *tree);

// NULL at the end. A mapping's children are key, value, key, value …
const YamlNode *yaml_first(const YamlTree *tree, const YamlNode *node);
const YamlNode *yaml_next(const YamlTree *tree, const YamlNode *node);

const char *yaml_text(const YamlTree *tree, const YamlNode *scalar);
