// Replaces values of a YAML document.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/yaml/yaml.h"

#include <stdlib.h>
#include <string.h>

// The path from the document's root to a node, as far as an override's PATH has been read.
typedef struct {
    YamlTree *tree;
    Report *report; // of the override's text
    const char *text;
    size_t at;         // past the parts that were read
    size_t parent_end; // past the parts before the last one
    size_t base;       // of the text's offsets among those of the document's source
    uint32_t node, parent;
    uint32_t previous; // the parent's child before the node and its key; 0: none
} Path;

// The parts before the last one, in quotes, for printf's %s%.*s%s.
#define PARENT(path)                                                                                         \
    (path)->parent_end > 0 ? "'" : "the ",                                                                   \
        (path)->parent_end > 0 ? (int)(path)->parent_end : (int)strlen("scene"),                             \
        (path)->parent_end > 0 ? (path)->text : "scene", (path)->parent_end > 0 ? "'" : ""

// Adds a scalar without a parent, at an offset of the override's text.
static uint32_t scalar_add(const Path *path, const char *text, size_t offset)
{
    Text *texts = &path->tree->texts;
    const size_t start = path->base + offset;
    const YamlNode node = {.offset = (uint32_t)start,
                           .end = (uint32_t)(start + strlen(text)),
                           .text = (uint32_t)texts->count,
                           .type = YAML_SCALAR};
    text_append(texts, text, strlen(text) + 1);
    array_push(path->tree->nodes, node);
    return (uint32_t)(path->tree->nodes.count - 1);
}

// Appends a child to the path's node, whose last one so far is `last`, or 0 if it is empty.
static void child_append(const Path *path, uint32_t last, uint32_t child)
{
    *(last ? &yaml_node(path->tree, last)->next : &yaml_node(path->tree, path->node)->first) = child;
    yaml_node(path->tree, path->node)->child_count++;
}

// Returns whether the path's node has the type. Reports an error if it does not.
static bool node_is(const Path *path, YamlType type)
{
    static const char *const names[] = {
        [YAML_SCALAR] = "a value", [YAML_SEQUENCE] = "a list", [YAML_MAPPING] = "a mapping"};
    const YamlType found = yaml_node(path->tree, path->node)->type;
    return found == type || report_error(path->report, path->parent_end, "%s%.*s%s is %s, not %s",
                                         PARENT(path), names[found], names[type]);
}

static bool path_report(const Path *path)
{
    return report_error(path->report, path->at,
                        "expected PATH=VALUE, such as camera.fov=60 or objects[0].sphere.radius=2");
}

static bool part_is_last(const Path *path)
{
    return path->text[path->at] == '=';
}

static bool is_blank(const char *text)
{
    return text[strspn(text, " ")] == '\0';
}

// Returns whether the current part may name a new node, because it is the last part and a value follows.
static bool can_add(const Path *path)
{
    return part_is_last(path) && !is_blank(path->text + path->at + 1);
}

// Reports a missing name. A new name within a path is probably a mistake.
static bool missing_report(const Path *path, const char *name, size_t start)
{
    const char *known[NAMES_COMPARED_MAX];
    size_t known_count = 0;
    for (const YamlNode *key = yaml_first(path->tree, yaml_node(path->tree, path->node));
         key && known_count < NAMES_COMPARED_MAX; key = yaml_next(path->tree, yaml_next(path->tree, key)))
        if (key->type == YAML_SCALAR) known[known_count++] = yaml_text(path->tree, key);
    OwnedText choices = {0};
    choices_describe(&choices, name, (Names){known, known_count, sizeof *known});
    return report_error(path->report, start, "%s%.*s%s has no '%.*s'%s%s", PARENT(path), WORD_SHOWN, name,
                        part_is_last(path) ? "" : "; only the last part of a path may be new",
                        text_c(&choices));
}

// Moves the path to a child of its node.
static void path_move(Path *path, uint32_t previous, uint32_t child)
{
    path->parent = path->node;
    path->previous = previous;
    path->node = child;
}

// Moves the path to the value of a key, which is added at the end of the path.
static bool key_follow(Path *path, const char *name, size_t start)
{
    if (!node_is(path, YAML_MAPPING)) return false;
    yaml_children_unshare(path->tree, path->node);
    uint32_t last = 0, key = yaml_node(path->tree, path->node)->first;
    for (; key; key = yaml_node(path->tree, last)->next) {
        if (yaml_is(path->tree, yaml_node(path->tree, key), name)) break;
        last = yaml_node(path->tree, key)->next;
    }
    if (!key) {
        if (!can_add(path)) return missing_report(path, name, start);
        key = scalar_add(path, name, start);
        const uint32_t value = scalar_add(path, "", start);
        child_append(path, last, key);
        child_append(path, key, value);
    }
    path_move(path, last, yaml_node(path->tree, key)->next);
    return true;
}

