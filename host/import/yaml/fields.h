// Typed access to the mappings of a YAML scene, by tables of fields, with a message for every mistake.
#pragma once

#include "host/import/number.h"
#include "host/import/yaml/tree.h"
#include "host/scene/scene.h"

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

typedef struct {
    const char *name; // in the tree's texts
    uint32_t material;
    size_t offset;
} MaterialName;

typedef struct {
    YamlTree tree;
    Report report;
    Scene *scene;
    struct {
        MaterialName *items;
        size_t count, capacity;
    } names;                   // of materials, sorted
    uint32_t default_material; // UINT32_MAX until an object needs it
} YamlReader;

typedef struct Field Field;

// Reads the value of `field` at `node` to `target`; reports and returns false where it does not fit.
typedef bool FieldReader(YamlReader *reader, const Field *field, const YamlNode *node, void *target);

// The ways a mapping can be written; keys of different forms exclude each other.
typedef enum { FORM_FIRST = 1, FORM_SECOND = 2, FORM_THIRD = 4, FORM_ANY = 7 } Form;

enum { OPTIONAL = false, REQUIRED = true };

struct Field {
    const char *name;
    FieldReader *read;
    size_t offset; // in the struct that the mapping fills
    unsigned forms;
    bool required;      // in its forms
    const Range *range; // of its numbers; NULL: any
};

// Fills `target` from a mapping, called `what` in messages. `form`: which way it is written; may be NULL.
// Fields that are not there are left as they were. True: nothing was reported.
bool fields_read(YamlReader *reader, const YamlNode *mapping, const char *what, const Field *fields,
                 size_t field_count, void *target, Form *form);

// The value of a key that fields_read has seen; the mapping itself if it has not.
const YamlNode *field_node(const YamlReader *reader, const YamlNode *mapping, const char *name);

// Reports and returns false where a key is a list or a mapping.
bool key_is_word(YamlReader *reader, const YamlNode *key);

// The mapping's only key and its value, such as `sphere: {…}`; reports and returns false for anything else.
bool single_pair(YamlReader *reader, const YamlNode *node, const char *expected, const YamlNode **key,
                 const YamlNode **value);

// Values: to a `const YamlNode *`, double, Vector3, Vector3 that is not zero, Color, Color from one or three
// numbers, bool. Numbers keep to the field's range.
FieldReader read_node, read_number, read_vector, read_direction, read_color, read_factors, read_boolean;

// A list of exactly `count` values of `size` bytes, each read by `read`; `what` as in "three numbers".
bool items_read(YamlReader *reader, const Field *field, const YamlNode *node, size_t count, const char *what,
                FieldReader *read, size_t size, void *target);

// `must be …, not 'text'` at the node.
void expected_report(YamlReader *reader, const char *name, const char *expected, const YamlNode *node);
// `unknown kind 'word'`, with the nearest known word where one is near.
void unknown_report(YamlReader *reader, const YamlNode *node, const char *kind, const char *const *known,
                    size_t known_count);
