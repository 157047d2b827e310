// Evaluates YAML values that change from frame to frame.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/yaml/yaml.h"

#include <stdlib.h>
#include <string.h>

// KEYS_MAX bounds the time for a document whose aliases repeat the same keys many times.
enum { NUMBERS_MAX = 16, KEYS_MAX = 1 << 20 };

typedef enum { EASE_LINEAR, EASE_SMOOTH, EASE_STEP, EASE_COUNT } Ease;
static const char *const ease_names[EASE_COUNT] = {"linear", "smooth", "step"};

typedef struct {
    double frame;
    uint32_t node;
} Key;

typedef ARRAY_OF(Key) Keys;

static bool node_number(const YamlReader *reader, const YamlNode *node, double *value)
{
    const char *text = yaml_text(&reader->tree, node);
    return number_read(text, strlen(text), value) == NUMBER_READ;
}

// Requires the first key under `keys` to be a number, because a material may also be named `keys`.
bool yaml_has_keys(const YamlReader *reader, const YamlNode *node)
{
    const YamlTree *tree = &reader->tree;
    if (node->type != YAML_MAPPING) return false;
    for (const YamlNode *key = yaml_first(tree, node); key; key = yaml_next(tree, yaml_next(tree, key))) {
        if (!yaml_is(tree, key, "keys")) continue;
        const YamlNode *frames = yaml_next(tree, key);
        const YamlNode *first = frames->type == YAML_MAPPING ? yaml_first(tree, frames) : NULL;
        double frame;
        return first && node_number(reader, first, &frame);
    }
    return false;
}

// Returns whether two values are numbers, or lists of equally many numbers.
static bool values_match(YamlReader *reader, const YamlNode *a, const YamlNode *b)
{
    const YamlTree *tree = &reader->tree;
    double number;
    bool match = node_number(reader, a, &number) && node_number(reader, b, &number);
    if (a->type == YAML_SEQUENCE && b->type == YAML_SEQUENCE) {
        match = a->child_count == b->child_count && a->child_count <= NUMBERS_MAX;
        for (a = yaml_first(tree, a); a && match; a = yaml_next(tree, a))
            match = node_number(reader, a, &number);
        for (const YamlNode *child = yaml_first(tree, b); child && match; child = yaml_next(tree, child))
            match = node_number(reader, child, &number);
    }
    return match ||
           report_error(
               &reader->report, b->offset,
               "all values of 'keys' must be numbers, or lists of the same number of numbers, at most %d",
               NUMBERS_MAX);
}

// Reads the keys. The caller frees them.
static bool keys_read(YamlReader *reader, const YamlNode *frames, Keys *keys)
{
    const YamlTree *tree = &reader->tree;
    const YamlNode *before = NULL;
    for (const YamlNode *name = yaml_first(tree, frames); name;) {
        const YamlNode *value = yaml_next(tree, name);
        Key key = {.node = (uint32_t)(value - tree->nodes.items)};
        if (!node_number(reader, name, &key.frame)) return expected_report(reader, "frame", "a number", name);
        if (keys->count > 0 && key.frame <= keys->items[keys->count - 1].frame)
            return report_error(&reader->report, name->offset, "frames must ascend, but %g follows %g",
                                key.frame, keys->items[keys->count - 1].frame);
        if (++reader->key_count > KEYS_MAX)
            return report_error(&reader->report, name->offset, "a scene may have at most %d keys", KEYS_MAX);
        if (!values_match(reader, before ? before : value, value)) return false;
        array_push(*keys, key);
        before = value;
        name = yaml_next(tree, value);
    }
    return true;
}

typedef struct {
    const YamlNode *keys;
    Ease ease;
} Animation;

static bool read_ease(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    const size_t i = name_find(NAMES_OF(ease_names), yaml_text(&reader->tree, node));
    if (i == EASE_COUNT) return expected_report(reader, field->name, "linear, smooth or step", node);
    *(Ease *)target = (Ease)i;
    return true;
}

// Adds the number at fraction `part` between two numbers and returns its index.
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

// Adds the value at fraction `part` between two values and returns its index.
static uint32_t value_between(YamlReader *reader, uint32_t a, uint32_t b, double part)
{
    if (yaml_node(&reader->tree, a)->type == YAML_SCALAR)
        return number_between(reader, yaml_node(&reader->tree, a), yaml_node(&reader->tree, b), part);
    YamlTree *tree = &reader->tree;
    const YamlNode list = *yaml_node(&reader->tree, a);
    array_push(tree->nodes, list);
    const uint32_t index = (uint32_t)(tree->nodes.count - 1);
    uint32_t last = 0;
    for (a = list.first, b = yaml_node(&reader->tree, b)->first; a;
         a = yaml_node(&reader->tree, a)->next, b = yaml_node(&reader->tree, b)->next) {
        const uint32_t child =
            number_between(reader, yaml_node(&reader->tree, a), yaml_node(&reader->tree, b), part);
        *(last ? &tree->nodes.items[last].next : &tree->nodes.items[index].first) = child;
        last = child;
    }
    return index;
}

// Returns the index of the value at a frame. Beyond the keys it is that of the first or the last one.
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

static bool value_animate(YamlReader *reader, uint32_t index)
{
    static const Field fields[] = {
        {"keys", read_node, offsetof(Animation, keys), REQUIRED},
        {"ease", read_ease, offsetof(Animation, ease)},
    };
    OWNED Keys keys = {0};
    Animation animation = {.ease = EASE_LINEAR};
    if (!fields_read(reader, yaml_node(&reader->tree, index), "animation", fields, COUNT_OF(fields),
                     &animation) ||
        !keys_read(reader, animation.keys, &keys))
        return false;
    YamlNode value =
        *yaml_node(&reader->tree, keys_value(reader, &keys, animation.ease, reader->options->frame));
    value.next = yaml_node(&reader->tree, index)->next;
    reader->tree.nodes.items[index] = value;
    reader->scene->animation.has_keys = true;
    reader->scene->animation.frame = reader->options->frame;
    return true;
}

// Animates the values in a node. `visited` has a bit per node, which is set once the children that begin
// there are animated, since aliases may share them. It is NULL if there are no aliases.
static bool node_animate(YamlReader *reader, uint32_t index, uint8_t *visited)
{
    if (yaml_has_keys(reader, yaml_node(&reader->tree, index))) return value_animate(reader, index);
    bool all_read = true;
    const uint32_t first =
        yaml_node(&reader->tree, index)->type == YAML_SCALAR ? 0 : yaml_node(&reader->tree, index)->first;
    if (first > 0 && visited) {
        if (visited[first / 8] >> first % 8 & 1) return true;
        visited[first / 8] |= (uint8_t)(1 << first % 8);
    }
    for (uint32_t child = first; child > 0; child = yaml_node(&reader->tree, child)->next)
        if (yaml_node(&reader->tree, child)->type != YAML_SCALAR)
            all_read &= node_animate(reader, child, visited);
    return all_read;
}

bool yaml_animate(YamlReader *reader)
{
    OWNED uint8_t *visited =
        reader->tree.has_aliases ? memory_allocate_zeroed(reader->tree.nodes.count / 8 + 1, 1) : NULL;
    return node_animate(reader, 0, visited);
}
