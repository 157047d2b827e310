// Composes self-contained HTML reports from one template, into which a report's JSON is embedded. The page's
// scripts draw it.
#pragma once

#include "host/base/json.h"
#include "host/base/text.h"

// Appends host/cli/page/page.html with its placeholders filled: {{report}} and {{extras}} with that JSON, any
// other with the file of host/cli/page/ that it names. `report` is what --json prints, and `extras` has the
// data that only the page needs. Frees both.
void page_append(Text *page, Json *report, Json *extras);
