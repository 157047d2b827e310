#include "host/cli/page.h"

#include "host/base/embedded.h"
#include "host/base/fault.h"
#include <stdlib.h>
#include <string.h>

extern const EmbeddedFile page_files[]; // the files of host/cli/page/, ended by a NULL name

static const char *page_file(const char *name, size_t length)
{
    for (const EmbeddedFile *file = page_files; file->name; file++)
        if (strncmp(file->name, name, length) == 0 && file->name[length] == '\0') return file->text;
    fault("no file of the page is called %.*s", (int)length, name);
}

// In JSON, `<` occurs only within strings. Written as \u003c it can neither end a script element nor start a
// comment.
static void json_embed(Text *page, Json *json)
{
    OwnedText text = json_close(json);
    for (const char *from = text_c(&text); *from;) {
        size_t safe = strcspn(from, "<");
        text_append(page, from, safe);
        from += safe;
        if (*from == '<') {
            text_appendf(page, "\\u003c");
            from++;
        }
    }
}

void page_append(Text *page, const char *template, Json *report, Json *extras)
{
    const char *from = page_file(template, strlen(template)), *open;
    while ((open = strstr(from, "{{"))) {
        const char *name = open + 2, *close = strstr(name, "}}");
        size_t length = (size_t)(close - name);
        text_append(page, from, (size_t)(open - from));
        if (strncmp(name, "report", length) == 0)
            json_embed(page, report);
        else if (strncmp(name, "extras", length) == 0)
            json_embed(page, extras);
        else
            text_appendf(page, "%s", page_file(name, length));
        from = close + 2;
    }
    text_appendf(page, "%s", from);
}
