// A report's formats for other programs, all made from its JSON: the text is what a command prints by itself.
#pragma once

#include "host/base/json.h"
#include "host/cli/options.h"

typedef enum {
    FORMAT_TEXT,
    FORMAT_JSON,
    FORMAT_CSV,
    FORMAT_MARKDOWN,
    FORMAT_JUNIT,     // one test case per row, as CI systems show them
    FORMAT_BENCHMARK, // google/benchmark's JSON
    FORMAT_COUNT
} ReportFormat;

typedef struct {
    ReportFormat format;
    const char
        *output; // the file that gets the report, next to the text on stdout; NULL: it replaces the text
} ReportOptions;

// A column of a row's values. `path` names its member, with dots between members, such as "frame_ms.median";
// it is looked for in the row, then in the object whose array has the row, then in the document.
typedef struct {
    const char *heading, *path;
} ResultColumn;

enum { RESULT_COLUMNS_MAX = 24 };

// A command's results as rows.
typedef struct {
    const char *command;
    const char *rows; // the array of rows, or one array in each object of another, such as "scenes.variants";
                      // "": one row, the document
    ResultColumn
        columns[RESULT_COLUMNS_MAX]; // up to one without a heading; the first `name_count` name the row
    size_t name_count;
    // The paths of verdicts, up to NULL, and the value with which a row has failed: "true", "false" or a
    // text. The first that the row has counts.
    const char *verdicts[2], *failed;
    // Of times, for FORMAT_BENCHMARK: in milliseconds, one or one of each run. NULL: the command measures
    // none.
    const char *times, *processor_times;
    const char *seconds; // that the row took, for FORMAT_JUNIT; NULL: not known
} ResultTable;

enum { OPTION_FORMAT = 0x500, OPTION_REPORT_JSON, OPTION_REPORT_OUTPUT };
#define FORMAT_LONG_OPTIONS                                                                                  \
    {"json", no_argument, NULL, OPTION_REPORT_JSON}, {"format", required_argument, NULL, OPTION_FORMAT},     \
    {                                                                                                        \
        "output", required_argument, NULL, OPTION_REPORT_OUTPUT                                              \
    }
#define HELP_FORMAT                                                                                          \
    "      --format F        text, json, csv, markdown, junit or benchmark (default: text, with --output "   \
    "by the\n                        file's ending: .json .csv .md .xml)\n"                                  \
    "      --output FILE     write the report to a file and print the text\n"                                \
    "      --json            print JSON\n"

// Handles one of FORMAT_LONG_OPTIONS; *valid receives whether its value is valid. False if `option` is
// another.
bool option_report(ReportOptions *options, int option, const char *value, bool *valid);
// Checks the options together, last of a command's, and opens the file. False with a message: the command has
// no times, the file's format is not known, or it cannot be written.
bool report_options_check(ReportOptions *options, const ResultTable *table);
// Whether the command prints its text.
static inline bool report_has_text(const ReportOptions *options)
{
    return options->format == FORMAT_TEXT || options->output;
}
// Writes the report in the options' format, which is not FORMAT_TEXT, and frees it. False with a message: the
// file cannot be written.
bool report_write(Json *json, const ResultTable *table, const ReportOptions *options);
