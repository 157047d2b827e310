#include "host/base/message.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

// A longer source line is truncated, or not shown if the caret would be beyond.
enum { CHARACTERS_SHOWN = 240 };

// Returns whether a character is a C0 or C1 control, which could control the user's terminal.
static bool character_is_control(const unsigned char *bytes, size_t size)
{
    return (size == 1 && (bytes[0] < 0x20 || bytes[0] == 0x7F)) ||
           (size == 2 && bytes[0] == 0xC2 && bytes[1] < 0xA0);
}

// Copies at most `characters_max` characters of the text, with `?` for each control character and each byte
// that is not UTF-8. Tabs are kept on request.
static char *printable_copy(const char *bytes, size_t length, size_t characters_max, bool keep_tabs)
{
    Text shown = {0};
    text_append(&shown, "", 0);
    for (size_t i = 0, characters = 0; i < length && characters < characters_max; characters++) {
        const unsigned char *here = (const unsigned char *)bytes + i;
        size_t size = text_character_size(bytes + i, length - i);
        bool printable = size && (!character_is_control(here, size) || (keep_tabs && *here == '\t'));
        text_append(&shown, printable ? bytes + i : "?", printable ? size : 1);
        i += size ? size : 1;
    }
    return shown.items;
}

static size_t character_count(const char *bytes, size_t length)
{
    size_t count = 0;
    for (size_t i = 0; i < length; count++) {
        size_t size = text_character_size(bytes + i, length - i);
        i += size ? size : 1;
    }
    return count;
}

// Adds the message with a printable copy of a text, which is freed. A list of NULL receives nothing.
static void message_push(MessageList *list, Message message, char *formatted)
{
    message.text = printable_copy(formatted, strlen(formatted), SIZE_MAX, false);
    free(formatted);
    if (list)
        array_push(*list, message);
    else
        message_free(&message);
}

void message_warning(MessageList *list, const char *format, ...)
{
    char *formatted;
    ARGUMENTS_FORMAT(formatted, format);
    message_push(list, (Message){.severity = MESSAGE_WARNING}, formatted);
}

bool message_error(MessageList *list, const char *format, ...)
{
    char *formatted;
    ARGUMENTS_FORMAT(formatted, format);
    message_push(list, (Message){.severity = MESSAGE_ERROR}, formatted);
    return false;
}

const Source *source_at(const Source *source, size_t *offset)
{
    for (; source->next && *offset > source->length && *offset != MESSAGE_WHOLE_FILE; source = source->next)
        *offset -= source->length + 1;
    return source;
}

static Message message_place(const Source *source, size_t offset)
{
    Message message = {0};
    source = source_at(source, &offset);
    if (source->file) message.file = printable_copy(source->file, strlen(source->file), SIZE_MAX, false);
    if (offset == MESSAGE_WHOLE_FILE) return message;
    if (offset > source->length) offset = source->length;
    // A byte order mark is not a character of the first line.
    size_t start = source->length >= 3 && memcmp(source->bytes, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    if (offset < start) offset = start;
    message.line = 1;
    for (size_t i = start; i < offset; i++) {
        if (text_ends_line(source->bytes + i, source->length - i)) {
            message.line++;
            start = i + 1;
        }
    }
    size_t end = offset;
    while (end < source->length && source->bytes[end] != '\n' && source->bytes[end] != '\r')
        end++;
    message.column = 1 + (unsigned)character_count(source->bytes + start, offset - start);
    if (message.column <= CHARACTERS_SHOWN)
        message.source_line = printable_copy(source->bytes + start, end - start, CHARACTERS_SHOWN, true);
    return message;
}

char *message_place_text(const Source *source, size_t offset)
{
    Message message = message_place(source, offset);
    char *text = text_format("%s:%u:%u", message.file, message.line, message.column);
    message_free(&message);
    return text;
}

void message_add_at(MessageList *list, MessageSeverity severity, const Source *source, size_t offset,
                    const char *format, ...)
{
    Message message = message_place(source, offset);
    message.severity = severity;
    char *formatted;
    ARGUMENTS_FORMAT(formatted, format);
    message_push(list, message, formatted);
}

void message_free(Message *message)
{
    free(message->file);
    free(message->text);
    free(message->source_line);
}

size_t message_count(const MessageList *list, MessageSeverity severity)
{
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++)
        count += list->items[i].severity == severity;
    return count;
}

