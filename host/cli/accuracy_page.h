// What glint accuracy reports, as one page of HTML that needs nothing beside it: no network, no other file.
#pragma once

#include "host/base/text.h"
#include "host/cli/accuracy_report.h"

// Appends the page: the text of page/page.html with its places filled, the figures as accuracy_json has them,
// and the pictures with 8 bits.
void accuracy_page(Text *page, const AccuracyReport *report);
