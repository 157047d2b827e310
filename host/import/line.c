#include "host/import/line.h"
#include "host/base/array.h"

#include <string.h>
#include <strings.h>

Line line_first(Report *report, char comment)
{
    const Source *source = report->source;
    const bool has_mark = source->length >= 3 && memcmp(source->bytes, "\xEF\xBB\xBF", 3) == 0;
    Line line = {
        .report = report, .text = source->bytes, .start = has_mark ? 3 : 0, .number = 1, .comment = comment};
    line.at = line.text + line.start;
    line.end = line.text + source->length;
    return line;
}

Line line_first_of_mesh(Report *report)
{
    Line line = line_first(report, '#');
    line.joins_lines = true;
    return line;
}

bool line_is_text(const Line *line)
{
    const char *nul = line->at < line->end ? memchr(line->at, '\0', (size_t)(line->end - line->at)) : NULL;
    return !nul ||
           report_error(line->report, (size_t)(nul - line->text), "the file contains a NUL character");
}

void line_skip(Line *line)
{
    while (!line_ends_at(line, line->at))
        line->at++;
}

bool line_next(Line *line)
{
    line_skip(line);
    const char *at = line->at;
    bool is_joined;
    do {
        while (at < line->end && *at != '\n' && *at != '\r')
            at++;
        if (line->end - at <= 1) return false;
        is_joined = line->joins_lines && at > line->text && at[-1] == '\\';
        at += *at == '\r' && at[1] == '\n' ? 2 : 1;
    } while (is_joined);
    if (at == line->end) return false;
    line->at = at;
    line->start = line_offset(line);
    line->number++;
    return true;
}

bool line_next_filled(Line *line)
{
    return line_next(line) && line_reach_word(line);
}

bool line_reach_word(Line *line)
{
    while (!line_has_word(line))
        if (!line_next(line)) return false;
    return true;
}

size_t line_word_offset(Line *line)
{
    line_has_word(line);
    return line_offset(line);
}

Word line_peek(const Line *line)
{
    Line copy = *line;
    return line_word(&copy);
}

Word value_peek(Line *line)
{
    if (line->spans_lines) line_reach_word(line);
    return line_peek(line);
}

Word value_word(Line *line)
{
    if (line->spans_lines) line_reach_word(line);
    return line_word(line);
}

Word line_rest(Line *line)
{
    const size_t offset = line_word_offset(line);
    const char *start = line->at;
    while (line->at < line->end && *line->at != '\n' && *line->at != '\r')
        line->at++;
    const char *end = line->at;
    while (end > start && character_is_blank(end[-1]))
        end--;
    return (Word){start, offset, (size_t)(end - start)};
}

int line_try_numbers(Line *line, double *numbers, int most)
{
    int count = 0;
    while (count < most && line_try_number(line, &numbers[count]) == NUMBER_READ)
        count++;
    return count;
}

bool words_equal(Word a, Word b)
{
    return a.length == b.length && memcmp(a.text, b.text, a.length) == 0;
}

bool word_is(Word word, const char *text)
{
    return words_equal(word, (Word){.text = text, .length = strlen(text)});
}

bool word_is_in_any_case(Word word, const char *text)
{
    return word.length == strlen(text) && strncasecmp(word.text, text, word.length) == 0;
}

bool word_is_number(Word word)
{
    double number;
    return number_read(word.text, word.length, &number) != NUMBER_MALFORMED;
}

// Returns the next value's word, or reports an error if there is none.
static bool line_value(Line *line, const char *name, Word *word)
{
    *word = value_word(line);
    return word->length > 0 || report_error(line->report, word->offset, "'%s' is missing", name);
}

bool line_field(Line *line, const LineField *field, void *values)
{
    return field->read(line, field->name, field->range, (char *)values + field->offset);
}

bool line_number(Line *line, const char *name, const Range *range, void *value)
{
    Word word;
    if (!line_value(line, name, &word)) return false;
    const bool is_read = number_read_field(line->report, word, name, range, value);
    if (!is_read) line->at = word.text;
    return is_read;
}

