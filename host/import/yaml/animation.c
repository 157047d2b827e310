#include "host/import/yaml/animation.h"
#include "host/base/array.h"

#include <stdlib.h>
#include <string.h>

// KEYS_MAX bounds the time that a document takes whose aliases name the same keys again and again.
enum { NUMBERS_MAX = 16, KEYS_MAX = 1 << 20 };

typedef enum { EASE_LINEAR, EASE_SMOOTH, EASE_STEP, EASE_COUNT } Ease;
static const char *const ease_names[EASE_COUNT] = {"linear", "smooth", "step"};

typedef struct {
    double frame;
    uint32_t node;
} Key;

typedef struct {
    Key *items;
    size_t count, capacity;
} Keys;

static const YamlNode *node_at(const YamlReader *reader, uint32_t index)
{
    return &reader->tree.nodes.items[index];
}

static bool node_number(const YamlReader *reader, const YamlNode *node, double *value)
{
    if (node->kind != YAML_SCALAR) return false;
    const char *text = yaml_text(&reader->tree, node);
    return number_read(text, strlen(text), value) == NUMBER_READ;
}

// Returns the mapping of frames, or NULL if the node is not animated. A material may be called `keys`, but
// its own keys are not numbers.
static const YamlNode *frames_of(const YamlReader *reader, const YamlNode *node)
{
    const YamlTree *tree = &reader->tree;
    if (node->kind != YAML_MAPPING || node->child_count > 4) return NULL;
    for (const YamlNode *key = yaml_first(tree, node); key; key = yaml_next(tree, yaml_next(tree, key))) {
        if (key->kind != YAML_SCALAR || strcmp(yaml_text(tree, key), "keys") != 0) continue;
        const YamlNode *frames = yaml_next(tree, key);
        const YamlNode *first = frames->kind == YAML_MAPPING ? yaml_first(tree, frames) : NULL;
        double frame;
        return first && node_number(reader, first, &frame) ? frames : NULL;
    }
    return NULL;
}

// Returns whether two values are numbers, or lists of as many numbers.
static bool values_match(YamlReader *reader, const YamlNode *a, const YamlNode *b)
{
    const YamlTree *tree = &reader->tree;
    double number;
    bool match = node_number(reader, a, &number) && node_number(reader, b, &number);
    if (a->kind == YAML_SEQUENCE && b->kind == YAML_SEQUENCE) {
        match = a->child_count == b->child_count && a->child_count <= NUMBERS_MAX;
        for (a = yaml_first(tree, a); a && match; a = yaml_next(tree, a))
            match = node_number(reader, a, &number);
        for (const YamlNode *child = yaml_first(tree, b); child && match; child = yaml_next(tree, child))
            match = node_number(reader, child, &number);
    }
    return match ||
           report_error(&reader->report, b->offset,
                        "the values of 'keys' must be numbers, or lists of as many, at most %d", NUMBERS_MAX);
}

// Reads the keys, which the caller frees.
static bool keys_read(YamlReader *reader, const YamlNode *frames, Keys *keys)
{
    const YamlTree *tree = &reader->tree;
    const YamlNode *before = NULL;
    for (const YamlNode *name = yaml_first(tree, frames); name;) {
        const YamlNode *value = yaml_next(tree, name);
        Key key = {.node = (uint32_t)(value - tree->nodes.items)};
        if (!node_number(reader, name, &key.frame))
            return report_error(&reader->report, name->offset, "expected the number of a frame");
        if (keys->count > 0 && key.frame <= keys->items[keys->count - 1].frame)
            return report_error(&reader->report, name->offset, "frames must ascend");
        if (++reader->key_count > KEYS_MAX)
            return report_error(&reader->report, name->offset, "more than %d keys", KEYS_MAX);
        if (!values_match(reader, before ? before : value, value)) return false;
        array_push(*keys, key);
        before = value;
        name = yaml_next(tree, value);
    }
    return true;
}

