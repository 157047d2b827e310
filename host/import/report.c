#include "host/import/report.h"
#include "host/base/array.h"
#include "host/base/hash.h"
#include "host/base/text.h"

#include <stdlib.h>
#include <string.h>

enum { MESSAGES_MAX = 20 }; // of each severity

Report report_open(const Source *source, MessageList *messages)
{
    return (Report){.source = source, .messages = messages, .first = messages ? messages->count : 0};
}

// Counts a message, and returns whether it is within the limit.
static bool message_fits(Report *report, MessageSeverity severity)
{
    size_t *count = severity == MESSAGE_ERROR ? &report->error_count : &report->warning_count;
    return (*count)++ < MESSAGES_MAX;
}

// Adds the formatted arguments after `format` of the function that uses it.
#define REPORT(report, severity, offset, format)                                                             \
    do {                                                                                                     \
        char *text;                                                                                          \
        if (!message_fits(report, severity)) break;                                                          \
        ARGUMENTS_FORMAT(text, format);                                                                      \
        message_add_at((report)->messages, severity, (report)->source, offset, "%s", text);                  \
        free(text);                                                                                          \
    } while (0)

void report_message(Report *report, MessageSeverity severity, size_t offset, const char *format, ...)
{
    REPORT(report, severity, offset, format);
}

bool report_error(Report *report, size_t offset, const char *format, ...)
{
    REPORT(report, MESSAGE_ERROR, offset, format);
    return false;
}

void report_warning(Report *report, size_t offset, const char *format, ...)
{
    REPORT(report, MESSAGE_WARNING, offset, format);
}

bool report_is_full(const Report *report)
{
    return report->error_count >= MESSAGES_MAX;
}

// Returns the position of the message's file among the sources.
static size_t message_file(const Report *report, const Message *message)
{
    size_t position = 0;
    for (const Source *source = report->source; source; source = source->next, position++)
        if (!source->file || !message->file || !strcmp(source->file, message->file)) break;
    return position;
}

static bool message_is_before(const Report *report, const Message *a, const Message *b)
{
    const size_t file_of_a = message_file(report, a), file_of_b = message_file(report, b);
    if (file_of_a != file_of_b) return file_of_a < file_of_b;
    return a->line != b->line ? a->line < b->line : a->column < b->column;
}

// Returns whether the message repeats one from `first` up to `end`. An alias can produce the same mistake
// several times.
static bool message_is_among(const Message *message, const MessageList *list, size_t first, size_t end)
{
    for (size_t i = first; i < end; i++) {
        const Message *other = &list->items[i];
        if (other->line == message->line && other->column == message->column &&
            !strcmp(other->text, message->text) &&
            !strcmp(other->file ? other->file : "", message->file ? message->file : ""))
            return true;
    }
    return false;
}

bool report_repeats(Report *report, const char *file, unsigned line, unsigned column, const char *text)
{
    const unsigned place[] = {line, column};
    uint64_t hash = hash_bytes(HASH_START, place, sizeof place);
    hash = hash_bytes(hash, file ? file : "", file ? strlen(file) + 1 : 1);
    hash = hash_bytes(hash, text, strlen(text));
    for (size_t i = 0; i < report->known_count; i++)
        if (report->known[i] == hash) return true;
    if (report->known_count < REPORT_FILE_MESSAGES) report->known[report->known_count++] = hash;
    return false;
}

// Sorts the messages into source order and drops repeats.
static void report_sort(Report *report)
{
    MessageList *list = report->messages;
    size_t kept = report->first;
    for (size_t i = report->first; i < list->count; i++) {
        Message message = list->items[i];
        if (message_is_among(&message, list, report->first, kept)) {
            message_free(&message); // a repeat
            continue;
        }
        size_t place = kept++;
        for (; place > report->first && message_is_before(report, &message, &list->items[place - 1]); place--)
            list->items[place] = list->items[place - 1];
        list->items[place] = message;
    }
    list->count = kept;
    message_list_move(list, &report->included);
    if (report_is_full(report))
        message_add_at(list, MESSAGE_ERROR, report->source, MESSAGE_WHOLE_FILE,
                       "too many errors; reading stopped");
}

static size_t warnings_beyond_limit(const Report *report)
{
    return report->warning_count > MESSAGES_MAX ? report->warning_count - MESSAGES_MAX : 0;
}

void report_include(Report *report, Report *included)
{
    report_sort(included);
    MessageList *from = included->messages, *to = &report->included;
    for (size_t i = 0; i < from->count; i++) {
        const Message *message = &from->items[i];
        if (report_repeats(report, message->file, message->line, message->column, message->text) ||
            !message_fits(report, message->severity))
            message_free(&from->items[i]);
        else
            array_push(*to, *message);
    }
    if (!report_repeats(report, included->source->file, 0, 0, "")) // counted once for each file
        report->warning_count += warnings_beyond_limit(included);
    free(from->items);
    *from = (MessageList){0};
}

bool report_close(Report *report)
{
    report_sort(report);
    const size_t more = warnings_beyond_limit(report);
    if (more > 0)
        message_add_at(report->messages, MESSAGE_WARNING, report->source, MESSAGE_WHOLE_FILE,
                       "%zu more warnings are not shown", more);
    return report->error_count == 0;
}
