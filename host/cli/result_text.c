#include "host/cli/result_text.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    GROUP_NAMES = 2,   // how many names have no heading
    HEADING_WIDTH = 9, // up to which words of a heading share a line; most figures are as wide
    HEADING_LINES_MAX = 4,
    COLUMNS_MAX = RESULT_NAMES_MAX + RESULT_VALUES_MAX
};

// The rows of one table.
typedef struct {
    const ResultTable *table;
    const ResultRow *rows;
    size_t count, name_count;
    Text lines, alignment;
    bool is_shown[COLUMNS_MAX];
} RowGroup;

// Returns a name or a value, or NULL past the last value.
static const char *text_column(const RowGroup *group, size_t index)
{
    return index < group->name_count ? group->table->names[index]
                                     : group->table->values[index - group->name_count];
}

static bool rows_share(const ResultRow *a, const ResultRow *b, const char *column)
{
    const json_t *first = column_value(a, column), *second = column_value(b, column);
    return first == second || json_equal(first, second);
}

static bool all_share(const RowGroup *group, const char *column)
{
    for (size_t i = 1; i < group->count; i++)
        if (!rows_share(&group->rows[0], &group->rows[i], column)) return false;
    return true;
}

static const char *missing_reason(const ResultRow *row, const char *column)
{
    return json_string_value(json_object_get(column_value(row, column), "reason"));
}

static bool has_value(const ResultRow *row, const char *column)
{
    const json_t *value = column_value(row, column);
    return value && !json_is_null(value) && !missing_reason(row, column);
}

static bool any_has_value(const RowGroup *group, const char *column)
{
    for (size_t i = 0; i < group->count; i++)
        if (has_value(&group->rows[i], column)) return true;
    return false;
}

static bool any_is_text(const RowGroup *group, const char *column)
{
    for (size_t i = 0; i < group->count; i++)
        if (json_is_string(column_value(&group->rows[i], column))) return true;
    return false;
}

// Appends a text with control characters, which could separate cells, replaced by spaces.
static void plain_append(Text *text, const char *from)
{
    const size_t start = text->count;
    text_append(text, from, strlen(from));
    for (size_t i = start; i < text->count; i++)
        if ((unsigned char)text->items[i] < ' ') text->items[i] = ' ';
}

// Appends a value, of which the empty text shows as "".
static void value_append_plain(Text *text, const ResultRow *row, const char *column)
{
    OwnedText value = column_text_short(row, column);
    plain_append(text, value.count > 0 ? text_c(&value) : "\"\"");
}

static void columns_choose(RowGroup *group)
{
    const char *column;
    for (size_t i = 0; (column = text_column(group, i)); i++) {
        group->is_shown[i] = any_has_value(group, column) &&
                             (i >= group->name_count || group->name_count == 1 || !all_share(group, column));
        if (group->is_shown[i]) text_appendf(&group->alignment, any_is_text(group, column) ? "l" : "r");
    }
}

// Prints the names that all rows share.
static void shared_names_print(const RowGroup *group, FILE *stream)
{
    OwnedText line = {0};
    for (size_t i = 0; i < group->name_count; i++) {
        const char *column = group->table->names[i];
        if (group->is_shown[i] || !any_has_value(group, column)) continue;
        if (line.count > 0) text_appendf(&line, ", ");
        if (i >= GROUP_NAMES) text_appendf(&line, "%s ", column_heading(column).text);
        value_append_plain(&line, &group->rows[0], column);
    }
    if (line.count > 0) fprintf(stream, "\n%s\n", text_c(&line));
}

// Returns the length of the words of a heading that share a line, or of the only word.
static size_t heading_line(const char *heading)
{
    size_t length = strcspn(heading, " ");
    for (size_t next = length; heading[next] != '\0'; length = next) {
        next += 1 + strcspn(heading + next + 1, " ");
        if (next > HEADING_WIDTH) break;
    }
    return length;
}

