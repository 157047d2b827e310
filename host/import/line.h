// Line by line, word by word: what the readers of line-based formats share.
#pragma once

#include "host/import/number.h"
#include "host/scene/vector.h"

typedef struct {
    const char *text; // in the source, not ended by a NUL
    size_t offset, length;
} Word;

typedef struct {
    Report *report;
    size_t start, at, end; // of the line; what is read; `end` is where its newline or comment stands
    size_t next;           // start of the next line
} Line;

// Stands before the first line of the report's source. False, reported, where that holds a NUL.
bool line_open(Line *line, Report *report);
// The next line; `comment`: the character that starts one, or '\0'. False at the end of the source.
bool line_next(Line *line, char comment);

// Words are separated by blanks: spaces, tabs, carriage returns. Empty at the end of the line.
Word line_peek(const Line *line);
Word line_word(Line *line);
bool word_is(Word word, const char *text);
bool word_is_number(Word word); // or one that is too large
int word_shown(Word word);      // how many bytes of it a message shows

// One number, the next word. Reports where it is missing or wrong.
bool line_number(Line *line, const char *name, const Range *range, double *value);
// The same for a whole number; the range lies within that of unsigned.
bool line_whole_number(Line *line, const char *name, const Range *range, unsigned *value);
// Three numbers: in one word with commas, or in three words.
bool line_comma_vector(Line *line, const char *name, const Range *range, Vector3 *value);
bool line_blank_vector(Line *line, const char *name, const Range *range, Vector3 *value);
// Reports what is left of the line.
bool line_end(Line *line);
