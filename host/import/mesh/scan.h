// Reads words and numbers of the lines of a mesh file in one pass. A NUL stands behind the text and none
// within.
#pragma once

#include "host/import/line.h"

#include <string.h>

typedef struct {
    const char *at, *end;
    const char *start; // of the text
} Scan;

static inline Scan scan_open(const Source *source)
{
    return (Scan){source->bytes, source->bytes + source->length, source->bytes};
}

// Returns the offset of the position in the text.
static inline size_t scan_offset(const Scan *scan)
{
    return (size_t)(scan->at - scan->start);
}

// Returns whether the line, or the part of it before a comment, ends at the character.
static inline bool scan_is_line_end(char character)
{
    return character == '\n' || character == '\r' || character == '\0' || character == '#';
}

static inline bool scan_is_blank(char character)
{
    return character == ' ' || character == '\t';
}

// Returns the bytes of a backslash at the end of a line, which continues on the next, otherwise 0.
static inline size_t scan_continuation(const char *at)
{
    if (*at != '\\') return 0;
    return at[1] == '\n' ? 2 : at[1] == '\r' ? (at[2] == '\n' ? 3 : 2) : 0;
}

// Skips blanks and returns whether the line has more.
static inline bool scan_more(Scan *scan)
{
    for (;;) {
        while (scan_is_blank(*scan->at))
            scan->at++;
        const size_t continuation = scan_continuation(scan->at);
        if (continuation == 0) return !scan_is_line_end(*scan->at);
        scan->at += continuation;
    }
}

static inline bool scan_is_word_end(const char *at)
{
    return scan_is_blank(*at) || scan_is_line_end(*at) || scan_continuation(at) > 0;
}

// Returns the next word of the line, empty at its end.
static inline Word scan_word(Scan *scan)
{
    scan_more(scan);
    const char *start = scan->at;
    while (!scan_is_word_end(scan->at))
        scan->at++;
    return (Word){start, (size_t)(start - scan->start), (size_t)(scan->at - start)};
}

// Returns the rest of the line without the blanks around it.
static inline Word scan_rest(Scan *scan)
{
    scan_more(scan);
    const char *start = scan->at;
    while (*scan->at != '\n' && *scan->at != '\r' && *scan->at != '\0')
        scan->at++;
    const char *end = scan->at;
    while (end > start && scan_is_blank(end[-1]))
        end--;
    return (Word){start, (size_t)(start - scan->start), (size_t)(end - start)};
}

// Reads the next word if it is a number; otherwise the position stays.
static inline NumberStatus scan_number(Scan *scan, double *value)
{
    scan_more(scan);
    const char *at = scan->at;
    const NumberStatus status = number_scan(&at, scan->end, value);
    if (status == NUMBER_MALFORMED || !scan_is_word_end(at)) return NUMBER_MALFORMED;
    if (status == NUMBER_READ) scan->at = at;
    return status;
}

// Moves to the next line. Returns false at the end of the text.
static inline bool scan_line(Scan *scan)
{
    while (scan->at < scan->end) {
        const char *newline = scan->at;
        while (newline < scan->end && *newline != '\n' && *newline != '\r')
            newline++;
        scan->at = newline < scan->end ? newline + 1 : newline;
        if (newline == scan->start || newline == scan->end || newline[-1] != '\\') break;
        if (*newline == '\r' && *scan->at == '\n') scan->at++;
    }
    return scan->at < scan->end;
}

// Returns whether the text has no NUL, and reports an error otherwise. Skips a byte order mark.
bool scan_is_text(Scan *scan, Report *report);

// Words that a warning was for, of which there is one for each.
typedef struct {
    Word words[32];
    size_t count;
} UnusedWords;

// Warns that the word `what`, such as "is not used".
void unused_record(UnusedWords *unused, Report *report, Word word, const char *what);
