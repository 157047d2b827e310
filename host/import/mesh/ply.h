// Reads a PLY file's header.
#pragma once

#include "host/base/array.h"
#include "host/import/line.h"

typedef enum { PLY_SIGNED, PLY_UNSIGNED, PLY_REAL } PlyNumberType;

typedef struct {
    const char *name;
    size_t size; // in a binary file
    PlyNumberType number_type;
} PlyType;

typedef struct {
    Word name;
    const PlyType *type, *count_type; // count_type is of a list's length, or NULL for a single value
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

// Reads the header, up to its last line. Returns false with an error if there is no valid header.
bool ply_header_read(PlyHeader *header, Line *line);
void ply_header_free(PlyHeader *header);
