// Compares reports of glint bench from several devices, versions or days, row by row.
#pragma once

#include <stddef.h>

enum { SIDE_REPORTS_MAX = 26 }; // a report is named by a letter

// Reads reports, prints their comparison and writes it as a page unless `page` is NULL. Returns the exit
// status.
int side_by_side_run(char *const *paths, size_t count, const char *page);
