// Parses YAML into the nodes of a tree, by libfyaml.
#pragma once

#include "host/import/yaml/tree.h"

// The depth of the items of a list that is the value of a key of the root.
enum { YAML_CUT_DEPTH = 2 };

// A place before an item of such a list. If the gap is not 0, the parsed text omits `gap` bytes of the
// source before the item. Otherwise the parsed text consists of earlier items and ends within this one.
typedef struct {
    size_t offset; // of the item in the parsed text
    size_t gap;
    bool is_passed;       // set when the parse reaches the item
    uint32_t list;        // the node of the list
    uint32_t last_before; // the node of the item before the cut
} YamlCut;

// Adds the nodes of `parsed` to the tree, with offsets that begin at `base`. The report's source has the same
// bytes, except those of the cut's gap and blanks. Reports errors and returns false if the text is malformed
// or empty. With a `cut`, which may be NULL, it also returns false, without a message, if the
// cut is not before an item or if a parse that ends there finds anchors. Adds the bytes that are read to the
// stage, which may be NULL.
bool yaml_parse(YamlTree *tree, Report *report, size_t base, const Source *parsed, YamlCut *cut,
                Stage *stage);
