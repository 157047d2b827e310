// Self-contained HTML reports: one template, into which a report's JSON is embedded; the page's scripts draw
// it.
#pragma once

#include "host/base/json.h"
#include "host/base/text.h"

// Appends host/cli/page/page.html with its placeholders filled: {{report}} and {{extras}} by that JSON, any
// other by the file of host/cli/page/ that it names. `report` is what --json prints, `extras` what only the
// page needs; both are freed.
void page_append(Text *page, Json *report, Json *extras);
