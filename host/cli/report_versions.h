// Composes versions.txt of glint report.
#pragma once

#include "host/cli/report_scrub.h"

// Returns the versions of glint, of its libraries and of the system, and the variables that OpenCL reads, one
// per line. The caller frees the text.
Text report_versions(const Scrubber *scrubber);
