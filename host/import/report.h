// Collects one reader's messages about its source, bounded in number and without repeats. Those about the
// source's file come first, in the order of its text, then those about other files, as they are found.
#pragma once

#include "host/base/message.h"

// Bounds the number of messages that a report remembers.
enum { REPORT_KNOWN_MAX = 256 };

// Bounds the bytes of a source word that a message shows.
enum { WORD_SHOWN = 40 };

typedef struct {
    const Source *source;
    MessageList *messages;
    size_t error_count, warning_count; // including those beyond the limit
    uint64_t known[REPORT_KNOWN_MAX];  // hashes of messages
    size_t known_count;
} Report;

// Opens a report. The list may be NULL for a report that is not closed.
Report report_open(const Source *source, MessageList *messages);

// Adds a message of the severity unless it repeats one. An alias can produce the same mistake several times.
void report_message(Report *report, MessageSeverity severity, size_t offset, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Reports an error and returns false.
bool report_error(Report *report, size_t offset, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void report_warning(Report *report, size_t offset, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Returns whether a message at a place of a file repeats an earlier one, and remembers it. A source may name
// another file in many places.
bool report_repeats(Report *report, MessageSeverity severity, const char *file, uint64_t place,
                    const char *text);

// Returns whether the error limit is reached. A reader then stops, which bounds the time for a hostile file.
bool report_is_full(const Report *report);

// Closes the report of a file that the source names. Appends its messages, which must be in a separate list,
// and counts them as the source's.
void report_include(Report *report, Report *included);

// Adds a message about those beyond the limit. Returns true if there was no error.
bool report_close(Report *report);
