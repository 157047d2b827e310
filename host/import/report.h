// The messages of one reader about its source: bounded in number, in the source's order, each told once.
#pragma once

#include "host/base/message.h"

// How much of a word of the source a message shows, in bytes.
enum { WORD_SHOWN = 40 };

typedef struct {
    const Source *source;
    MessageList *messages;
    size_t first;                      // of this report in `messages`
    size_t error_count, warning_count; // also those that are not told
} Report;

Report report_open(const Source *source, MessageList *messages);

void report_error(Report *report, size_t offset, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void report_warning(Report *report, size_t offset, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// So many errors that a reader may as well stop; it keeps the time for a hostile file in bounds.
bool report_is_full(const Report *report);

// Puts the messages in the source's order, drops repeated ones, says how many were not told. True: no error.
bool report_close(Report *report);
