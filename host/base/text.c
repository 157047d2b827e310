#include "host/base/text.h"
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"

#include <errno.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

void text_append(Text *text, const char *bytes, size_t length)
{
    array_reserve(*text, length + 1);
    if (length) memcpy(text->items + text->count, bytes, length);
    text->count += length;
    text->items[text->count] = '\0';
}

void text_appendf(Text *text, const char *format, ...)
{
    OWNED char *formatted = NULL;
    ARGUMENTS_FORMAT(formatted, format);
    text_append(text, formatted, strlen(formatted));
}

char *text_format(const char *format, ...)
{
    char *formatted;
    ARGUMENTS_FORMAT(formatted, format);
    return formatted;
}

// Made once by the first thread that needs it, then constant.
static locale_t c_locale;

static void c_locale_make(void)
{
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!c_locale) fault("out of memory: locale");
}

locale_t text_locale(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, c_locale_make);
    return c_locale;
}

char *text_format_list(const char *format, va_list arguments)
{
    char *formatted;
    const locale_t callers = uselocale(text_locale());
    if (vasprintf(&formatted, format, arguments) < 0) fault("out of memory: text");
    uselocale(callers);
    return formatted;
}

const char *text_c(const Text *text)
{
    return text->items ? text->items : "";
}

void text_free(Text *text)
{
    free(text->items);
    *text = (Text){0};
}

static ShortText short_format(const char *format, ...) __attribute__((format(printf, 1, 2)));

// Formats a text, of which it keeps what fits.
static ShortText short_format(const char *format, ...)
{
    OWNED char *formatted = NULL;
    ARGUMENTS_FORMAT(formatted, format);
    ShortText text;
    snprintf(text.text, sizeof text.text, "%s", formatted);
    return text;
}

ShortText text_size(double bytes)
{
    static const char *const units[] = {"KiB", "MiB", "GiB", "TiB"};
    enum { UNIT_COUNT = COUNT_OF(units) };
    if (bytes < 1024) return short_format("%.0f byte%s", bytes, text_plural((uint64_t)bytes));
    int unit = 0;
    for (bytes /= 1024; bytes >= 1023.95 && unit + 1 < UNIT_COUNT; unit++)
        bytes /= 1024;
    return short_format("%.1f %s", fmin(bytes, 1e15), units[unit]);
}

ShortText text_duration(double seconds)
{
    // a count of one unit would hide up to half of it
    static const struct {
        const char *name;
        double seconds;
    } units[] = {{"day", 86400}, {"hour", 3600}, {"minute", 60}, {"second", 1}};
    size_t unit = 0;
    while (units[unit].seconds > 1 && seconds < 2 * units[unit].seconds)
        unit++;
    const double count = fmin(round(seconds / units[unit].seconds), 1e9);
    return short_format("%.0f %s%s", count, units[unit].name, text_plural((uint64_t)count));
}

// 17 digits always suffice (Goldberg, What every computer scientist should know about floating-point
// arithmetic, 1991, theorem 15).
ShortText text_number(double value, int digits_min)
{
    ShortText number;
    int digits = digits_min;
    do
        number = short_format("%.*g", digits, value);
    while (digits++ < 17 && strtod_l(number.text, NULL, text_locale()) != value);
    return number;
}

const char *text_plural(uint64_t count)
{
    return count == 1 ? "" : "s";
}

const char *text_is_are(uint64_t count)
{
    return count == 1 ? "is" : "are";
}

// Implements the Unicode Standard 15.0, table 3-7.
size_t text_character_size(const char *text, size_t length)
{
    const unsigned char *bytes = (const unsigned char *)text;
    if (length == 0) return 0;
    unsigned char first = bytes[0];
    size_t size = first < 0x80   ? 1
                  : first < 0xC2 ? 0
                  : first < 0xE0 ? 2
                  : first < 0xF0 ? 3
                  : first < 0xF5 ? 4
                                 : 0;
    if (size <= 1 || size > length) return size == 1;
    unsigned char low = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
    unsigned char high = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
    if (bytes[1] < low || bytes[1] > high) return 0;
    for (size_t i = 2; i < size; i++) {
        if ((bytes[i] & 0xC0) != 0x80) return 0;
    }
    return size;
}

bool text_read_open_file(Text *text, FILE *file, const char *path, MessageList *messages)
{
    // a device or a pipe may have no end
    struct stat status;
    bool is_regular = fstat(fileno(file), &status) == 0 && S_ISREG(status.st_mode);
    const size_t largest = is_regular ? SIZE_MAX : (size_t)2 << 30;
    const size_t chunk = 65535;
    size_t start = text->count, got;
    do {
        array_reserve(*text, chunk + 1);
        got = fread(text->items + text->count, 1, chunk, file);
        text->count += got;
        text->items[text->count] = '\0';
    } while (got == chunk && text->count - start <= largest);
    const int error = errno; // of a failed read
    // with the exact size, sanitizers find reads beyond the end
    text->capacity = text->count + 1;
    text->items = memory_resize(text->items, text->capacity, 1);

    const bool has_failed = ferror(file), is_too_large = text->count - start > largest;
    if (has_failed || is_too_large) text_free(text);
    if (has_failed) return message_error(messages, "cannot read '%s': %s", path, strerror(error));
    return !is_too_large || message_error(messages, "cannot read '%s': larger than 2 GiB", path);
}

bool text_read_file(Text *text, const char *path, MessageList *messages)
{
    bool is_standard_input = strcmp(path, "-") == 0;
    FILE *file = is_standard_input ? stdin : fopen(path, "rbe");
    if (!file) {
        message_error(messages, "cannot read '%s': %s", path, strerror(errno));
        text_free(text);
        return false;
    }
    bool whole = text_read_open_file(text, file, path, messages);
    if (!is_standard_input) fclose(file);
    return whole;
}

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

// Returns the number of insertions, deletions, replacements and swaps of neighbors that turn `a` into `b`,
// each part edited once (optimal string alignment; Boytsov, Indexing methods for approximate dictionary
// searching, 2011, section 2.1).
static size_t edit_distance(const char *a, size_t a_length, const char *b, size_t b_length)
{
    OWNED size_t *rows = memory_allocate(3 * (b_length + 1), sizeof *rows);
    size_t *before = rows, *last = before + b_length + 1, *row = last + b_length + 1;
    for (size_t j = 0; j <= b_length; j++)
        row[j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        size_t *freed = before;
        before = last;
        last = row;
        row = freed;
        row[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            row[j] = least(last[j - 1] + (a[i - 1] != b[j - 1]), least(last[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = least(row[j], before[j - 2] + 1);
        }
    }
    return row[b_length];
}

const char *text_nearest(const char *word, const char *const *known, size_t known_count)
{
    const char *nearest = NULL;
    size_t length = strlen(word), bound = least(1 + length / 4, length ? length - 1 : 0);
    for (size_t i = 0; i < known_count; i++) {
        size_t known_length = strlen(known[i]);
        if (known_length > length + bound || length > known_length + bound) continue;
        size_t distance = edit_distance(word, length, known[i], known_length);
        if (distance <= bound) {
            nearest = known[i];
            if (distance == 0) break;
            bound = distance - 1;
        }
    }
    return nearest;
}
