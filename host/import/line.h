// Splits text into lines and words for the readers of line-based formats.
#pragma once

#include "host/import/number.h"
#include "host/scene/scene.h"

typedef struct {
    Report *report;
    size_t start, at, end; // the line's start, the read position, and the line's end or comment
    size_t next;           // start of the next line
    char comment;          // the character that starts a comment, or '\0'
    bool joins_blanks;     // vectors may have blanks next to their commas
} Line;

static inline bool character_is_blank(char character)
{
    return character == ' ' || character == '\t';
}

// Moves before the first line of the report's source. `comment` is the character that starts a comment, or
// '\0'. Reports an error and returns false if the source contains a NUL.
bool line_open(Line *line, Report *report, char comment);
// Each of these moves to a line and returns false at the end of the source: line_next to the next line,
// line_next_filled to the next one that has a word, and line_reach_word to that unless words are left on this
// line. Lines end with a newline, a carriage return or both.
bool line_next(Line *line);
bool line_next_filled(Line *line);
bool line_reach_word(Line *line);

// Moves to the next word of the line, or to its end, and returns the offset there.
size_t line_skip_blanks(Line *line);
// Returns the next word, which is empty at the end of the line. Words are separated by spaces and tabs.
Word line_peek(const Line *line);
Word line_peek_vector(const Line *line); // as line_comma_vector reads it
// Return the next word of this line or a later one, which is empty at the end of the source. free_peek leaves
// the word unread.
Word free_peek(Line *line);
Word free_word(Line *line);
Word line_word(Line *line);
bool word_is(Word word, const char *text);
bool word_is_in_any_case(Word word, const char *text);
bool words_equal(Word a, Word b);
bool word_is_number(Word word); // accepts numbers that are out of range

// Reads a value that messages call `name`. Its numbers must lie in the range, unless that is NULL. Reports an
// error and returns false if it is missing or invalid.
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
// from one word with commas or from three words.
LineReader line_number, line_whole_number, line_comma_vector, line_blank_vector;
// Read a double, an unsigned and a Vector3 from the next words of this line or later ones. A word that is
// invalid stays unread.
LineReader free_number, free_whole_number, free_vector;
// Calls `read` at each word that `next` moves to, line_next_filled or line_reach_word, until the report is
// full. Stores the lines of the objects that it adds. Returns false if there are no words.
bool line_elements(Line *line, Scene *scene, bool (*next)(Line *line), void (*read)(void *reader),
                   void *reader);
// Reports an error and returns false if anything is left on the line.
bool line_end(Line *line);
// Sets *has_one, which tells whether the source had a `what`. Reports an error at the line and returns false
// if it was set.
bool line_is_first(const Line *line, bool *has_one, const char *what);
