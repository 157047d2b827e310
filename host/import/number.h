// Reads decimal numbers of scene files, independently of the locale, and checks their ranges.
#pragma once

#include "host/import/report.h"
#include "host/scene/vector.h"
#include <stddef.h>

// Larger magnitudes are rejected and smaller ones are read as 0, so that no product of a few numbers
// overflows or underflows a double.
#define NUMBER_MAX 1e30
#define NUMBER_MIN 1e-30

typedef enum { NUMBER_READ, NUMBER_MALFORMED, NUMBER_TOO_LARGE } NumberStatus;

// Converts exactly `length` bytes to the nearest double. Accepts a sign, digits with an optional point and
// an exponent, but no hex, inf or nan. Sets `value` on NUMBER_READ only.
NumberStatus number_read(const char *text, size_t length, double *value);
// Reads the longest number that starts at `*text` and moves `*text` past it unless it is malformed.
NumberStatus number_scan(const char **text, const char *end, double *value);

typedef struct {
    const char *text; // in the source, without a terminating NUL
    size_t offset, length;
} Word;

// Returns the number of the word's bytes that a message shows.
int word_shown(Word word);
// The arguments of printf's %.*s that show the word in a message.
#define WORD_TEXT(word) word_shown(word), (word).text

typedef struct {
    double low, high;
    bool open;        // excludes the limits
    const char *must; // the requirement as messages state it
} Range;

extern const Range range_positive, range_not_negative, range_unit, range_byte, range_half_turn, range_pixels;

bool range_holds(const Range *range, double value);
// Return whether a number, or each component of a vector, is 0 or more and at most NUMBER_MAX.
bool number_is_sound(double number);
bool numbers_are_sound(Vector3 numbers);

// Reads the number called `name` from a whole word. Reports an error and returns false if it is invalid. A
// `range` of NULL allows any number.
bool number_read_field(Report *report, Word word, const char *name, const Range *range, double *value);
