#include "host/import/yaml/fields.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

// A message lists at most LISTED_MAX names.
enum { FIELDS_MAX = 32, LISTED_MAX = 20 };

bool expected_report(YamlReader *reader, const char *name, const char *expected, const YamlNode *node)
{
    char found[WORD_SHOWN + sizeof "''"];
    if (node->type == YAML_MAPPING)
        snprintf(found, sizeof found, "a mapping");
    else if (node->type == YAML_SEQUENCE)
        snprintf(found, sizeof found, "a list of %u", node->child_count);
    else if (yaml_text(&reader->tree, node)[0] == '\0')
        return report_error(&reader->report, node->offset, "'%s' must be %s, but it is empty", name,
                            expected);
    else
        snprintf(found, sizeof found, "'%.*s'", WORD_SHOWN, yaml_text(&reader->tree, node));
    return report_error(&reader->report, node->offset, "'%s' must be %s, not %s", name, expected, found);
}

// Words of other programs and glint's names for them.
static const struct {
    const char *word, *known;
} synonyms[] = {
    {"albedo", "color"},  {"ball", "sphere"},    {"circle", "disc"},     {"cube", "box"},
    {"cuboid", "box"},    {"donut", "torus"},    {"eye", "position"},    {"floor", "plane"},
    {"ground", "plane"},  {"lookat", "look_at"}, {"sun", "directional"}, {"target", "look_at"},
    {"texture", "image"},
};

bool node_has_type(YamlReader *reader, const YamlNode *node, YamlType type, const char *name)
{
    return node->type == type ||
           expected_report(reader, name, type == YAML_SEQUENCE ? "a list" : "a mapping", node);
}

static const char *name_at(Names names, size_t index)
{
    return *(const char *const *)((const char *)names.items + index * names.size);
}

size_t name_find(Names names, const char *name)
{
    size_t index = 0;
    while (index < names.count && strcmp(name_at(names, index), name) != 0)
        index++;
    return index;
}

// Returns the name that `word` may stand for, or NULL.
static const char *name_meant(const char *word, Names names)
{
    const char *compared[NAMES_COMPARED_MAX];
    size_t count = 0;
    for (size_t i = 0; i < COUNT_OF(synonyms); i++)
        if (!strcasecmp(word, synonyms[i].word) && name_find(names, synonyms[i].known) < names.count)
            return synonyms[i].known;
    for (; count < NAMES_COMPARED_MAX && count < names.count; count++)
        compared[count] = name_at(names, count);
    return strlen(word) <= WORD_SHOWN ? text_nearest(word, compared, count) : NULL;
}

void choices_describe(Text *text, const char *word, Names names)
{
    const char *meant = name_meant(word, names);
    if (meant) text_appendf(text, "; did you mean '%.*s'?", WORD_SHOWN, meant);
    if (names.count < 2 || names.count > LISTED_MAX) return;
    text_appendf(text, meant ? " The choices are " : "; the choices are ");
    for (size_t i = 0; i < names.count; i++)
        text_appendf(text, "%s%.*s", i > 0 ? ", " : "", WORD_SHOWN, name_at(names, i));
}

bool unknown_report(YamlReader *reader, const YamlNode *node, const char *type, Names names)
{
    const char *word = yaml_text(&reader->tree, node);
    OwnedText choices = {0};
    choices_describe(&choices, word, names);
    return report_error(&reader->report, node->offset, "unknown %s '%.*s'%s", type, WORD_SHOWN, word,
                        text_c(&choices));
}

void twice_report(YamlReader *reader, const char *type, const char *name, size_t offset, size_t before)
{
    const Source *source = reader->report.source;
    size_t in_file = offset, before_in_file = before;
    if (source_at(source, &in_file) == source_at(source, &before_in_file)) {
        report_error(&reader->report, offset, "%s '%.*s' is given twice", type, WORD_SHOWN, name);
        return;
    }
    OWNED char *place = message_place_text(source, before);
    report_error(&reader->report, offset, "%s '%.*s' is already given at %s", type, WORD_SHOWN, name, place);
}

static bool unknown_field_report(YamlReader *reader, const YamlNode *key, const char *what, Names names)
{
    char type[64];
    snprintf(type, sizeof type, "%s key", what);
    return unknown_report(reader, key, type, names);
}

bool key_is_word(YamlReader *reader, const YamlNode *key)
{
    return key->type == YAML_SCALAR ||
           report_error(&reader->report, key->offset, "a key must be a plain word or a string in quotes");
}

static Form field_forms(const Field *field)
{
    const Form forms = field->forms & FORM_ANY;
    return forms ? forms : FORM_ANY;
}

// Restricts `forms` to those that the key allows. Reports an error and returns false if none remains; `seen`
// marks the fields before the key.
static bool form_narrow(YamlReader *reader, const YamlNode *key, const Field *field, const Field *fields,
                        const bool *seen, Form *forms)
{
    if (*forms & field_forms(field)) {
        *forms &= field_forms(field);
        return true;
    }
    const Field *other = fields;
    while (!seen[other - fields] || (field_forms(other) & field_forms(field)))
        other++;
    return report_error(&reader->report, key->offset, "'%s' cannot be combined with '%s'", field->name,
                        other->name);
}

