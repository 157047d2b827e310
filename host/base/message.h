// Messages to the user about a file they gave: errors and warnings with their place.
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef enum { MESSAGE_WARNING, MESSAGE_ERROR } MessageSeverity;

typedef struct {
    MessageSeverity severity;
    char *file;            // as the user named it; NULL: no file
    unsigned line, column; // from 1; 0: unknown; the column counts characters (UTF-8 code points)
    char *text;            // one line, no newline, no "error:" prefix
    char *source_line;     // the line itself for the caret, or NULL
} Message;

typedef struct {
    Message *items;
    size_t count, capacity;
} MessageList;

// Where a message points: into a text held in memory, so that the line can be shown with a caret.
typedef struct {
    const char *file;
    const char *bytes;
    size_t length;
} Source;

// Adds a message without a place.
void message_add(MessageList *list, MessageSeverity severity, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Adds a message at a byte offset of a source; line, column and the line's text are worked out here.
// An offset past the end points at the end. Control bytes in the shown line are made printable.
void message_add_at(MessageList *list, MessageSeverity severity, const Source *source, size_t offset,
                    const char *format, ...) __attribute__((format(printf, 5, 6)));

size_t message_count(const MessageList *list, MessageSeverity severity);

// `file:line:column: error: text`, then the line and a caret where they are known.
void message_list_print(const MessageList *list, FILE *stream);
void message_list_free(MessageList *list);
