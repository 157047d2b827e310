// Collects errors and warnings for the user with their file, line and column.
#pragma once

#include "host/base/array.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef enum { MESSAGE_WARNING, MESSAGE_ERROR } MessageSeverity;

typedef struct {
    MessageSeverity severity;
    char *file;            // as the user named it, or NULL for no file
    unsigned line, column; // from 1, or 0 if unknown; the column counts UTF-8 code points
    char *text;            // one line, no newline, no "error:" prefix
    char *source_line;     // the line itself for the caret, or NULL
} Message;

typedef ARRAY_OF(Message) MessageList;

// The text in memory that a message points into, so that its line can be shown with a caret.
typedef struct Source {
    const char *file;
    const char *bytes;
    size_t length;
    // A text that follows, whose offsets begin at length + 1, or NULL.
    struct Source *next;
} Source;

// Add a message without a file. The list may be NULL, here and in message_add_at, where the reader wants no
// messages. The function for errors returns false, so that its caller can return that.
void message_warning(MessageList *list, const char *format, ...) __attribute__((format(printf, 2, 3)));
bool message_error(MessageList *list, const char *format, ...) __attribute__((format(printf, 2, 3)));

// The offset of a message about a whole file, which has no line.
#define MESSAGE_WHOLE_FILE SIZE_MAX

// Adds a message at a byte offset of a source, which determines its line, column and source line. An offset
// past the end counts as the end. Control characters are replaced by `?`.
void message_add_at(MessageList *list, MessageSeverity severity, const Source *source, size_t offset,
                    const char *format, ...) __attribute__((format(printf, 5, 6)));
// Returns the place of a byte offset, which must not be MESSAGE_WHOLE_FILE and whose source must have a file
// name, as FILE:LINE:COLUMN. The caller frees it.
char *message_place_text(const Source *source, size_t offset);

// Returns the source that contains an offset, among `source` and those after it, and makes the offset
// relative to that source's text.
const Source *source_at(const Source *source, size_t *offset);

size_t message_count(const MessageList *list, MessageSeverity severity);
// Returns the text of the first error, or "" if there is none.
const char *message_first_error(const MessageList *list);

// Prints `file:line:column: error: text`, then the line and a caret where they are known.
void message_list_print(const MessageList *list, FILE *stream);
// Returns what message_list_print prints, or NULL if the list is empty. The caller frees it.
char *message_list_text(const MessageList *list);
void message_free(Message *message);
void message_list_free(MessageList *list);
#define OwnedMessageList __attribute__((cleanup(message_list_free))) MessageList
// Removes each message that is in `known`, with the same severity and place and a text that differs at most
// in numbers that are not whole.
void message_list_remove(MessageList *list, const MessageList *known);
// Appends all messages of `from`, which is then empty.
void message_list_move(MessageList *to, MessageList *from);
