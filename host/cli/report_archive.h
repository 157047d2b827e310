// Prepares the files of a bug report's archive, which has an index and no text that identifies its author.
#pragma once

#include "host/base/message.h"
#include "host/base/text.h"
#include "host/cli/report_scrub.h"

#define REPORT_NAMES "names" // a file of the folder with the names of the files to archive, one per line

// Returns the versions of glint, of its libraries and of the system, and the variables that OpenCL reads, one
// per line. The caller frees the text.
Text report_versions(void);
// Writes a file of the folder. Returns false with a message on failure.
bool report_file_write(const char *folder, const char *name, const Text *contents, MessageList *messages);
// Scrubs what the steps of glint report left in the folder, and writes an index and REPORT_NAMES. `steps` has
// a line for each step. Returns the number of files to archive, or 0 with a message if one cannot be written.
size_t report_files_prepare(const char *folder, const Scrubber *scrubber, const char *steps,
                            MessageList *messages);
