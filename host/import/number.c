#include "host/import/number.h"

#include "host/base/text.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBER_LENGTH_MAX = 511 };

const Range range_positive = {0, INFINITY, true, "greater than 0"};
const Range range_not_negative = {0, INFINITY, false, "0 or more"};
const Range range_unit = {0, 1, false, "from 0 to 1"};
const Range range_byte = {0, 255, false, "from 0 to 255"};
const Range range_half_turn = {0, 180, true, "greater than 0 and less than 180"};
const Range range_pixels = {1, 65536, false, "from 1 to 65536"};

static double decimal_by_library(const char *text, size_t length)
{
    char copy[NUMBER_LENGTH_MAX + 1];
    memcpy(copy, text, length);
    copy[length] = '\0';
    return strtod_l(copy, NULL, text_locale());
}

typedef struct {
    uint64_t digits; // as one integer, modulo 2^64
    size_t digit_count;
    long exponent; // of ten
} Decimal;

static const char *decimal_digits_read(const char *at, const char *end, Decimal *decimal)
{
    for (; at < end && (unsigned char)(*at - '0') < 10; at++, decimal->digit_count++)
        decimal->digits = 10 * decimal->digits + (uint64_t)(*at - '0');
    return at;
}

// Skips `e` and an integer, if the text starts with them.
static const char *exponent_read(const char *at, const char *end, Decimal *decimal)
{
    enum { EXPONENT_MAX = 100000 }; // larger ones have the same effect
    const char *start = at;
    if (at == end || (*at != 'e' && *at != 'E')) return at;
    at++;
    const bool is_negative = at < end && *at == '-';
    if (at < end && (*at == '-' || *at == '+')) at++;
    if (at == end || (unsigned char)(*at - '0') >= 10) return start;
    long exponent = 0;
    for (; at < end && (unsigned char)(*at - '0') < 10; at++)
        exponent = exponent < EXPONENT_MAX ? 10 * exponent + (*at - '0') : exponent;
    decimal->exponent += is_negative ? -exponent : exponent;
    return at;
}

// Returns whether one rounded operation yields the nearest double. An integer up to 2^53 and a power of ten
// up to 10^22 are doubles, so their product or quotient is rounded once (Clinger, How to read floating point
// numbers accurately, PLDI 1990).
static bool decimal_is_short(const Decimal *decimal)
{
    enum { DIGITS_MAX = 19 };
    return decimal->digit_count <= DIGITS_MAX && decimal->digits <= (uint64_t)1 << 53 &&
           labs(decimal->exponent) <= 22;
}

static double decimal_value(const Decimal *decimal)
{
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const double digits = (double)decimal->digits;
    return decimal->exponent < 0 ? digits / powers[-decimal->exponent] : digits * powers[decimal->exponent];
}

NumberStatus number_scan(const char **text, const char *end, double *value)
{
    Decimal decimal = {0};
    const char *at = *text;
    const bool is_negative = at < end && *at == '-';
    if (at < end && (*at == '-' || *at == '+')) at++;
    at = decimal_digits_read(at, end, &decimal);
    if (at < end && *at == '.') {
        const size_t whole_count = decimal.digit_count;
        at = decimal_digits_read(at + 1, end, &decimal);
        decimal.exponent = -(long)(decimal.digit_count - whole_count);
    }
    if (decimal.digit_count == 0 || at - *text > NUMBER_LENGTH_MAX) return NUMBER_MALFORMED;
    at = exponent_read(at, end, &decimal);
    if (at - *text > NUMBER_LENGTH_MAX) return NUMBER_MALFORMED;
    double read = decimal_is_short(&decimal) ? decimal_value(&decimal)
                                             : fabs(decimal_by_library(*text, (size_t)(at - *text)));
    *text = at;
    if (read > NUMBER_MAX) return NUMBER_TOO_LARGE;
    *value = read < NUMBER_MIN ? 0 : is_negative ? -read : read;
    return NUMBER_READ;
}

NumberStatus number_read(const char *text, size_t length, double *value)
{
    const char *end = text + length;
    double read;
    const NumberStatus status = number_scan(&text, end, &read);
    if (status == NUMBER_MALFORMED || text < end) return NUMBER_MALFORMED;
    if (status == NUMBER_READ) *value = read;
    return status;
}

bool range_holds(const Range *range, double value)
{
    return range->open ? value > range->low && value < range->high
                       : value >= range->low && value <= range->high;
}

bool number_is_sound(double number)
{
    return number >= 0 && number <= NUMBER_MAX;
}

bool numbers_are_sound(Vector3 numbers)
{
    return number_is_sound(numbers.x) && number_is_sound(numbers.y) && number_is_sound(numbers.z);
}

int word_shown(Word word)
{
    return word.length < WORD_SHOWN ? (int)word.length : WORD_SHOWN;
}

bool number_read_field(Report *report, Word word, const char *name, const Range *range, double *value)
{
    switch (number_read(word.text, word.length, value)) {
    case NUMBER_MALFORMED:
        if (!word.length)
            return report_error(report, word.offset, "'%s' must be a number, but it is empty", name);
        return report_error(report, word.offset, "'%s' must be a number, not '%.*s'", name, WORD_TEXT(word));
    case NUMBER_TOO_LARGE:
        return report_error(report, word.offset, "'%s' must be at most %g in magnitude, not '%.*s'", name,
                            NUMBER_MAX, WORD_TEXT(word));
    case NUMBER_READ:
        break;
    }
    if (range && !range_holds(range, *value))
        return report_error(report, word.offset, "'%s' must be %s, not '%.*s'", name, range->must,
                            WORD_TEXT(word));
    return true;
}
