// Splits text into lines and words for the readers of text formats, in one pass.
#pragma once

#include "host/import/number.h"
#include "host/scene/scene.h"

typedef struct {
    Report *report;
    const char *text, *end; // of the source
    const char *at;         // the read position
    size_t start;           // the line's offset
    uint32_t number;        // the line's, from 1; a joined line counts as one
    char comment;           // the character that starts a comment, or '\n' for none
    bool joins_blanks;      // vectors may have blanks next to their commas
    bool joins_lines;       // a backslash at its end continues a line; a NUL follows the text
    bool spans_lines;       // an element's values may stand on later lines
} Line;

// Returns the first line of the report's source, which begins after a byte order mark. Lines end with a
// newline, a carriage return or both, and words with a space or a tab.
Line line_first(Report *report, char comment);
// Returns the first line of a mesh's file, whose comments begin with # and whose lines are joined.
Line line_first_of_mesh(Report *report);
// Returns whether the source has no NUL, and reports an error otherwise.
bool line_is_text(const Line *line);

static inline bool character_is_blank(char character)
{
    return character == ' ' || character == '\t';
}

// Returns whether the line, or the part of it before a comment, ends at a position.
static inline bool line_ends_at(const Line *line, const char *at)
{
    return at == line->end || *at == '\n' || *at == '\r' || *at == line->comment;
}

// Returns the length of a backslash and line end that continue the line on the next one, otherwise 0.
static inline size_t line_continuation(const Line *line, const char *at)
{
    if (*at != '\\' || !line->joins_lines) return 0;
    return at[1] == '\n' ? 2 : at[1] == '\r' ? (at[2] == '\n' ? 3 : 2) : 0;
}

static inline bool word_ends_at(const Line *line, const char *at)
{
    return line_ends_at(line, at) || character_is_blank(*at) || line_continuation(line, at) > 0;
}

static inline size_t line_offset(const Line *line)
{
    return (size_t)(line->at - line->text);
}

// Moves to the next word of the line, or to its end, and returns whether there is a word.
static inline bool line_has_word(Line *line)
{
    for (size_t skipped = 1; !line_ends_at(line, line->at); line->at += skipped) {
        skipped = character_is_blank(*line->at) ? 1 : line_continuation(line, line->at);
        if (skipped == 0) return true;
    }
    return false;
}

// Returns the word that starts at the position, which is empty at the end of the line.
static inline Word line_word(Line *line)
{
    line_has_word(line);
    const char *start = line->at;
    while (!word_ends_at(line, line->at))
        line->at++;
    return (Word){start, (size_t)(start - line->text), (size_t)(line->at - start)};
}

// Reads the next word if it is a number. Otherwise leaves it unread.
static inline NumberStatus line_try_number(Line *line, double *value)
{
    line_has_word(line);
    const char *at = line->at;
    const NumberStatus status = number_scan(&at, line->end, value);
    if (status == NUMBER_MALFORMED || !word_ends_at(line, at)) return NUMBER_MALFORMED;
    if (status == NUMBER_READ) line->at = at;
    return status;
}

// Reads up to `most` numbers, and returns how many come before another word or the end of the line.
int line_try_numbers(Line *line, double *numbers, int most);

// Moves to the next word of the line, or to its end, and returns the offset there.
size_t line_word_offset(Line *line);
// Returns the next word of the line and leaves it unread.
Word line_peek(const Line *line);
Word line_peek_vector(const Line *line); // as line_comma_vector reads it
// Return the next word, also of a later line if the line spans_lines.
Word value_peek(Line *line);
Word value_word(Line *line);
// Returns the rest of the line, comments included, without the blanks around it.
Word line_rest(Line *line);
// Moves to the end of the line.
void line_skip(Line *line);
// line_next moves to the next line, line_next_filled to the next one that has a word, and line_reach_word
// does the latter unless words are left on this line. Each returns false at the end of the source.
bool line_next(Line *line);
bool line_next_filled(Line *line);
bool line_reach_word(Line *line);

bool word_is(Word word, const char *text);
bool word_is_in_any_case(Word word, const char *text);
bool words_equal(Word a, Word b);
bool word_is_number(Word word); // accepts numbers that are out of range

// Reads a value that messages call `name`. Its numbers must lie in the range, unless that is NULL. Reports an
// error and returns false if it is missing or invalid. An invalid word stays unread.
typedef bool LineReader(Line *line, const char *name, const Range *range, void *value);

// A value and the member of a struct that holds it.
typedef struct {
    const char *name;
    LineReader *read;
    size_t offset; // of the member
    const Range *range;
} LineField;

// Reads the field's value into its member of `values`. Reports an error and returns false if it is invalid.
bool line_field(Line *line, const LineField *field, void *values);

// Read a double from a word, an unsigned from a word, whose range lies within that of unsigned, and a Vector3
// from three words or from one word with commas.
LineReader line_number, line_whole_number, line_vector, line_comma_vector;
// Calls `read` at the first word of each line, or at each word that it leaves if the line spans_lines, until
// the report is full. Stores the lines of the objects that it adds. Returns false if there are no words.
bool line_elements(Line *line, Scene *scene, void (*read)(void *reader), void *reader);
// Reports an error and returns false if anything is left on the line.
bool line_end(Line *line);
// Sets *has_one, which tells whether the source had a `what`. Reports an error at the line and returns false
// if it was set.
bool line_is_first(const Line *line, bool *has_one, const char *what);

// Words that were warned of, so that each is warned of once.
typedef struct {
    Word words[32];
    size_t count;
} UnusedWords;

// Warns once per word that the word `what`, such as "is ignored".
void unused_record(UnusedWords *unused, Report *report, Word word, const char *what);
