// Composes the kernel text as one string. The driver's -I is not used, because some drivers return a stale
// kernel after a header changed.
#pragma once

#include "host/base/embedded.h"
#include "host/opencl/compute.h"

// The files of kernels/, such as "render.cl" and "sphere.h". A NULL name ends the list.
extern const EmbeddedFile kernel_files[];

// Returns `prelude`, then `root` with each quoted include expanded the first time and replaced by an empty
// line after that, whatever the preprocessor's branch, with #line around each, so that the compiler reports
// files and lines of kernels/. Files are found by the last part of their path, and <...> includes are kept.
// Ends the program by a fault if `root` or an include is not in `files`. The caller frees the text.
char *kernel_compose(const EmbeddedFile *files, const char *root, const char *prelude);
