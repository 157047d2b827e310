// Writes JSON. Bytes of a text or key that are not UTF-8 become U+FFFD.
// Calls nest: json_begin_object ... json_end.
#pragma once

#include "host/base/text.h"
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct Json Json;

Json *json_open(void);                               // the root is an object
void json_begin_object(Json *json, const char *key); // key NULL: inside an array
void json_begin_array(Json *json, const char *key);
void json_end(Json *json);                                      // ends the innermost object or array
void json_text(Json *json, const char *key, const char *value); // NULL value: null
void json_number(Json *json, const char *key, double value);    // shortest that reads back; NaN, inf: null
void json_count(Json *json, const char *key, uint64_t value);
void json_bool(Json *json, const char *key, bool value);
void json_none(Json *json, const char *key);
// Adds the members that a template of keys and values describes, such as "name %s size [%u %u] error {rmse
// %g}". %s is a text or NULL; %g a number; %d a bool; %u, %zu or PRIu64 a count; "%016" PRIx64 a hash,
// which becomes a text of 16 digits.
void json_addf(Json *json, const char *members, ...) __attribute__((format(printf, 2, 3)));
// Returns the document with one newline at its end, and frees the writer.
Text json_close(Json *json);
// Prints the document and one newline, and frees it. A stream that fails keeps its error, here and below.
void json_print(Json *json, FILE *stream);
// Prints the document on one line at once, and frees it.
void json_print_line(Json *json, FILE *stream);
