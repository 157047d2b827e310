// The source is cut before lines that look like items of the list `objects`. The first and last items are
// parsed with the rest of the source, and each part between them as a separate list, together with the first
// character of the item after it. A cut is valid if the parser finds an item of the list exactly there on
// both sides. Then it is in the same state at the cut as in the whole source, so that the nodes are the same.
#include "host/import/yaml/parts.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/import/yaml/parse.h"
#include <ctype.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { INDENT_MAX = 64 };

static const size_t dash_length = sizeof "- " - 1;

typedef struct {
    size_t indent;
    ARRAY_OF(size_t) offsets; // of lines that begin parts, and of the last item's line
} Cuts;

static size_t text_line_next(const Source *source, size_t at)
{
    const char *end = memchr(source->bytes + at, '\n', source->length - at);
    return end ? (size_t)(end - source->bytes) + 1 : source->length;
}

static bool begins_with(const Source *source, size_t at, const char *text)
{
    const size_t length = strlen(text);
    return source->length - at >= length && memcmp(source->bytes + at, text, length) == 0;
}

// Returns the offset of the first byte that is not a space, or the source's length.
static size_t spaces_skip(const Source *source, size_t at)
{
    while (at < source->length && source->bytes[at] == ' ')
        at++;
    return at;
}

// Returns whether `- ` and a word begin at an offset.
static bool is_item(const Source *source, size_t at)
{
    return begins_with(source, at, "- ") && at + dash_length < source->length &&
           isalnum((unsigned char)source->bytes[at + dash_length]);
}

// Returns whether the rest of the line is empty or a comment.
static bool rest_is_blank(const Source *source, size_t at)
{
    at = spaces_skip(source, at);
    return at == source->length || strchr("\r\n#", source->bytes[at]);
}

// Returns the offset of the first item's line, or the source's length if no list in block style is found.
static size_t list_find(const Source *source)
{
    static const char key[] = "objects:";
    size_t at = 0;
    while (at < source->length && !begins_with(source, at, key))
        at = text_line_next(source, at);
    if (at == source->length || !rest_is_blank(source, at + strlen(key))) return source->length;
    do
        at = text_line_next(source, at);
    while (at < source->length && rest_is_blank(source, at));
    return begins_with(source, spaces_skip(source, at), "- ") ? at : source->length;
}

// Finds where to cut the list. The guess need not be right, since each cut is tested.
static void cuts_find(Cuts *cuts, const Source *source, size_t part_bytes)
{
    size_t last = 0, at = list_find(source);
    if (at == source->length) return;
    cuts->indent = spaces_skip(source, at) - at;
    while ((at = text_line_next(source, at)) < source->length) {
        if (spaces_skip(source, at) - at == cuts->indent && is_item(source, at + cuts->indent)) {
            last = at;
            if (cuts->offsets.count == 0 || at - cuts->offsets.items[cuts->offsets.count - 1] >= part_bytes)
                array_push(cuts->offsets, at);
        } else if (!strchr(" \t\r\n#-", source->bytes[at])) {
            break; // the next key
        }
    }
    if (cuts->offsets.count > 0 && cuts->offsets.items[cuts->offsets.count - 1] != last)
        array_push(cuts->offsets, last);
}

typedef struct {
    uint32_t first, last, count; // nodes of its items
} Part;

typedef struct {
    YamlTree *tree;
    pthread_mutex_t mutex; // guards the tree
    const Source *source;
    size_t base;
    const Cuts *cuts;
    Part *parts;
    Stage *stage;
    atomic_bool has_failed;
} PartsReader;

// A part is parsed as the list of a key, whose root, key and list are skipped.
enum { PART_LIST = 2, SKIPPED, SKIPPED_TEXT = sizeof "a" };

// Appends the nodes of a part except the root, the key and the list.
static void part_append(YamlTree *tree, const YamlTree *part_tree, Part *part)
{
    const uint32_t moved = (uint32_t)tree->nodes.count - SKIPPED,
                   moved_text = (uint32_t)tree->texts.count - SKIPPED_TEXT;
    const size_t count = part_tree->nodes.count - SKIPPED;
    array_reserve(tree->nodes, count);
    YamlNode *nodes = tree->nodes.items + tree->nodes.count;
    for (size_t i = 0; i < count; i++) {
        YamlNode node = part_tree->nodes.items[SKIPPED + i];
        if (node.next) node.next += moved;
        if (node.type == YAML_SCALAR)
            node.text += moved_text;
        else if (node.first)
            node.first += moved;
        nodes[i] = node;
    }
    tree->nodes.count += count;
    text_append(&tree->texts, part_tree->texts.items + SKIPPED_TEXT, part_tree->texts.count - SKIPPED_TEXT);
    part->first = SKIPPED + moved;
    part->last += moved;
}

