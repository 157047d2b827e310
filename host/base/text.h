// Growing text with a NUL at its end, which `count` excludes; a zeroed Text is empty.
#pragma once

#include "host/base/message.h"
#include <locale.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef struct {
    char *items;
    size_t count, capacity; // `count` bytes without the NUL
} Text;

void text_append(Text *text, const char *bytes, size_t length);
void text_appendf(Text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
// Return a formatted text, never NULL. The caller frees it. A number has a point in every locale, here and in
// text_appendf.
char *text_format(const char *format, ...) __attribute__((format(printf, 1, 2)));
char *text_format_list(const char *format, va_list arguments) __attribute__((format(printf, 1, 0)));
// Sets `formatted`, a char *, to the formatted arguments after `format` of the function that uses it. The
// caller frees it.
#define ARGUMENTS_FORMAT(formatted, format)                                                                  \
    do {                                                                                                     \
        va_list arguments;                                                                                   \
        va_start(arguments, format);                                                                         \
        formatted = text_format_list(format, arguments);                                                     \
        va_end(arguments);                                                                                   \
    } while (0)
// Returns the C locale, regardless of the process's locale.
locale_t text_locale(void);
const char *text_c(const Text *text); // never NULL
void text_free(Text *text);           // frees and zeroes
#define OwnedText __attribute__((cleanup(text_free))) Text

// A short text that is returned by value.
typedef struct {
    char text[32];
} ShortText;

// Returns a size in the unit that suits it, such as "830 bytes" or "6.2 MiB".
ShortText text_size(double bytes);
// Returns a duration in the unit that suits it, such as "90 seconds" or "3 hours".
ShortText text_duration(double seconds);
// Returns a finite number with the fewest digits, but at least `digits_min`, that read back as the same.
ShortText text_number(double value, int digits_min);
// Returns the plural ending of a noun for the count, "" for 1 and otherwise "s".
const char *text_plural(uint64_t count);
// Returns "is" for 1 and otherwise "are".
const char *text_is_are(uint64_t count);

// Returns whether the first byte ends a line, as a newline or a carriage return without a newline after it.
static inline bool text_ends_line(const char *text, size_t length)
{
    return *text == '\n' || (*text == '\r' && (length < 2 || text[1] != '\n'));
}

// Returns the bytes of the well-formed UTF-8 character with which `text` starts, or 0 if it does not start
// with one.
size_t text_character_size(const char *text, size_t length);

// Reads a whole file (`-`: standard input). On failure frees the text, adds a message that names the file and
// returns false.
bool text_read_file(Text *text, const char *path, MessageList *messages);
// Reads the rest of an open file and leaves it open; `path` is used in messages only.
bool text_read_open_file(Text *text, FILE *file, const char *path, MessageList *messages);

// Returns the known word nearest to `word` by edit distance, in which a swap of neighbors counts one, or NULL
// if the nearest is farther than 1 + length / 4 or than length - 1.
const char *text_nearest(const char *word, const char *const *known, size_t known_count);
