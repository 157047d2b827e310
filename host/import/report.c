#include "host/import/report.h"
#include "host/base/array.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <stdlib.h>
#include <string.h>

enum { MESSAGES_MAX = 20 }; // of each severity

Report report_open(const Source *source, MessageList *messages)
{
    return (Report){.source = source, .messages = messages};
}

bool report_repeats(Report *report, MessageSeverity severity, const char *file, uint64_t place,
                    const char *text)
{
    uint64_t hash = hash_bytes(HASH_START, &severity, sizeof severity);
    hash = hash_bytes(hash, &place, sizeof place);
    hash = hash_bytes(hash, file ? file : "", file ? strlen(file) + 1 : 1);
    hash = hash_bytes(hash, text, strlen(text));
    for (size_t i = 0; i < report->known_count; i++)
        if (report->known[i] == hash) return true;
    if (report->known_count < REPORT_KNOWN_MAX) report->known[report->known_count++] = hash;
    return false;
}

// Counts a message and returns whether it is beyond the limit of its severity.
static bool message_exceeds(Report *report, MessageSeverity severity)
{
    size_t *count = severity == MESSAGE_ERROR ? &report->error_count : &report->warning_count;
    return (*count)++ >= MESSAGES_MAX;
}

static bool message_is_before(const Message *a, const Message *b)
{
    return a->line != b->line ? a->line < b->line : a->column < b->column;
}

// Moves the last message behind the last one of the same file that is about no later place, or to the front.
static void last_message_sort(MessageList *list)
{
    const Message last = list->items[list->count - 1];
    size_t place = list->count - 1;
    for (; place > 0; place--) {
        const Message *previous = &list->items[place - 1];
        if (previous->file && strcmp(previous->file, last.file) == 0 && !message_is_before(&last, previous))
            break;
        list->items[place] = *previous;
    }
    list->items[place] = last;
}

// Adds and counts a message unless it repeats one. Those of the report's own file stay in the order of its
// text.
static void message_add(Report *report, MessageSeverity severity, size_t offset, const char *text)
{
    const Source *source = report->source;
    if (report_repeats(report, severity, source->file, offset, text) || message_exceeds(report, severity))
        return;
    message_add_at(report->messages, severity, source, offset, "%s", text);
    const bool is_of_file = offset <= source->length || offset == MESSAGE_WHOLE_FILE;
    if (report->messages && source->file && is_of_file) last_message_sort(report->messages);
}

// Adds the formatted arguments after `format` of the function that uses it.
#define REPORT(report, severity, offset, format)                                                             \
    do {                                                                                                     \
        OWNED char *text = NULL;                                                                             \
        ARGUMENTS_FORMAT(text, format);                                                                      \
        message_add(report, severity, offset, text);                                                         \
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

static size_t warnings_beyond_limit(const Report *report)
{
    return report->warning_count > MESSAGES_MAX ? report->warning_count - MESSAGES_MAX : 0;
}

void report_include(Report *report, Report *included)
{
    MessageList *from = included->messages;
    for (size_t i = 0; i < from->count; i++) {
        Message *message = &from->items[i];
        const uint64_t place = (uint64_t)message->line << 32 | message->column;
        if (report_repeats(report, message->severity, message->file, place, message->text) ||
            message_exceeds(report, message->severity))
            message_free(message);
        else
            array_push(*report->messages, *message);
    }
    if (!report_repeats(report, MESSAGE_WARNING, included->source->file, 0, "")) // counted once for each file
        report->warning_count += warnings_beyond_limit(included);
    free(from->items);
    *from = (MessageList){0};
}

bool report_close(Report *report)
{
    if (report_is_full(report))
        message_add_at(report->messages, MESSAGE_ERROR, report->source, MESSAGE_WHOLE_FILE,
                       "only the first %d errors are reported; there may be more", MESSAGES_MAX);
    const size_t more = warnings_beyond_limit(report);
    if (more > 0)
        message_add_at(report->messages, MESSAGE_WARNING, report->source, MESSAGE_WHOLE_FILE,
                       "%zu more warning%s %s not shown", more, text_plural(more), text_is_are(more));
    return report->error_count == 0;
}
