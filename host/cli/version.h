// The version of this program.
#pragma once

// As the Makefile found it, such as "0.1.0" or, between releases, "0.1.0-3-g5d2aaa6".
const char *glint_version(void);
