// Describes a command's results as rows, and reads their columns from the command's JSON.
#pragma once

#include "host/base/array.h"
#include "host/base/text.h"
#include <jansson.h>

enum { RESULT_NAMES_MAX = 9, RESULT_VALUES_MAX = 18, RESULT_EXTRAS_MAX = 6 };

typedef struct {
    const char *command;
    // The path of the array of rows, such as "scenes.variants" for one array in each object of another. If it
    // is "", the document is the only row.
    const char *rows;
    // The columns that name a row, its values, and those that the text leaves out, each up to NULL, as "path"
    // or "heading=path". The path names a member, with dots between members, such as "frame_ms.median". It is
    // looked up in the row, then in the object whose array has the row, then in the document. The value of an
    // object is its "ratio". An object with a "reason" stands for a value that is not available.
    const char *names[RESULT_NAMES_MAX + 1], *values[RESULT_VALUES_MAX + 1], *extras[RESULT_EXTRAS_MAX + 1];
    // The paths of verdicts, up to NULL, and the value with which a row has failed: "true", "false" or a
    // text. The first verdict that the row has counts.
    const char *verdicts[2], *failed;
    // The paths of times in milliseconds for FORMAT_BENCHMARK, one per row or one per run, or NULL if the
    // command measures none.
    const char *times, *processor_times;
    const char *seconds; // the path of the seconds that the row took, for FORMAT_JUNIT, or NULL
    bool is_one_table;   // whether the text has one table instead of one for each scene and size
} ResultTable;

// A row with the objects that its columns may come from.
typedef struct {
    const json_t *sources[3]; // the row, the object around it, the document
} ResultRow;

typedef struct {
    ARRAY_OF(ResultRow);
} ResultRows;

// Returns the rows of a document, which must outlive them. The caller frees the items.
ResultRows result_rows(const json_t *document, const ResultTable *table);
// Returns the reason why a row is not available, or NULL.
const char *row_unavailable(const ResultRow *row);
// Returns a member of an object by its path, or NULL.
const json_t *member_at(const json_t *object, const char *path);
const json_t *value_at(const ResultRow *row, const char *path);

// Returns the column at an index, at which names precede values and these the extras, or NULL past the last.
const char *column_at(const ResultTable *table, size_t index);
ShortText column_heading(const char *column);
const json_t *column_value(const ResultRow *row, const char *column);
// Returns the value as a text, which is empty if there is none. The caller frees it.
Text column_text(const ResultRow *row, const char *column);
// Returns the value as column_text does, but a real number with about four digits, and the size of a path
// that ends in "_bytes" in the unit that suits it, or "unknown" for 0.
Text column_text_short(const ResultRow *row, const char *column);
void value_append(Text *text, const json_t *value);
