#include "host/cli/result_table.h"

#include <math.h>
#include <string.h>

const json_t *member_at(const json_t *object, const char *path)
{
    for (const char *dot; object && (dot = strchr(path, '.')) != NULL; path = dot + 1) {
        char name[64];
        snprintf(name, sizeof name, "%.*s", (int)(dot - path), path);
        object = json_object_get(object, name);
    }
    return json_object_get(object, path);
}

const json_t *value_at(const ResultRow *row, const char *path)
{
    const json_t *value = NULL;
    for (size_t i = 0; i < 3 && !value; i++)
        value = row->sources[i] ? member_at(row->sources[i], path) : NULL;
    return value;
}

void value_append(Text *text, const json_t *value)
{
    json_type type = value ? json_typeof(value) : JSON_NULL;
    switch (type) {
    case JSON_STRING:
        text_append(text, json_string_value(value), json_string_length(value));
        break;
    case JSON_INTEGER:
        text_appendf(text, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
        break;
    case JSON_REAL:
        text_appendf(text, "%s", text_number(json_real_value(value), 1).text);
        break;
    case JSON_TRUE:
    case JSON_FALSE:
        text_appendf(text, json_is_true(value) ? "true" : "false");
        break;
    case JSON_ARRAY: // a size
        for (size_t i = 0; i < json_array_size(value); i++) {
            if (i > 0) text_appendf(text, "x");
            value_append(text, json_array_get(value, i));
        }
        break;
    case JSON_OBJECT: // an estimate with its interval, or a value that is not available
        value_append(text, json_object_get(value, "ratio"));
        break;
    case JSON_NULL:
        break;
    }
}

ShortText column_heading(const char *column)
{
    ShortText heading;
    snprintf(heading.text, sizeof heading.text, "%.*s", (int)strcspn(column, "="), column);
    return heading;
}

const json_t *column_value(const ResultRow *row, const char *column)
{
    const char *equals = strchr(column, '=');
    return value_at(row, equals ? equals + 1 : column);
}

Text column_text(const ResultRow *row, const char *column)
{
    Text text = {0};
    value_append(&text, column_value(row, column));
    return text;
}

const char *column_at(const ResultTable *table, size_t index)
{
    const char *const *const lists[] = {table->names, table->values, table->extras};
    for (size_t i = 0; i < COUNT_OF(lists); i++)
        for (const char *const *column = lists[i]; *column; column++)
            if (index-- == 0) return *column;
    return NULL;
}

// Appends a number with about four digits, as fixed decimals unless these would be many.
static void number_append_short(Text *text, double number)
{
    const double size = fabs(number);
    if (size != 0 && (size < 1e-2 || size >= 1e6)) {
        text_appendf(text, "%.2e", number);
        return;
    }
    const int digits = size >= 1 ? (int)log10(size) + 1 : 0; // before the point
    text_appendf(text, "%.*f", size == 0 || digits > 4 ? 0 : 4 - digits, number);
}

Text column_text_short(const ResultRow *row, const char *column)
{
    Text text = {0};
    const json_t *value = column_value(row, column), *ratio = json_object_get(value, "ratio");
    const char *unit = strrchr(column, '_');
    const json_int_t bytes = json_integer_value(value);
    if (unit && strcmp(unit, "_bytes") == 0)
        text_appendf(&text, "%s", bytes > 0 ? text_size((double)bytes).text : "unknown");
    else if (json_is_real(ratio ? ratio : value))
        number_append_short(&text, json_real_value(ratio ? ratio : value));
    else
        value_append(&text, value);
    return text;
}

const char *row_unavailable(const ResultRow *row)
{
    const json_t *status = json_object_get(row->sources[0], "status");
    const bool is_unavailable =
        json_is_string(status) && strcmp(json_string_value(status), "unavailable") == 0;
    return is_unavailable ? json_string_value(json_object_get(row->sources[0], "reason")) : NULL;
}

ResultRows result_rows(const json_t *document, const ResultTable *table)
{
    ResultRows rows = {0};
    const char *path = table->rows, *dot = strchr(path, '.');
    if (*path == '\0') array_push(rows, ((ResultRow){{document, NULL, NULL}}));
    char name[64];
    snprintf(name, sizeof name, "%.*s", dot ? (int)(dot - path) : (int)strlen(path), path);
    const json_t *outer = json_object_get(document, name);
    for (size_t i = 0; i < json_array_size(outer); i++) {
        const json_t *item = json_array_get(outer, i), *inner = dot ? json_object_get(item, dot + 1) : NULL;
        if (!dot) array_push(rows, ((ResultRow){{item, NULL, document}}));
        for (size_t k = 0; k < json_array_size(inner); k++)
            array_push(rows, ((ResultRow){{json_array_get(inner, k), item, document}}));
    }
    return rows;
}
