// Composes versions.txt of glint report.
#pragma once

#include "host/base/text.h"

// Returns the versions of glint, of its libraries and of the system, and the variables that OpenCL reads, one
// per line, without what scrubber_open finds. The caller frees the text.
Text report_versions(const char *folder);
