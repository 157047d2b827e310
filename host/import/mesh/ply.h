// A PLY file being read: its header and the read position.
#pragma once

#include "host/import/mesh/draft.h"

// Text of the file, without a terminating NUL: words of a header's or body's line, or binary numbers. Unlike
// in scan.h's lines, `#` and `\` stand for themselves, and any byte may follow.
typedef struct {
    const char *at, *end;
} PlySpan;

typedef enum { PLY_SIGNED, PLY_UNSIGNED, PLY_REAL } PlyNumberKind;

typedef struct {
    const char *name;
    size_t size; // in a binary file
    PlyNumberKind kind;
} PlyType;

typedef struct {
    PlySpan name;
    const PlyType *type, *count_type; // `count_type`: of a list's length; NULL: not a list
} PlyProperty;

typedef struct {
    PlySpan name;
    size_t count, first_property, property_count;
} PlyElement;

typedef enum { PLY_NO_FORMAT, PLY_ASCII, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN } PlyFormat;

typedef struct {
    PlyFormat format;
    struct {
        PlyElement *items;
        size_t count, capacity;
    } elements;
    struct {
        PlyProperty *items;
        size_t count, capacity;
    } properties; // of all elements, in their order
} PlyHeader;

typedef struct {
    MeshDraft *draft;
    PlySpan left; // unread
} PlyReading;

static inline bool ply_is_blank(char character)
{
    return character == ' ' || character == '\t';
}

// Skips blanks up to the next word of a line or its end.
static inline const char *ply_word_start(PlySpan *line)
{
    while (line->at < line->end && ply_is_blank(*line->at))
        line->at++;
    return line->at;
}

// The next line without its end, which is a newline, a carriage return or both. False at the end of the file.
bool ply_line(PlyReading *reading, PlySpan *line);
// The next word of a line, empty at its end. Words are separated by spaces and tabs.
PlySpan ply_word(PlySpan *line);
bool ply_span_is(PlySpan span, const char *text);
int ply_shown(PlySpan span); // bytes of it that a message shows

// Reports an error at this place of the file; always false.
bool ply_fails(PlyReading *reading, const char *at, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Reads up to the first byte of the body. False with an error if there is no valid header.
bool ply_header_read(PlyHeader *header, PlyReading *reading);
void ply_header_free(PlyHeader *header);
