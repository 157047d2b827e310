// Reads a PLY file's header and lines.
#pragma once

#include "host/base/array.h"
#include "host/import/mesh/draft.h"
#include "host/import/mesh/scan.h"

typedef enum { PLY_SIGNED, PLY_UNSIGNED, PLY_REAL } PlyNumberKind;

typedef struct {
    const char *name;
    size_t size; // in a binary file
    PlyNumberKind kind;
} PlyType;

typedef struct {
    Word name;
    const PlyType *type, *count_type; // `count_type`: of a list's length; NULL: not a list
} PlyProperty;

typedef struct {
    Word name;
    size_t count, first_property, property_count;
} PlyElement;

typedef enum { PLY_NO_FORMAT, PLY_ASCII, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN } PlyFormat;

typedef struct {
    PlyFormat format;
    ARRAY_OF(PlyElement) elements;
    ARRAY_OF(PlyProperty) properties; // of all elements, in their order
} PlyHeader;

typedef struct {
    MeshDraft *draft;
    Scan left; // unread
} PlyReading;

// Returns the offset of the line's next word, or of its end. Unlike in scan.h's lines, `#` and `\` stand for
// themselves, and any byte may follow.
static inline size_t ply_blanks_skip(Scan *line)
{
    while (line->at < line->end && scan_is_blank(*line->at))
        line->at++;
    return scan_offset(line);
}

// Reads the next line without its end, which is a newline, a carriage return or both. Returns false at the
// end of the file.
bool ply_line(PlyReading *reading, Scan *line);
// Returns the next word of a line, empty at its end. Words are separated by spaces and tabs.
Word ply_word(Scan *line);

// Reads up to the first byte of the body. Returns false with an error if there is no valid header.
bool ply_header_read(PlyHeader *header, PlyReading *reading);
void ply_header_free(PlyHeader *header);
