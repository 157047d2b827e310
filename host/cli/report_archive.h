// Writes the archive of a bug report, which has an index and no text that identifies its author.
#pragma once

#include "host/base/output.h"
#include "host/base/text.h"
#include "host/cli/report_scrub.h"

// Writes an archive of the versions and of what the steps of glint report left in the folder, which is
// scrubbed. `steps` has a line for each step. Returns the number of files, or 0 with a message if the archive
// cannot be written.
size_t report_archive_write(OutputFile *output, const char *folder, const Scrubber *scrubber,
                            const Text *versions, const char *steps, MessageList *messages);
