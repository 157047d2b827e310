// Prints text in columns.
#pragma once

#include <stdio.h>

enum { TABLE_COLUMNS_MAX = 27 };

// Prints lines of cells, each of which ends with a tab, with every column as wide as its longest cell.
// `alignment` has an 'l' or 'r' for each column, of which there are at most TABLE_COLUMNS_MAX. Text after the
// last tab of a line, or after its last column, does not belong to a column.
void table_print(const char *lines, const char *alignment, FILE *stream);