// Moves the path to an element. The next one is added at the end of the path.
static bool index_follow(Path *path, uint32_t index, size_t start)
{
    if (!node_is(path, YAML_SEQUENCE)) return false;
    const uint32_t count = yaml_node(path->tree, path->node)->child_count;
    if (index > count || (index == count && !can_add(path)))
        return report_error(path->report, start,
                            "%s%.*s%s has no [%u]; it has %u element%s, counted from [0]", PARENT(path),
                            index, count, text_plural(count));
    yaml_children_unshare(path->tree, path->node);
    uint32_t last = 0, child = yaml_node(path->tree, path->node)->first;
    for (uint32_t i = 0; i < index; i++) {
        last = child;
        child = yaml_node(path->tree, child)->next;
    }
    if (index == count) {
        child = scalar_add(path, "", start);
        child_append(path, last, child);
    }
    path_move(path, last, child);
    return true;
}

static bool path_index_read(Path *path)
{
    const size_t start = path->at, digits = strspn(path->text + start + 1, "0123456789");
    path->at += 1 + digits;
    if (digits == 0 || digits > 9 || path->text[path->at] != ']')
        return report_error(path->report, start,
                            "an index must be a whole number from 0 in brackets, such as [0]");
    path->at++;
    return index_follow(path, (uint32_t)strtoul(path->text + start + 1, NULL, 10), start);
}

// Reads a name up to the next part. A quoted name may have any characters but the quote.
static bool path_name_read(Path *path)
{
    const char first = path->text[path->at];
    const bool is_quoted = first == '"' || first == '\'';
    const size_t start = path->at + is_quoted;
    const size_t length = strcspn(path->text + start, is_quoted ? (char[]){first, '\0'} : ".[=");
    path->at = start + length;
    if (length == 0 || (is_quoted && path->text[path->at] != first)) return path_report(path);
    path->at += is_quoted;
    OWNED char *name = memory_copy_part(path->text + start, length);
    return key_follow(path, name, start);
}

// Moves the path to the node that the override's PATH names, and `at` past its `=`.
static bool path_follow(Path *path)
{
    do {
        path->parent_end = path->at;
        const bool is_index = path->text[path->at] == '[';
        if (path->at > 0 && !is_index) {
            if (path->text[path->at] != '.') return path_report(path);
            path->at++;
        }
        if (!(is_index ? path_index_read(path) : path_name_read(path))) return false;
    } while (!part_is_last(path));
    path->at++;
    return true;
}

// Adds the nodes of the VALUE and sets the index of their root. A # begins a color, not a comment.
static bool override_value_read(const Path *path, uint32_t *root)
{
    const size_t start = path->at + strspn(path->text + path->at, " ");
    if (path->text[start] == '#') {
        *root = scalar_add(path, path->text + start, start);
        return true;
    }
    *root = (uint32_t)path->tree->nodes.count;
    return yaml_value_read(path->tree, path->report, path->base, start);
}

static void node_remove(const Path *path)
{
    const uint32_t next = yaml_node(path->tree, path->node)->next;
    YamlNode *parent = yaml_node(path->tree, path->parent);
    *(path->previous ? &yaml_node(path->tree, path->previous)->next : &parent->first) = next;
    parent->child_count -= parent->type == YAML_MAPPING ? 2 : 1;
}

static bool override_apply(YamlTree *tree, Report *report, size_t base)
{
    Path path = {.tree = tree, .report = report, .text = report->source->bytes, .base = base};
    uint32_t value = 0;
    if (!path_follow(&path)) return false;
    if (is_blank(path.text + path.at)) {
        node_remove(&path);
        return true;
    }
    if (!override_value_read(&path, &value)) return false;
    const uint32_t next = yaml_node(path.tree, path.node)->next;
    *yaml_node(path.tree, path.node) = *yaml_node(path.tree, value);
    yaml_node(path.tree, path.node)->next = next;
    return true;
}

bool yaml_override(YamlReader *reader)
{
    bool all_applied = true;
    const Source *text = reader->report.source;
    size_t base = 0;
    for (; text != reader->scene->overrides; text = text->next)
        base += text->length + 1;
    for (; text; text = text->next) {
        MessageList messages = {0};
        const Source alone = {.file = text->file, .bytes = text->bytes, .length = text->length};
        Report report = report_open(&alone, &messages);
        all_applied &= override_apply(&reader->tree, &report, base);
        report_include(&reader->report, &report);
        base += text->length + 1;
    }
    return all_applied;
}
