// Files of the source that the program carries within itself; tools/embed writes them into C.
#pragma once

typedef struct {
    const char *name; // without its folder
    const char *text;
} EmbeddedFile;

// Each ended by a NULL name.
extern const EmbeddedFile kernel_files[]; // kernels/: "render.cl", "sphere.h", …
extern const EmbeddedFile page_files[];   // host/cli/page/: "page.html", …
