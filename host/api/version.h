// Identifies the program's version and build.
#pragma once

#include "host/api/glint.h" // glint_version

// Returns the commit's hash, with "-dirty" if files differed from it, or "unknown" outside of clones and of
// archives that git made.
const char *glint_commit(void);
// Returns the compiler's name and version.
const char *glint_compiler(void);