Form fields_read(YamlReader *reader, const YamlNode *mapping, const char *what, const Field *fields,
                 size_t field_count, void *target)
{
    const Names names = {fields, field_count, sizeof *fields};
    if (!node_has_type(reader, mapping, YAML_MAPPING, what)) return false;
    bool seen[FIELDS_MAX] = {false}, meant[FIELDS_MAX + 1] = {false}, all_read = true, is_mixed = false;
    Form forms = FORM_ANY;
    const YamlNode *value;
    for (const YamlNode *key = yaml_first(&reader->tree, mapping); key && !report_is_full(&reader->report);
         key = yaml_next(&reader->tree, value)) {
        value = yaml_next(&reader->tree, key);
        size_t index = name_find(names, yaml_text(&reader->tree, key));
        const Field *field = &fields[index];
        if (index == field_count) {
            all_read = key_is_word(reader, key) && unknown_field_report(reader, key, what, names);
            const char *name = name_meant(yaml_text(&reader->tree, key), names);
            meant[name ? name_find(names, name) : field_count] = true;
        } else if (seen[index])
            all_read = report_error(&reader->report, key->offset, "'%s' is given twice", field->name);
        else if (form_narrow(reader, key, field, fields, seen, &forms))
            all_read &= field->read(reader, field, value, (char *)target + field->offset);
        else
            is_mixed = true;
        if (index < field_count) seen[index] = true;
    }
    const Form chosen = forms & -forms; // the first
    for (size_t i = 0; i < field_count && !is_mixed; i++)
        if ((fields[i].forms & REQUIRED) && (field_forms(&fields[i]) & chosen) && !seen[i] &&
            !meant[i]) // whose wrong spelling was reported
            all_read =
                report_error(&reader->report, mapping->offset, "the %s lacks '%s'", what, fields[i].name);
    return all_read && !is_mixed ? chosen : 0;
}

const YamlNode *field_node(const YamlReader *reader, const YamlNode *mapping, const char *name)
{
    if (mapping->type != YAML_MAPPING) return mapping;
    const YamlNode *value;
    for (const YamlNode *key = yaml_first(&reader->tree, mapping); key;
         key = yaml_next(&reader->tree, value)) {
        value = yaml_next(&reader->tree, key);
        if (yaml_is(&reader->tree, key, name)) return value;
    }
    return mapping;
}

bool field_fails(YamlReader *reader, const YamlNode *mapping, const char *name, const char *message)
{
    return report_error(&reader->report, field_node(reader, mapping, name)->offset, "%s", message);
}

size_t choice_read(YamlReader *reader, const YamlNode *node, const char *type, Names names,
                   const YamlNode **value)
{
    if (node->type != YAML_MAPPING || node->child_count != 2) {
        report_error(&reader->report, node->offset, "an item must be one %s, such as `%s: {...}`", type,
                     name_at(names, 0));
        return names.count;
    }
    const YamlNode *key = yaml_first(&reader->tree, node);
    *value = yaml_next(&reader->tree, key);
    const size_t index = name_find(names, yaml_text(&reader->tree, key));
    if (index == names.count && key_is_word(reader, key)) unknown_report(reader, key, type, names);
    return index;
}

bool read_node(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    (void)reader, (void)field;
    *(const YamlNode **)target = node;
    return true;
}

bool read_number(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    if (node->type != YAML_SCALAR) return expected_report(reader, field->name, "a number", node);
    const char *text = yaml_text(&reader->tree, node);
    const Word word = {text, node->offset, strlen(text)};
    return number_read_field(&reader->report, word, field->name, field->range, target);
}

const Items two_numbers = {2, "two numbers", read_number, sizeof(double)},
            three_points = {3, "three points", read_vector, sizeof(Vector3)};

bool read_items(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    const Items *items = field->items;
    Field item_field = *field;
    item_field.items = items->items;
    if (node->type != YAML_SEQUENCE || node->child_count != items->count)
        return expected_report(reader, field->name, items->what, node);
    bool all_read = true;
    char *place = target;
    for (const YamlNode *item = yaml_first(&reader->tree, node); item;
         item = yaml_next(&reader->tree, item), place += items->size)
        all_read &= items->read(reader, &item_field, item, place);
    return all_read;
}

bool read_vector(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Items three_numbers = {3, "three numbers", read_number, sizeof(double)};
    double values[3];
    Field list = *field;
    list.items = &three_numbers;
    if (!read_items(reader, &list, node, values)) return false;
    *(Vector3 *)target = (Vector3){values[0], values[1], values[2]};
    return true;
}

bool read_direction(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    return read_vector(reader, field, node, target) &&
           (!vector_is_zero(*(const Vector3 *)target) ||
            report_error(&reader->report, node->offset, "'%s' must not be zero", field->name));
}

bool read_boolean(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    const bool is_true = yaml_is(&reader->tree, node, "true");
    if (!is_true && !yaml_is(&reader->tree, node, "false"))
        return expected_report(reader, field->name, "true or false", node);
    *(bool *)target = is_true;
    return true;
}
