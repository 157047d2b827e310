// This program's version, and how it was built.
#pragma once

// As the Makefile found it, such as "0.2.0" or, between releases, "0.2.0-3-g5d2aaa6".
const char *glint_version(void);
// The commit's hash, with "-dirty" where files differed from it; "unknown" outside of clones and of archives
// that git made.
const char *glint_commit(void);
// The compiler with its version.
const char *glint_compiler(void);
