// The kernel text as one piece. A driver's own -I is not used: some serve a stale kernel after a header
// changed.
#pragma once

#include "host/base/embedded.h"
#include "host/opencl/compute.h"

// The files of kernels/: "render.cl", "sphere.h", …; ended by a NULL name.
extern const EmbeddedFile kernel_files[];

// `prelude`, then `root` with each quoted include replaced by its file the first time and by an empty line
// after that, in any branch of the preprocessor; #line before and after, so that the compiler names the file
// and line as they are in kernels/. Files are found by the last part of their path; <…> includes stay. NULL
// if `root` or an include is not in `files`, with *missing (may be NULL) its name, to be freed by the caller.
char *kernel_compose(const EmbeddedFile *files, const char *root, const char *prelude, char **missing);
