// Prints a command's results as tables of text.
#pragma once

#include "host/cli/result_table.h"
#include <stdio.h>

// Appends lines below the row with this index in result_rows, each ended by a newline.
typedef void RowNotes(const void *context, size_t row, Text *notes);

// Prints one table for each run of rows whose first two names, a scene and its size, are the same. Its
// heading line has these and the names that all its rows share. Columns without a value are left out. A row
// that is not available has its reason instead of values. The reasons for missing values follow the table.
void result_text_print(const json_t *document, const ResultTable *table, RowNotes *notes, const void *context,
                       FILE *stream);
