// Source files embedded in the program; tools/embed writes them as C.
#pragma once

typedef struct {
    const char *name; // without its folder
    const char *text;
} EmbeddedFile;
