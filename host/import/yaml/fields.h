// Reads the mappings of a YAML scene by tables of typed fields, with a message for every mistake.
#pragma once

#include "host/base/array.h"
#include "host/import/load.h"
#include "host/import/number.h"
#include "host/import/place.h"
#include "host/import/yaml/tree.h"
#include "host/scene/scene.h"
#include <stddef.h>

typedef struct {
    const char *name; // in the tree's texts
    uint32_t material;
    size_t offset;
} MaterialName;

// The objects that `define` names. Their meshes belong to the definition.
typedef struct {
    const char *name; // in the tree's texts
    size_t offset;
    Object *objects;
    size_t object_count;
} Definition;

typedef struct {
    YamlTree tree;
    Report report;
    Scene *scene;
    const SceneOptions *options;
    ARRAY_OF(Source *) included;  // texts of files, which follow that of the scene's
    ARRAY_OF(MaterialName) names; // of materials, sorted
    uint32_t default_material;    // UINT32_MAX until an object needs it
    Places places;                // of objects
    ARRAY_OF(Definition) definitions;
    bool warned_of_pattern; // warned once that a transform does not move a pattern
    size_t copy_count;      // objects of definitions, instances and repeated groups
    size_t key_count;       // animation keys that were read
} YamlReader;

typedef struct Field Field;
typedef struct Items Items;

// Reads the value of `field` at `node` into `target`. Reports an error and returns false if the value is
// invalid.
typedef bool FieldReader(YamlReader *reader, const Field *field, const YamlNode *node, void *target);

// A bit set of a mapping's alternative forms. Keys of different forms exclude each other.
typedef unsigned Form;
enum { FORM_FIRST = 1, FORM_SECOND = 2, FORM_THIRD = 4, FORM_FOURTH = 8, FORM_ANY = 15 };

// Bits of a field next to those of its forms.
enum { OPTIONAL = 0, REQUIRED = 16 };

struct Field {
    const char *name;
    FieldReader *read;
    size_t offset;      // in the target struct
    unsigned forms;     // the forms that have this field (0 for all), plus REQUIRED if those forms need it
    const Range *range; // of its values, or NULL for any
    const Items *items; // for read_items
};

// The lists of exactly `count` values of `size` bytes that read_items reads with `read`.
struct Items {
    size_t count;
    const char *what; // such as "three numbers"
    FieldReader *read;
    size_t size;
    const Items *items; // of each value, if `read` is read_items
};

extern const Items two_numbers, three_points;

// Fills `target` from a mapping, called `what` in messages. Missing fields leave their members unchanged.
// Returns the mapping's form, or 0 if it reported an error.
Form fields_read(YamlReader *reader, const YamlNode *mapping, const char *what, const Field *fields,
                 size_t field_count, void *target);

// Returns the value of a key, or the node itself if the key is missing or the node is not a mapping.
const YamlNode *field_node(const YamlReader *reader, const YamlNode *mapping, const char *name);

// Reports an error at field_node's node and returns false.
bool field_fails(YamlReader *reader, const YamlNode *mapping, const char *name, const char *message);

// Reports an error and returns false if a key is a list or a mapping.
bool key_is_word(YamlReader *reader, const YamlNode *key);

// Read a YamlNode pointer, double, Vector3, nonzero Vector3, list of the field's items or bool. Numbers must
// be in the field's range.
FieldReader read_node, read_number, read_vector, read_direction, read_items, read_boolean;

// Read a Color from three numbers, from one for a gray, or from sRGB as "#rrggbb", "#rgb" or a name. Whole
// numbers that look like values from 0 to 255 are an error if one is above 1 in a surface's color, or above
// 31 in a strength, such as a light's.
FieldReader read_color, read_strength;
// Returns whether a color may be written as the text: a name or "#rrggbb".
bool is_color_text(const char *text);

// Reports at an offset that the name of a `type`, such as a material, was defined before, and in which file.
void twice_report(YamlReader *reader, const char *type, const char *name, size_t offset, size_t before);
// Reports `must be …, not 'text'` at the node and returns false.
bool expected_report(YamlReader *reader, const char *name, const char *expected, const YamlNode *node);
// Returns whether the value called `name` is a list or a mapping, as the type demands. Reports an error
// otherwise.
bool node_has_type(YamlReader *reader, const YamlNode *node, YamlType type, const char *name);

// Names that begin `count` items of `size` bytes.
typedef struct {
    const void *items;
    size_t count, size;
} Names;

_Static_assert(offsetof(MaterialName, name) == 0 && offsetof(Definition, name) == 0 &&
                   offsetof(Field, name) == 0,
               "Names reads the name at the beginning of an item");

// Bounds the cost of a wrong name in a hostile file.
enum { NAMES_COMPARED_MAX = 1000 };

// Initializes a list of fields and its count.
#define FIELDS(fields)  fields, COUNT_OF(fields)
#define NAMES_OF(array) ((Names){(array), COUNT_OF(array), sizeof *(array)})

// Returns the index of a name, or the count if it is unknown.
size_t name_find(Names names, const char *name);
// Appends the name that `word` may stand for, if any, and the list of names unless it is long.
void choices_describe(Text *text, const char *word, Names names);
// Reports `unknown type 'word'`, with a suggestion if a name is similar or means the same, and with the
// list of names unless it is long. Returns false.
bool unknown_report(YamlReader *reader, const YamlNode *node, const char *type, Names names);
// Reads a mapping with one key, such as `sphere: {…}`, which names a `type`. Sets *value to the key's value
// and returns the index of the name. Reports an error and returns the count of the names otherwise.
size_t choice_read(YamlReader *reader, const YamlNode *node, const char *type, Names names,
                   const YamlNode **value);