// Appends the headings, whose lines end at the same one.
static void headings_append(RowGroup *group)
{
    const char *column;
    for (size_t line = HEADING_LINES_MAX; line-- > 0;) {
        const size_t start = group->lines.count;
        bool is_empty = true;
        for (size_t i = 0; (column = text_column(group, i)); i++) {
            if (!group->is_shown[i]) continue;
            const ShortText heading = column_heading(column);
            const char *parts[HEADING_LINES_MAX + 1] = {heading.text};
            size_t count = 0;
            for (const char *part = heading.text; *part && count < HEADING_LINES_MAX; count++) {
                parts[count] = part;
                part += heading_line(part);
                parts[count + 1] = part += *part == ' ';
            }
            if (line < count) {
                const char *part = parts[count - 1 - line];
                text_append(&group->lines, part, heading_line(part));
                is_empty = false;
            }
            text_append(&group->lines, "\t", 1);
        }
        text_append(&group->lines, "\n", 1);
        if (is_empty) group->lines.count = start;
    }
}

static void cell_append(Text *lines, const ResultRow *row, const char *column)
{
    const json_t *value = column_value(row, column), *low = json_object_get(value, "low"),
                 *high = json_object_get(value, "high");
    if (has_value(row, column))
        value_append_plain(lines, row, column);
    else if (value)
        text_appendf(lines, "-");
    if (json_is_number(low) && json_is_number(high))
        text_appendf(lines, " (%.3f to %.3f)", json_number_value(low), json_number_value(high));
    text_append(lines, "\t", 1);
}

// Returns whether a column is a name that belongs to the object around this row and the one above it.
static bool is_repeated(const RowGroup *group, const ResultRow *row, size_t column)
{
    const ResultRow alone = {{row->sources[0]}};
    return column < group->name_count && row > group->rows && row->sources[1] == row[-1].sources[1] &&
           !column_value(&alone, text_column(group, column));
}

static void row_append(RowGroup *group, const ResultRow *row)
{
    const char *column, *reason = row_unavailable(row);
    for (size_t i = 0; (column = text_column(group, i)) && (!reason || i < group->name_count); i++) {
        if (!group->is_shown[i]) continue;
        if (is_repeated(group, row, i))
            text_append(&group->lines, "\t", 1);
        else
            cell_append(&group->lines, row, column);
    }
    if (reason) {
        text_appendf(&group->lines, "unavailable: ");
        plain_append(&group->lines, reason);
    }
    text_append(&group->lines, "\n", 1);
}

// Prints lines of cells, each of which ends with a tab, with every column as wide as its longest cell.
// `alignment` has an 'l' or 'r' for each column. Text after the last tab of a line, or after its last column,
// does not belong to a column.
static void table_print(const char *lines, const char *alignment, FILE *stream)
{
    int widths[COLUMNS_MAX] = {0};
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

// Prints the reasons for missing values of each column.
static void reasons_print(const RowGroup *group, FILE *stream)
{
    const char *column;
    for (size_t i = group->name_count; (column = text_column(group, i)); i++) {
        const char *last = NULL;
        for (size_t row = 0; group->is_shown[i] && row < group->count; row++) {
            const char *reason = missing_reason(&group->rows[row], column);
            if (reason && !(last && strcmp(last, reason) == 0))
                fprintf(stream, "%s: %s\n", column_heading(column).text, reason);
            if (reason) last = reason;
        }
    }
}

static void group_print(RowGroup *group, size_t first, RowNotes *notes, const void *context, FILE *stream)
{
    while (group->table->names[group->name_count])
        group->name_count++;
    columns_choose(group);
    shared_names_print(group, stream);
    headings_append(group);
    for (size_t i = 0; i < group->count; i++) {
        row_append(group, &group->rows[i]);
        if (notes) notes(context, first + i, &group->lines);
    }
    table_print(text_c(&group->lines), text_c(&group->alignment), stream);
    reasons_print(group, stream);
    text_free(&group->alignment);
    text_free(&group->lines);
}

void result_text_print(const json_t *document, const ResultTable *table, RowNotes *notes, const void *context,
                       FILE *stream)
{
    ResultRows rows = result_rows(document, table);
    for (size_t first = 0, next; first < rows.count; first = next) {
        const ResultRow *row = &rows.items[first];
        for (next = first + 1; next < rows.count; next++) {
            const ResultRow *other = &rows.items[next];
            if (!table->is_one_table &&
                (row->sources[1] != other->sources[1] || !rows_share(row, other, table->names[0]) ||
                 !rows_share(row, other, table->names[1])))
                break;
        }
        RowGroup group = {.table = table, .rows = row, .count = next - first};
        group_print(&group, first, notes, context, stream);
    }
    free(rows.items);
}
