// Files of the source that the program carries within itself; tools/embed writes them into C.
#pragma once

typedef struct {
    const char *name; // without its folder
    const char *text;
} EmbeddedFile;
