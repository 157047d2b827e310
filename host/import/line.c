#include "host/import/line.h"
#include "host/base/text.h"
#include "host/import/place.h"

#include <string.h>
#include <strings.h>

bool line_open(Line *line, Report *report, char comment)
{
    const Source *source = report->source;
    bool has_mark = source->length >= 3 && !memcmp(source->bytes, "\xEF\xBB\xBF", 3);
    *line = (Line){.report = report, .next = has_mark ? 3 : 0, .comment = comment};
    const char *nul = source->length ? memchr(source->bytes, '\0', source->length) : NULL;
    if (nul) report_error(report, (size_t)(nul - source->bytes), "not text: a NUL character");
    return !nul;
}

bool line_next(Line *line)
{
    const Source *source = line->report->source;
    if (line->next >= source->length) return false;
    line->start = line->at = line->next;
    const char *bytes = source->bytes + line->start;
    line->end = line->start;
    while (line->end < source->length &&
           !text_ends_line(source->bytes + line->end, source->length - line->end))
        line->end++;
    line->next = line->end < source->length ? line->end + 1 : line->end;
    if (line->end > line->start && source->bytes[line->end - 1] == '\r') line->end--;
    const char *comment = line->comment ? memchr(bytes, line->comment, line->end - line->start) : NULL;
    if (comment) line->end = (size_t)(comment - source->bytes);
    return true;
}

bool line_next_filled(Line *line)
{
    return line_next(line) && line_reach_word(line);
}

bool line_reach_word(Line *line)
{
    while (!line_peek(line).length)
        if (!line_next(line)) return false;
    return true;
}

size_t line_skip_blanks(Line *line)
{
    while (line->at < line->end && character_is_blank(line->report->source->bytes[line->at]))
        line->at++;
    return line->at;
}

Word line_word(Line *line)
{
    const char *bytes = line->report->source->bytes;
    const size_t start = line_skip_blanks(line);
    while (line->at < line->end && !character_is_blank(bytes[line->at]))
        line->at++;
    return (Word){.text = bytes + start, .offset = start, .length = line->at - start};
}

Word line_peek(const Line *line)
{
    Line copy = *line;
    return line_word(&copy);
}

Word free_peek(Line *line)
{
    line_reach_word(line);
    return line_peek(line);
}

Word free_word(Line *line)
{
    line_reach_word(line);
    return line_word(line);
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

// Returns the next word, or reports an error if there is none.
static bool line_value(Line *line, const char *name, Word *word)
{
    *word = line_word(line);
    if (!word->length) report_error(line->report, word->offset, "'%s' is missing", name);
    return word->length > 0;
}

bool line_field(Line *line, const LineField *field, void *values)
{
    return field->read(line, field->name, field->range, (char *)values + field->offset);
}

bool line_number(Line *line, const char *name, const Range *range, void *value)
{
    Word word;
    return line_value(line, name, &word) && number_read_field(line->report, word, name, range, value);
}

bool line_whole_number(Line *line, const char *name, const Range *range, void *value)
{
    double number;
    size_t offset = line_peek(line).offset;
    if (!line_number(line, name, range, &number)) return false;
    if (number != floor(number))
        return report_error(line->report, offset, "'%s' must be a whole number", name);
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
                            "'%s' has blanks next to commas, '%.*s'; --lenient reads them", name,
                            WORD_TEXT(word));
    if (comma_count(word) != 2)
        return report_error(line->report, word.offset,
                            "'%s' must be three numbers with commas between, not '%.*s'", name,
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

bool line_blank_vector(Line *line, const char *name, const Range *range, void *value)
{
    double values[3];
    for (size_t i = 0; i < 3; i++) {
        if (i && !line_peek(line).length)
            return report_error(line->report, line->at, "'%s' must be three numbers, not %zu", name, i);
        if (!line_number(line, name, range, &values[i])) return false;
    }
    *(Vector3 *)value = (Vector3){values[0], values[1], values[2]};
    return true;
}

static bool free_read(Line *line, LineReader *read, const char *name, const Range *range, void *value)
{
    line_reach_word(line);
    const size_t start = line->at;
    const bool is_read = read(line, name, range, value);
    if (!is_read) line->at = start;
    return is_read;
}

bool free_number(Line *line, const char *name, const Range *range, void *value)
{
    return free_read(line, line_number, name, range, value);
}

bool free_whole_number(Line *line, const char *name, const Range *range, void *value)
{
    return free_read(line, line_whole_number, name, range, value);
}

bool free_vector(Line *line, const char *name, const Range *range, void *value)
{
    Vector3 *vector = value;
    return free_number(line, name, range, &vector->x) && free_number(line, name, range, &vector->y) &&
           free_number(line, name, range, &vector->z);
}

bool line_elements(Line *line, Scene *scene, bool (*next)(Line *line), void (*read)(void *reader),
                   void *reader)
{
    bool is_empty = true;
    Places places = places_open(line->report->source, NULL);
    while (!report_is_full(line->report) && next(line)) {
        const size_t offset = line_peek(line).offset;
        is_empty = false;
        read(reader);
        places_record(&places, scene, offset);
    }
    places_close(&places);
    return !is_empty;
}

bool line_end(Line *line)
{
    Word word = line_word(line);
    if (word.length) report_error(line->report, word.offset, "unexpected '%.*s'", WORD_TEXT(word));
    return !word.length;
}

bool line_is_first(const Line *line, bool *has_one, const char *what)
{
    if (*has_one) return report_error(line->report, line->start, "a second %s", what);
    *has_one = true;
    return true;
}
