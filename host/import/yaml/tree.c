#include "host/import/yaml/tree.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/yaml/parse.h"
#include "host/import/yaml/parts.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

// Bounds the offsets to 32 bits. Those of texts may be twice as large, because a NUL ends each text.
static const size_t source_length_max = (size_t)1 << 31;

// Returns whether all of eight bytes are ASCII characters other than NUL.
static bool are_ascii(const char *bytes)
{
    const uint64_t ones = 0x0101010101010101;
    uint64_t eight;
    memcpy(&eight, bytes, sizeof eight);
    return ((eight | (eight - ones)) & (ones << 7)) == 0;
}

// Returns whether the source is UTF-8 without NUL, and reports an error otherwise. On other bytes libfyaml
// 0.7 stops or never returns.
static bool source_is_text(const Source *source, Report *report)
{
    for (size_t at = 0, size; at < source->length; at += size) {
        size = sizeof(uint64_t);
        if (source->length - at >= size && are_ascii(source->bytes + at)) continue;
        size = text_character_size(source->bytes + at, source->length - at);
        if (!size || !source->bytes[at])
            return report_error(report, at, "the file must be UTF-8 text without NUL characters");
    }
    return true;
}

static bool character_is_space(char character)
{
    return character == ' ' || character == '\t' || character == '\r' || character == '\n';
}

// Returns whether a '?' between blanks may begin a key, because indicators, an anchor or a tag, or nothing is
// before it in its line.
static bool may_begin_key(const char *start, const char *at)
{
    while (at > start && (at[-1] == ' ' || at[-1] == '\t'))
        at--;
    if (at == start || !isascii(at[-1]) || strchr("\r\n-?:[{,", at[-1])) return true;
    while (at > start && !character_is_space(at[-1]))
        at--;
    return *at == '&' || *at == '!';
}

// Reports a '?' that may begin a key in a text with tabs, because libfyaml 0.7 frees memory twice at a tab
// after such a key.
static bool source_is_safe(const Source *source, Report *report)
{
    const char *start = source->bytes, *end = start + source->length;
    if (!memchr(start, '\t', source->length)) return true;
    for (const char *at = start; (at = memchr(at, '?', (size_t)(end - at))); at++) {
        const bool is_apart = (at == start || character_is_space(at[-1]) || !isascii(at[-1])) &&
                              (at + 1 == end || character_is_space(at[1]));
        if (is_apart && may_begin_key(start, at))
            return report_error(report, (size_t)(at - start),
                                "a '?' begins a key in a text with tabs; replace the tabs with spaces");
    }
    return true;
}

// Reserves what a large source usually needs, on large pages. Pages take memory once they are written.
static void tree_reserve(YamlTree *tree, size_t length)
{
    enum { BYTES_PER_NODE = 6 };
    if (tree->nodes.items || length < MEMORY_LARGE_MIN) return;
    tree->nodes.capacity = length / BYTES_PER_NODE;
    tree->nodes.items = memory_allocate_large(tree->nodes.capacity, sizeof(YamlNode));
    tree->texts.capacity = length;
    tree->texts.items = memory_allocate_large(length, 1);
}

// Returns whether libfyaml can parse the source, and reports an error otherwise.
static bool source_is_valid(const Source *source, Report *report, size_t base)
{
    if (base > source_length_max || source->length > source_length_max - base)
        return report_error(report, 0, "a scene and its files may have at most 2 GiB");
    return source_is_text(source, report) && source_is_safe(source, report);
}

bool yaml_tree_read(YamlTree *tree, Report *report, size_t base, Stage *stage)
{
    const Source *source = report->source;
    if (!source_is_valid(source, report, base)) return false;
    tree_reserve(tree, source->length);
    if (yaml_parts_read(tree, source, base, YAML_PART_BYTES, stage)) return true;
    stage_set(stage, 0);
    return yaml_parse(tree, report, base, source, NULL, stage);
}

bool yaml_value_read(YamlTree *tree, Report *report, size_t base, size_t start)
{
    const Source *source = report->source;
    OwnedText blanked = {0}; // has the same offsets as the source
    text_append(&blanked, source->bytes, source->length);
    memset(blanked.items, ' ', start);
    const Source parsed = {.bytes = blanked.items, .length = blanked.count};
    return source_is_valid(&parsed, report, base) && yaml_parse(tree, report, base, &parsed, NULL, NULL);
}

void yaml_children_unshare(YamlTree *tree, uint32_t node)
{
    uint32_t last = 0;
    for (uint32_t child = tree->nodes.items[node].first; child && tree->has_aliases;) {
        const YamlNode copy = tree->nodes.items[child];
        const uint32_t index = (uint32_t)tree->nodes.count;
        array_push(tree->nodes, copy);
        *(last ? &tree->nodes.items[last].next : &tree->nodes.items[node].first) = index;
        last = index;
        child = copy.next;
    }
}

void yaml_tree_free(YamlTree *tree)
{
    free(tree->nodes.items);
    text_free(&tree->texts);
    *tree = (YamlTree){0};
}

const YamlNode *yaml_first(const YamlTree *tree, const YamlNode *node)
{
    return node->type != YAML_SCALAR && node->first ? &tree->nodes.items[node->first] : NULL;
}

const YamlNode *yaml_next(const YamlTree *tree, const YamlNode *node)
{
    return node->next ? &tree->nodes.items[node->next] : NULL;
}

const char *yaml_text(const YamlTree *tree, const YamlNode *node)
{
    return node->type == YAML_SCALAR ? tree->texts.items + node->text : "";
}

bool yaml_is(const YamlTree *tree, const YamlNode *node, const char *text)
{
    return strcmp(yaml_text(tree, node), text) == 0;
}