// Parses a part as the list of a key, with the buffers `text` and `part_tree`.
static bool part_parse(PartsReader *reader, size_t index, Text *text, YamlTree *part_tree)
{
    static const char key[] = "a:\n";
    const size_t key_length = strlen(key);
    const size_t *ends = &reader->cuts->offsets.items[index];
    const size_t item = ends[1] - ends[0] + reader->cuts->indent + dash_length;
    text->count = part_tree->nodes.count = part_tree->texts.count = 0;
    text_append(text, key, key_length);
    text_append(text, reader->source->bytes + ends[0], item + 1);
    const Source source = {.file = reader->source->file, .bytes = text->items, .length = text->count};
    Report report = report_open(&source, NULL);
    YamlCut cut = {.offset = key_length + item};
    if (!yaml_parse(part_tree, &report, reader->base + ends[0] - key_length, &source, &cut, reader->stage) ||
        cut.list != PART_LIST)
        return false; // the item after it may be in the list of a later key
    reader->parts[index] =
        (Part){.last = cut.last_before, .count = part_tree->nodes.items[cut.list].child_count};
    pthread_mutex_lock(&reader->mutex);
    part_append(reader->tree, part_tree, &reader->parts[index]);
    pthread_mutex_unlock(&reader->mutex);
    return true;
}

static void parts_parse(void *context, size_t begin, size_t end)
{
    PartsReader *reader = context;
    OwnedText text = {0};
    YamlTree part_tree = {0};
    for (size_t i = begin; i < end && !atomic_load(&reader->has_failed); i++)
        if (!part_parse(reader, i, &text, &part_tree)) atomic_store(&reader->has_failed, true);
    yaml_tree_free(&part_tree);
}

// Links the items of the parts into the list before the last item.
static void parts_link(YamlTree *tree, const YamlCut *cut, const Part *parts, size_t count)
{
    YamlNode *nodes = tree->nodes.items;
    const uint32_t last = nodes[cut->last_before].next;
    uint32_t before = cut->last_before;
    for (size_t i = 0; i < count; i++) {
        nodes[before].next = parts[i].first;
        before = parts[i].last;
        nodes[cut->list].child_count += parts[i].count;
    }
    nodes[before].next = last;
}

// Parses the source without the parts.
static bool rest_parse(PartsReader *reader, YamlCut *cut)
{
    const Source *source = reader->source;
    const Cuts *cuts = reader->cuts;
    const size_t start = cuts->offsets.items[0], end = cuts->offsets.items[cuts->offsets.count - 1];
    if (memchr(source->bytes, '%', start)) return false; // it may be a directive that changes the syntax
    *cut = (YamlCut){.offset = start + cuts->indent + dash_length, .gap = end - start};
    OwnedText rest = {0};
    text_append(&rest, source->bytes, start);
    text_append(&rest, source->bytes + end, source->length - end);
    Report report = report_open(source, NULL);
    const Source parsed = {.bytes = rest.items, .length = rest.count};
    return yaml_parse(reader->tree, &report, reader->base, &parsed, cut, reader->stage);
}

bool yaml_parts_read(YamlTree *tree, const Source *source, size_t base, size_t part_bytes, Stage *stage)
{
    if (source->length < 2 * part_bytes) return false;
    Cuts cuts = {0};
    cuts_find(&cuts, source, part_bytes);
    const size_t count = cuts.offsets.count > 0 ? cuts.offsets.count - 1 : 0;
    const YamlTree before = *tree;
    PartsReader reader = {.tree = tree,
                          .mutex = PTHREAD_MUTEX_INITIALIZER,
                          .source = source,
                          .base = base,
                          .cuts = &cuts,
                          .stage = stage};
    YamlCut cut;
    bool is_read = count > 0 && rest_parse(&reader, &cut);
    if (is_read) {
        reader.parts = memory_allocate_zeroed(count, sizeof *reader.parts);
        parallel_run(count, 1, parts_parse, &reader);
        is_read = !atomic_load(&reader.has_failed);
        if (is_read) parts_link(tree, &cut, reader.parts, count);
        free(reader.parts);
    }
    if (!is_read) {
        tree->nodes.count = before.nodes.count;
        tree->texts.count = before.texts.count;
        tree->has_aliases = before.has_aliases;
    }
    free(cuts.offsets.items);
    return is_read;
}
