// Writes a report in formats for other programs, which are all made from its JSON. By default a command
// prints text.
#pragma once

#include "host/base/json.h"
#include "host/cli/command_line.h"

typedef enum {
    FORMAT_TEXT,
    FORMAT_JSON,
    FORMAT_CSV,
    FORMAT_MARKDOWN,
    FORMAT_JUNIT,     // one test case per row, as CI systems show them
    FORMAT_BENCHMARK, // google/benchmark's JSON, which needs times
    FORMAT_COUNT
} ReportFormat;

enum { RESULT_NAMES_MAX = 8, RESULT_VALUES_MAX = 16 };

// Describes a command's results as rows.
typedef struct {
    const char *command;
    // The path of the array of rows, such as "scenes.variants" for one array in each object of another. If it
    // is "", the document is the only row.
    const char *rows;
    // The columns that name a row, and the others, up to NULL, as "path" or "heading=path". The path names a
    // member, with dots between members, such as "frame_ms.median". It is looked up in the row, then in the
    // object whose array has the row, then in the document.
    const char *names[RESULT_NAMES_MAX + 1], *values[RESULT_VALUES_MAX + 1];
    // The paths of verdicts, up to NULL, and the value with which a row has failed: "true", "false" or a
    // text. The first verdict that the row has counts.
    const char *verdicts[2], *failed;
    // The paths of times in milliseconds for FORMAT_BENCHMARK, one per row or one per run, or NULL if the
    // command measures none.
    const char *times, *processor_times;
    const char *seconds; // the path of the seconds that the row took, for FORMAT_JUNIT, or NULL
} ResultTable;

typedef struct {
    const ResultTable *table; // describes the command's results
    ReportFormat format;
    bool has_format; // whether --format was given
    // The file that receives the report while stdout receives the text. NULL prints the report instead of the
    // text.
    const char *output;
} ReportOptions;

// Returns the heading of a column.
ShortText column_heading(const char *column);

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