static bool ease_read(YamlReader *reader, const YamlNode *node, Ease *ease)
{
    const YamlTree *tree = &reader->tree;
    *ease = EASE_LINEAR;
    for (const YamlNode *key = yaml_first(tree, node); key; key = yaml_next(tree, yaml_next(tree, key))) {
        const YamlNode *value = yaml_next(tree, key);
        if (key->kind == YAML_SCALAR && strcmp(yaml_text(tree, key), "keys") == 0) continue;
        if (key->kind != YAML_SCALAR || strcmp(yaml_text(tree, key), "ease") != 0)
            return report_error(&reader->report, key->offset, "beside 'keys' there may be 'ease' only");
        size_t i = 0;
        while (i < EASE_COUNT &&
               (value->kind != YAML_SCALAR || strcmp(yaml_text(tree, value), ease_names[i]) != 0))
            i++;
        if (i == EASE_COUNT) return expected_report(reader, "ease", "linear, smooth or step", value);
        *ease = (Ease)i;
    }
    return true;
}

// Adds a number, `part` of the way between two, and returns its index.
static uint32_t number_between(YamlReader *reader, const YamlNode *a, const YamlNode *b, double part)
{
    YamlTree *tree = &reader->tree;
    double from = 0, to = 0;
    node_number(reader, a, &from);
    node_number(reader, b, &to);
    YamlNode node = *a;
    node.next = 0;
    node.text = (uint32_t)tree->texts.count;
    text_appendf(&tree->texts, "%.17g", from + part * (to - from));
    text_append(&tree->texts, "", 1);
    array_push(tree->nodes, node);
    return (uint32_t)(tree->nodes.count - 1);
}

// Adds the value between two and returns its index.
static uint32_t value_between(YamlReader *reader, uint32_t a, uint32_t b, double part)
{
    if (node_at(reader, a)->kind == YAML_SCALAR)
        return number_between(reader, node_at(reader, a), node_at(reader, b), part);
    YamlTree *tree = &reader->tree;
    const YamlNode list = *node_at(reader, a);
    array_push(tree->nodes, list);
    const uint32_t index = (uint32_t)(tree->nodes.count - 1);
    uint32_t last = 0;
    for (a = list.first, b = node_at(reader, b)->first; a;
         a = node_at(reader, a)->next, b = node_at(reader, b)->next) {
        const uint32_t child = number_between(reader, node_at(reader, a), node_at(reader, b), part);
        *(last ? &tree->nodes.items[last].next : &tree->nodes.items[index].first) = child;
        last = child;
    }
    return index;
}

// Returns the index of the value at a frame: that of the first or the last key beyond them.
static uint32_t keys_value(YamlReader *reader, const Keys *keys, Ease ease, double frame)
{
    size_t next = 0;
    while (next < keys->count && keys->items[next].frame <= frame)
        next++;
    if (next == 0) return keys->items[0].node;
    const Key *before = &keys->items[next - 1];
    if (next == keys->count || before->frame == frame || ease == EASE_STEP) return before->node;
    double part = (frame - before->frame) / (before[1].frame - before->frame);
    if (ease == EASE_SMOOTH) part = part * part * (3 - 2 * part);
    return value_between(reader, before->node, before[1].node, part);
}

static bool node_animate(YamlReader *reader, uint32_t index, const YamlNode *frames)
{
    Keys keys = {0};
    Ease ease;
    const bool is_read = keys_read(reader, frames, &keys) && ease_read(reader, node_at(reader, index), &ease);
    if (is_read) {
        YamlNode value = *node_at(reader, keys_value(reader, &keys, ease, reader->options->frame));
        value.next = node_at(reader, index)->next;
        reader->tree.nodes.items[index] = value;
        reader->scene->is_animated = true;
        reader->scene->frame = reader->options->frame;
    }
    free(keys.items);
    return is_read;
}

bool yaml_animate(YamlReader *reader)
{
    bool all_read = true;
    const size_t count = reader->tree.nodes.count; // later ones are values
    for (uint32_t i = 0; i < count; i++) {
        const YamlNode *frames = frames_of(reader, node_at(reader, i));
        if (frames) all_read &= node_animate(reader, i, frames);
    }
    return all_read;
}
