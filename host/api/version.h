// This program's version, and how it was built.
#pragma once

#include "host/api/glint.h" // glint_version

// The commit's hash, with "-dirty" where files differed from it; "unknown" outside of clones and of archives
// that git made.
const char *glint_commit(void);
// The compiler with its version.
const char *glint_compiler(void);
