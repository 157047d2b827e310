#include "host/import/number.h"

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const Range range_positive = {0, INFINITY, true, "greater than 0"};
const Range range_not_negative = {0, INFINITY, false, "0 or more"};
const Range range_unit = {0, 1, false, "from 0 to 1"};
const Range range_byte = {0, 255, false, "from 0 to 255"};
const Range range_field_of_view = {0, 180, true, "greater than 0 and less than 180"};
const Range range_pixels = {1, 65536, false, "from 1 to 65536"};

static size_t digits_skip(const char *text, size_t length, size_t *at)
{
    size_t start = *at;
    while (*at < length && text[*at] >= '0' && text[*at] <= '9')
        ++*at;
    return *at - start;
}

static void sign_skip(const char *text, size_t length, size_t *at)
{
    if (*at < length && (text[*at] == '+' || text[*at] == '-')) ++*at;
}

static bool number_is_well_formed(const char *text, size_t length)
{
    size_t at = 0;
    sign_skip(text, length, &at);
    size_t digit_count = digits_skip(text, length, &at);
    if (at < length && text[at] == '.') {
        at++;
        digit_count += digits_skip(text, length, &at);
    }
    if (!digit_count) return false;
    if (at < length && (text[at] == 'e' || text[at] == 'E')) {
        at++;
        sign_skip(text, length, &at);
        if (!digits_skip(text, length, &at)) return false;
    }
    return at == length;
}

NumberStatus number_read(const char *text, size_t length, double *value)
{
    char copy[512];
    if (length >= sizeof copy || !number_is_well_formed(text, length)) return NUMBER_MALFORMED;
    memcpy(copy, text, length);
    copy[length] = '\0';

    static locale_t c_locale;
    if (!c_locale) c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    double read = strtod_l(copy, NULL, c_locale);
    if (fabs(read) > NUMBER_MAX) return NUMBER_TOO_LARGE;
    *value = fabs(read) < NUMBER_MIN ? 0 : read;
    return NUMBER_READ;
}

static bool range_holds(const Range *range, double value)
{
    return range->open ? value > range->low && value < range->high
                       : value >= range->low && value <= range->high;
}

bool number_read_field(Report *report, size_t offset, const char *name, const char *text, size_t length,
                       const Range *range, double *value)
{
    switch (number_read(text, length, value)) {
    case NUMBER_MALFORMED:
        if (length)
            report_error(report, offset, "'%s' must be a number, not '%.*s'", name,
                         (int)(length < WORD_SHOWN ? length : WORD_SHOWN), text);
        else
            report_error(report, offset, "'%s' must be a number, not nothing", name);
        return false;
    case NUMBER_TOO_LARGE:
        report_error(report, offset, "'%s' is too large: numbers reach to %g", name, NUMBER_MAX);
        return false;
    case NUMBER_READ:
        break;
    }
    if (range && !range_holds(range, *value)) {
        report_error(report, offset, "'%s' must be %s", name, range->must);
        return false;
    }
    return true;
}
