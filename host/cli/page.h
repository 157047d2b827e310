// Composes self-contained HTML reports from templates in which a report's JSON is embedded. The page's
// scripts draw it.
#pragma once

#include "host/base/json.h"
#include "host/base/text.h"

// Appends a template, which is a file of host/cli/page/, and fills its placeholders. {{report}} and
// {{extras}} become that JSON, and any other placeholder becomes the file of host/cli/page/ that it names.
// `extras` is data that only the page needs, or NULL if the template does not name it. Frees both JSON texts.
void page_append(Text *page, const char *template, Json *report, Json *extras);
