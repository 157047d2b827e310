#include "host/cli/table.h"

#include <stdbool.h>
#include <string.h>

void table_print(const char *lines, const char *alignment, FILE *stream)
{
    int widths[TABLE_COLUMNS_MAX] = {0};
    for (int is_measured = 0; is_measured <= 1; is_measured++) {
        size_t column = 0;
        for (const char *cell = lines; *cell != '\0';) {
            if (cell[strspn(cell, "\t")] == '\n') cell += strspn(cell, "\t"); // no blanks at the end
            const int length = (int)strcspn(cell, alignment[column] != '\0' ? "\t\n" : "\n");
            const bool ends_line = cell[length] != '\t';
            if (is_measured) {
                const char *gap = column > 0 && !(ends_line && length == 0) ? "  " : "";
                const char *rest = cell + length;
                const bool is_last = rest[strspn(rest, "\t")] == '\n';
                const int padded = alignment[column] == 'r' ? widths[column] : -widths[column];
                const int width = ends_line || (is_last && padded < 0) ? 0 : padded;
                fprintf(stream, "%s%*.*s%s", gap, width, length, cell, ends_line ? "\n" : "");
            } else if (!ends_line && length > widths[column]) {
                widths[column] = length;
            }
            column = ends_line ? 0 : column + 1;
            cell += cell[length] == '\0' ? length : length + 1;
        }
    }
}
