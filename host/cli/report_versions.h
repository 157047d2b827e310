// Composes versions.txt of glint report.
#pragma once

#include "host/base/text.h"
#include "host/cli/report_scrub.h"

// Returns the versions of glint, of its libraries and of the system, and the variables that OpenCL reads, one
// per line and scrubbed. The caller frees the text.
Text report_versions(const Scrubber *scrubber);
