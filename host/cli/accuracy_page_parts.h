// The parts of the page of glint accuracy.
#pragma once

#include "host/base/embedded.h"
#include "host/base/text.h"
#include "host/cli/accuracy_report.h"

// The files of host/cli/page/: "page.html", …; ended by a NULL name.
extern const EmbeddedFile page_files[];

// The mark of its precision, and its name.
void page_variant_name(Text *page, const AccuracyScene *scene, size_t variant);
// Times and errors, all sortable.
void page_tables(Text *page, const AccuracyScene *scene);

// The reference's picture; the others' beside their differences; the surroundings of the worst pixels.
void page_reference(Text *page, const AccuracyScene *scene);
void page_pictures(Text *page, const AccuracyScene *scene);
