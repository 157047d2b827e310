// Writes files into a .tar.gz archive. Its members have a mode and a time, and neither an owner nor a group.
#pragma once

#include "host/base/output.h"
#include "host/base/text.h"
#include <time.h>

// Appends a file to the archive `tar`, which starts empty. The name has at most ARCHIVE_NAME_MAX bytes.
enum { ARCHIVE_NAME_MAX = 99 };
void archive_add(Text *tar, const char *name, const Text *contents, time_t modified);
// Ends the archive and writes it compressed. Returns false with a message on failure.
bool archive_write(Text *tar, OutputFile *output, MessageList *messages);