bool line_whole_number(Line *line, const char *name, const Range *range, void *value)
{
    double number;
    const Word word = value_peek(line);
    if (!line_number(line, name, range, &number)) return false;
    if (number != floor(number)) {
        line->at = word.text;
        return report_error(line->report, word.offset, "'%s' must be a whole number, not '%.*s'", name,
                            WORD_TEXT(word));
    }
    *(unsigned *)value = (unsigned)number;
    return true;
}

static size_t comma_count(Word word)
{
    size_t count = 0;
    for (size_t i = 0; i < word.length; i++)
        count += word.text[i] == ',';
    return count;
}

// Returns whether the next word belongs to this one, because the blank between them is next to a comma.
static bool word_continues(const Line *line, Word word)
{
    const Word next = line_peek(line);
    return next.length > 0 && (word.text[word.length - 1] == ',' || next.text[0] == ',');
}

// Extends a word by the words that belong to it.
static void word_extend(Line *line, Word *word)
{
    while (word_continues(line, *word)) {
        const Word next = line_word(line);
        word->length = next.offset + next.length - word->offset;
    }
}

Word line_peek_vector(const Line *line)
{
    Line copy = *line;
    Word word = line_word(&copy);
    if (word.length > 0 && line->joins_blanks) word_extend(&copy, &word);
    return word;
}

bool line_comma_vector(Line *line, const char *name, const Range *range, void *value)
{
    Word word;
    if (!line_value(line, name, &word)) return false;
    const bool has_blanks = word_continues(line, word);
    word_extend(line, &word);
    if (has_blanks && !line->joins_blanks && comma_count(word) == 2)
        return report_error(line->report, word.offset,
                            "'%s' has blanks next to its commas ('%.*s'); --lenient accepts them", name,
                            WORD_TEXT(word));
    if (comma_count(word) != 2)
        return report_error(line->report, word.offset,
                            "'%s' must be three numbers separated by commas, not '%.*s'", name,
                            WORD_TEXT(word));
    double values[3];
    for (size_t i = 0, start = 0; i < 3; i++) {
        Word part = {word.text + start, word.offset + start, 0};
        while (start + part.length < word.length && part.text[part.length] != ',')
            part.length++;
        start += part.length + 1;
        while (part.length > 0 && character_is_blank(part.text[0]))
            part = (Word){part.text + 1, part.offset + 1, part.length - 1};
        while (part.length > 0 && character_is_blank(part.text[part.length - 1]))
            part.length--;
        if (!number_read_field(line->report, part, name, range, &values[i])) return false;
    }
    *(Vector3 *)value = (Vector3){values[0], values[1], values[2]};
    return true;
}

bool line_vector(Line *line, const char *name, const Range *range, void *value)
{
    double values[3];
    for (size_t i = 0; i < 3; i++) {
        if (i > 0 && !line->spans_lines && line_peek(line).length == 0)
            return report_error(line->report, line_offset(line), "'%s' must be three numbers, not %zu", name,
                                i);
        if (!line_number(line, name, range, &values[i])) return false;
    }
    *(Vector3 *)value = (Vector3){values[0], values[1], values[2]};
    return true;
}

bool line_elements(Line *line, Scene *scene, void (*read)(void *reader), void *reader)
{
    bool is_empty = true;
    while (!report_is_full(line->report) && line_reach_word(line)) {
        const uint32_t number = line->number;
        const size_t first = scene->objects.count;
        is_empty = false;
        read(reader);
        for (size_t i = first; i < scene->objects.count; i++)
            scene->objects.items[i].line = number;
        if (!line->spans_lines && !line_next(line)) break;
    }
    return !is_empty;
}

bool line_end(Line *line)
{
    const Word word = line_word(line);
    return !word.length ||
           report_error(line->report, word.offset, "the line must end before '%.*s'", WORD_TEXT(word));
}

bool line_is_first(const Line *line, bool *has_one, const char *what)
{
    if (*has_one)
        return report_error(line->report, line->start, "there is a second %s; only one is allowed", what);
    *has_one = true;
    return true;
}

void unused_record(UnusedWords *unused, Report *report, Word word, const char *what)
{
    for (size_t i = 0; i < unused->count; i++)
        if (words_equal(unused->words[i], word)) return;
    if (unused->count == COUNT_OF(unused->words)) return;
    unused->words[unused->count++] = word;
    report_warning(report, word.offset, "'%.*s' %s", WORD_TEXT(word), what);
}
