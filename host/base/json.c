#include "host/base/json.h"
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct Json {
    Text text;
    bool is_empty; // the innermost open container
    bool *items;   // for each open container, whether it is an object
    size_t count, capacity;
};

static int json_output(const char *bytes, size_t length, void *text)
{
    text_append(text, bytes, length);
    return 0;
}

// Writes a text with jansson. jansson does not write numbers, because version 2.14 prints all of them with
// 17 digits or another fixed number of digits.
static void json_quote(Json *json, const char *value)
{
    OwnedText utf8 = {0};
    for (size_t left = strlen(value), size; left; value += size, left -= size) {
        size = text_character_size(value, left);
        text_append(&utf8, size ? value : "\xEF\xBF\xBD", size ? size : 3);
        if (size == 0) size = 1;
    }
    json_t *string = json_stringn_nocheck(text_c(&utf8), utf8.count);
    if (!string || json_dump_callback(string, json_output, &json->text, JSON_ENCODE_ANY) != 0)
        fault("out of memory: JSON");
    json_decref(string);
}

static void json_line(Json *json)
{
    text_appendf(&json->text, "\n%*s", (int)(2 * json->count), "");
}

// Writes the separator, indent and key before a value.
static void json_next(Json *json, const char *key)
{
    if (json->count == 0 || json->items[json->count - 1] != (key != NULL))
        fault("JSON: %s", key ? "a key outside an object" : "an object's value without a key");
    if (!json->is_empty) text_append(&json->text, ",", 1);
    json->is_empty = false;
    json_line(json);
    if (!key) return;
    json_quote(json, key);
    text_append(&json->text, ": ", 2);
}

static void json_begin(Json *json, bool is_object)
{
    text_append(&json->text, is_object ? "{" : "[", 1);
    array_push(*json, is_object);
    json->is_empty = true;
}

Json *json_open(void)
{
    Json *json = memory_allocate_zeroed(1, sizeof *json);
    json_begin(json, true);
    return json;
}

void json_begin_object(Json *json, const char *key)
{
    json_next(json, key);
    json_begin(json, true);
}

void json_begin_array(Json *json, const char *key)
{
    json_next(json, key);
    json_begin(json, false);
}

void json_end(Json *json)
{
    if (json->count == 0) fault("JSON: nothing is open");
    bool is_object = json->items[--json->count];
    if (!json->is_empty) json_line(json);
    json->is_empty = false;
    text_append(&json->text, is_object ? "}" : "]", 1);
}

static void json_word(Json *json, const char *key, const char *word)
{
    json_next(json, key);
    text_append(&json->text, word, strlen(word));
}

void json_text(Json *json, const char *key, const char *value)
{
    if (!value) {
        json_none(json, key);
        return;
    }
    json_next(json, key);
    json_quote(json, value);
}

void json_number(Json *json, const char *key, double value)
{
    json_word(json, key, isfinite(value) ? text_number(value, 1).text : "null");
}

void json_count(Json *json, const char *key, uint64_t value)
{
    char word[32];
    snprintf(word, sizeof word, "%" PRIu64, value);
    json_word(json, key, word);
}

void json_bool(Json *json, const char *key, bool value)
{
    json_word(json, key, value ? "true" : "false");
}

void json_none(Json *json, const char *key)
{
    json_word(json, key, "null");
}

// Skips a conversion if the template continues with it.
static bool template_skip(const char **members, const char *conversion)
{
    const size_t length = strlen(conversion);
    if (strncmp(*members, conversion, length) != 0) return false;
    *members += length;
    return true;
}

// Adds the next of the values, whose conversion starts at the template's `%`, and skips the conversion.
static void json_value(Json *json, const char *key, const char **members, va_list *values)
{
    char hash[17];
    if (template_skip(members, "%s")) {
        json_text(json, key, va_arg(*values, const char *));
    } else if (template_skip(members, "%g")) {
        json_number(json, key, va_arg(*values, double));
    } else if (template_skip(members, "%d")) {
        json_bool(json, key, va_arg(*values, int));
    } else if (template_skip(members, "%u")) {
        json_count(json, key, va_arg(*values, unsigned));
    } else if (template_skip(members, "%zu")) {
        const size_t count = va_arg(*values, size_t);
        json_count(json, key, count);
    } else if (template_skip(members, "%" PRIu64)) {
        json_count(json, key, va_arg(*values, uint64_t));
    } else if (template_skip(members, "%016" PRIx64)) {
        snprintf(hash, sizeof hash, "%016" PRIx64, va_arg(*values, uint64_t));
        json_text(json, key, hash);
    } else {
        fault("JSON: the template has an unknown conversion: %s", *members);
    }
}

void json_addf(Json *json, const char *members, ...)
{
    char text[64];
    size_t length;
    const char *key = NULL;
    va_list values;
    va_start(values, members);
    while (*members != '\0') {
        switch (*members) {
        case ' ':
            members++;
            break;
        case '{':
        case '[':
            json_next(json, key);
            json_begin(json, *members++ == '{');
            key = NULL;
            break;
        case '}':
        case ']':
            json_end(json);
            members++;
            break;
        case '%':
            json_value(json, key, &members, &values);
            key = NULL;
            break;
        default:
            length = strcspn(members, " ");
            if (length >= sizeof text) fault("JSON: a key of the template is too long: %s", members);
            snprintf(text, sizeof text, "%.*s", (int)length, members);
            key = text;
            members += length;
        }
    }
    va_end(values);
}

Text json_close(Json *json)
{
    while (json->count)
        json_end(json);
    text_append(&json->text, "\n", 1);
    const Text text = json->text;
    free(json->items);
    free(json);
    return text;
}

void json_print(Json *json, FILE *stream)
{
    OwnedText text = json_close(json);
    fwrite(text.items, 1, text.count, stream);
}

void json_print_line(Json *json, FILE *stream)
{
    OwnedText text = json_close(json);
    // jansson escapes line breaks in texts, so an indent follows each newline here
    for (const char *line = text_c(&text); *line; line += strspn(line, "\n ")) {
        const size_t length = strcspn(line, "\n");
        fwrite(line, 1, length, stream);
        line += length;
    }
    fputc('\n', stream);
    fflush(stream);
}
