// Reads the words and numbers of a mesh file's lines in one pass. The text's only NUL is at its end.
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

// Returns the length of a backslash and line end that continue the line on the next one, otherwise 0.
static inline size_t scan_continuation(const char *at)
{
    if (*at != '\\') return 0;
    return at[1] == '\n' ? 2 : at[1] == '\r' ? (at[2] == '\n' ? 3 : 2) : 0;
}

// Skips blanks and returns whether more text follows on the line.
static inline bool scan_more(Scan *scan)
{
    for (;;) {
        while (character_is_blank(*scan->at))
            scan->at++;
        const size_t continuation = scan_continuation(scan->at);
        if (continuation == 0) return !scan_is_line_end(*scan->at);
        scan->at += continuation;
    }
}

static inline bool scan_is_word_end(const char *at)
{
    return character_is_blank(*at) || scan_is_line_end(*at) || scan_continuation(at) > 0;
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
    while (end > start && character_is_blank(end[-1]))
        end--;
    return (Word){start, (size_t)(start - scan->start), (size_t)(end - start)};
}

// Reads the next word if it is a number. Otherwise leaves the position unchanged.
static inline NumberStatus scan_number(Scan *scan, double *value)
{
    scan_more(scan);
    const char *at = scan->at;
    const NumberStatus status = number_scan(&at, scan->end, value);
    if (status == NUMBER_MALFORMED || !scan_is_word_end(at)) return NUMBER_MALFORMED;
    if (status == NUMBER_READ) scan->at = at;
    return status;
}

// Reads up to `most` numbers, and returns how many come before another word or the end of the line.
static inline int scan_numbers(Scan *scan, double *numbers, int most)
{
    int count = 0;
    while (count < most && scan_more(scan) && scan_number(scan, &numbers[count]) == NUMBER_READ)
        count++;
    return count;
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

// Words that were warned of, so that each is warned of once.
typedef struct {
    Word words[32];
    size_t count;
} UnusedWords;

// Warns once per word that the word `what`, such as "is not used".
void unused_record(UnusedWords *unused, Report *report, Word word, const char *what);
