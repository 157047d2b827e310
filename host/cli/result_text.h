// Prints a command's results as tables of text.
#pragma once

#include "host/cli/result_table.h"
#include <stdio.h>

// Appends lines below the row with this index in result_rows, each ended by a newline.
typedef void RowNotes(const void *context, size_t row, Text *notes);

// Prints one table for each run of rows whose first two names, a scene and its size, are the same, or one for
// all rows if the table's is_one_table is set. Its heading line has the names that all its rows share, unless
// rows have only one name. Names that belong to the object around rows are in the first of these rows only.
// Columns without a value are left out. A row that is not available has its reason instead of values. The
// reasons for missing values follow the table. `notes` may be NULL.
void result_text_print(const json_t *document, const ResultTable *table, RowNotes *notes, const void *context,
                       FILE *stream);
