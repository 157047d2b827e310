#include "host/import/mesh/scan.h"

#include "host/base/array.h"

bool scan_is_text(Scan *scan, Report *report)
{
    const size_t length = (size_t)(scan->end - scan->start);
    const char *nul = length > 0 ? memchr(scan->start, '\0', length) : NULL;
    if (nul) report_error(report, (size_t)(nul - scan->start), "not text: a NUL character");
    if (length >= 3 && memcmp(scan->start, "\xEF\xBB\xBF", 3) == 0) scan->at += 3;
    return !nul;
}

void unused_record(UnusedWords *unused, Report *report, Word word, const char *what)
{
    for (size_t i = 0; i < unused->count; i++)
        if (words_equal(unused->words[i], word)) return;
    if (unused->count == COUNT_OF(unused->words)) return;
    unused->words[unused->count++] = word;
    report_warning(report, word.offset, "'%.*s' %s", WORD_TEXT(word), what);
}
