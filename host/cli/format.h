// Writes a report in formats for other programs, which are all made from its JSON. By default a command
// prints text.
#pragma once

#include "host/base/json.h"
#include "host/cli/command_line.h"
#include "host/cli/result_text.h"

typedef enum {
    FORMAT_TEXT,
    FORMAT_JSON,
    FORMAT_CSV,
    FORMAT_MARKDOWN,
    FORMAT_JUNIT,     // one test case per row, as CI systems show them
    FORMAT_BENCHMARK, // google/benchmark's JSON, which needs times
    FORMAT_COUNT
} ReportFormat;

typedef struct {
    const ResultTable *table; // describes the command's results
    ReportFormat format;
    bool has_format; // whether --format was given
    // The file that receives the report while stdout receives the text. NULL prints the report instead of the
    // text.
    const char *output;
} ReportOptions;

extern const Option format_option, timed_format_option; // the latter of commands that measure times

enum { REPORT_OUTPUT, REPORT_JSON, REPORT_OPTION_COUNT };
extern const Option report_options[REPORT_OPTION_COUNT];
// Chooses the format by the file's ending if none is given. Returns a mistake if the file is standard output
// or would receive text.
OptionCheck report_options_check;
// The groups of the options of CommonOptions.report, which must follow those of options that create folders,
// since the file may be in one.
#define REPORT_OPTIONS_OF(format)                                                                            \
    OPTION(format),                                                                                          \
    {                                                                                                        \
        .items = report_options, .count = COUNT_OF(report_options), .check = report_options_check            \
    }
#define REPORT_OPTIONS       REPORT_OPTIONS_OF(format_option)
#define TIMED_REPORT_OPTIONS REPORT_OPTIONS_OF(timed_format_option)

// Returns whether the command prints its text.
static inline bool report_has_text(const ReportOptions *options)
{
    return options->format == FORMAT_TEXT || options->output;
}
// Returns whether the command writes a report in another format.
static inline bool report_has_document(const ReportOptions *options)
{
    return options->format != FORMAT_TEXT;
}
// Writes the report in the options' format, which is not FORMAT_TEXT, and frees it. Returns false with a
// message if the file cannot be written.
bool report_write(Json *json, const ReportOptions *options);
// Prints the report's rows as text, with notes, and writes the report in the options' format, each only if
// the options request it. Frees the report. Returns false as report_write does.
bool report_output(Json *json, const ReportOptions *options, RowNotes *notes, const void *context);
