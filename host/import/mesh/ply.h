// A PLY file's text while it is read: its header, and where the reading stands.
#pragma once

#include "host/base/text.h"

#include <stdbool.h>
#include <stddef.h>

// Text of the file, not ended by a NUL.
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
    const PlyType *type, *count_type; // `count_type` of a list's length; NULL: no list
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
    const char *start;
    PlySpan left; // what is not read yet
    size_t line_number;
    bool by_bytes; // places are told as bytes from 0, not as lines
    char *fault;
    size_t fault_size;
} PlyReading;

static inline bool ply_is_blank(char character)
{
    return character == ' ' || character == '\t';
}

// Goes to the next word of a line, or to its end.
static inline const char *ply_word_start(PlySpan *line)
{
    while (line->at < line->end && ply_is_blank(*line->at))
        line->at++;
    return line->at;
}

// The next line without its end, which is a newline, a carriage return or both. False at the end of the file,
// counted as the line that is missing there.
bool ply_line(PlyReading *reading, PlySpan *line);
// The next word of a line, empty at its end. Words are separated by spaces and tabs.
PlySpan ply_word(PlySpan *line);
bool ply_span_is(PlySpan span, const char *text);
int ply_shown(PlySpan span); // how many bytes of it a message shows

// Notes the fault as `line N: what` or `byte N: what`; always false.
bool ply_fails(PlyReading *reading, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Up to the first byte of the body. False, with the fault, where there is no such header.
bool ply_header_read(PlyHeader *header, PlyReading *reading);
void ply_header_free(PlyHeader *header);