const char *message_first_error(const MessageList *list)
{
    for (size_t i = 0; i < list->count; i++)
        if (list->items[i].severity == MESSAGE_ERROR) return list->items[i].text;
    return "";
}

// Appends the line's tabs before the caret, which keep it under its character at any tab width.
static void caret_append(Text *text, const char *line, unsigned column)
{
    const char *at = line;
    for (unsigned before = 1; before < column; before++) {
        text_append(text, *at == '\t' ? "\t" : " ", 1);
        if (*at) at += text_character_size(at, strlen(at));
    }
    text_append(text, "^\n", 2);
}

static void message_append(Text *text, const Message *message)
{
    text_appendf(text, "%s", message->file ? message->file : "glint");
    if (message->line) text_appendf(text, ":%u", message->line);
    if (message->column) text_appendf(text, ":%u", message->column);
    text_appendf(text, ": %s: %s\n", message->severity == MESSAGE_ERROR ? "error" : "warning", message->text);
    if (message->source_line && message->column) {
        text_appendf(text, "%s\n", message->source_line);
        caret_append(text, message->source_line, message->column);
    }
}

char *message_list_text(const MessageList *list)
{
    Text text = {0};
    for (size_t i = 0; i < list->count; i++)
        message_append(&text, &list->items[i]);
    return text.items;
}

void message_list_print(const MessageList *list, FILE *stream)
{
    OWNED char *text = message_list_text(list);
    if (text) fputs(text, stream);
}

void message_list_free(MessageList *list)
{
    for (size_t i = 0; i < list->count; i++)
        message_free(&list->items[i]);
    free(list->items);
    *list = (MessageList){0};
}

// Returns whether texts are equal except for pairs of numbers that are not both whole.
static bool texts_are_alike(const char *a, const char *b)
{
    while (*a && *b) {
        if (!isdigit((unsigned char)*a) || !isdigit((unsigned char)*b)) {
            if (*a++ != *b++) return false;
            continue;
        }
        char *a_end, *b_end;
        const double a_value = strtod_l(a, &a_end, text_locale()),
                     b_value = strtod_l(b, &b_end, text_locale());
        const size_t a_digits = strspn(a, "0123456789"), b_digits = strspn(b, "0123456789");
        if (a + a_digits == a_end && b + b_digits == b_end && a_value != b_value) return false;
        a = a_end;
        b = b_end;
    }
    return *a == *b;
}

static bool message_is_known(const Message *message, const MessageList *known)
{
    for (size_t i = 0; i < known->count; i++) {
        const Message *other = &known->items[i];
        const bool has_file = message->file && other->file;
        if (message->severity == other->severity && message->line == other->line &&
            message->column == other->column &&
            (has_file ? strcmp(message->file, other->file) == 0 : message->file == other->file) &&
            texts_are_alike(message->text, other->text))
            return true;
    }
    return false;
}

void message_list_remove(MessageList *list, const MessageList *known)
{
    if (known->count == 0) return;
    size_t kept = 0;
    for (size_t i = 0; i < list->count; i++)
        if (message_is_known(&list->items[i], known))
            message_free(&list->items[i]);
        else
            list->items[kept++] = list->items[i];
    list->count = kept;
}

void message_list_move(MessageList *to, MessageList *from)
{
    for (size_t i = 0; i < from->count; i++)
        array_push(*to, from->items[i]);
    free(from->items);
    *from = (MessageList){0};
}
