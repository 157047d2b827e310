#include "host/import/mesh/scan.h"

#include "host/base/array.h"

bool scan_is_text(Scan *scan, Report *report)
{
    Line line;
    const bool is_text = line_open(&line, report, '\0');
    scan->at += line.next;
    return is_text;
}

void unused_record(UnusedWords *unused, Report *report, Word word, const char *what)
{
    for (size_t i = 0; i < unused->count; i++)
        if (words_equal(unused->words[i], word)) return;
    if (unused->count == COUNT_OF(unused->words)) return;
    unused->words[unused->count++] = word;
    report_warning(report, word.offset, "'%.*s' %s", WORD_TEXT(word), what);
}
