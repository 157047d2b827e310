#include "host/cli/format.h"

#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/output.h"
#include "host/base/text.h"
#include "host/cli/options.h"
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const char *const format_names[FORMAT_COUNT] = {"text",     "json",  "csv",
                                                       "markdown", "junit", "benchmark"};

static const unsigned json_format[] = {FORMAT_JSON};

// The file of the report, of which a command writes one.
static OutputFile report_file;

// Opens the file before anything is measured, so that a failure shows early.
static bool report_file_open(const Option *option, void *options)
{
    MessageList messages = {0};
    const bool is_open = output_open(&report_file, *(const char **)option_field(option, options), &messages);
    messages_print(&messages, NULL);
    return is_open;
}

#define DEFAULT_FORMAT " (default: text, with --output by the file's ending: .json .csv .md .xml)"

const Option format_option = {"format",
                              "F",
                              "text, json, csv, markdown or junit" DEFAULT_FORMAT,
                              option_choice,
                              offsetof(CommonOptions, report.format),
                              .names = format_names,
                              .name_count = FORMAT_BENCHMARK,
                              .given = offsetof(CommonOptions, report.has_format)};
const Option timed_format_option = {"format",
                                    "F",
                                    "text, json, csv, markdown, junit or benchmark" DEFAULT_FORMAT,
                                    option_choice,
                                    offsetof(CommonOptions, report.format),
                                    NAMES(format_names),
                                    .given = offsetof(CommonOptions, report.has_format)};

const Option report_options[] = {{"output", "FILE", "write the report to a file and print the text",
                                  option_named_file, offsetof(CommonOptions, report.output),
                                  .effect = report_file_open},
                                 {"json", NULL, "print JSON", option_choice,
                                  offsetof(CommonOptions, report.format), .values = json_format}};

static ReportFormat format_of_ending(const char *path)
{
    static const struct {
        const char *ending;
        ReportFormat format;
    } endings[] = {
        {".json", FORMAT_JSON}, {".csv", FORMAT_CSV}, {".md", FORMAT_MARKDOWN}, {".xml", FORMAT_JUNIT}};
    const char *ending = strrchr(path, '.');
    for (size_t i = 0; ending && i < COUNT_OF(endings); i++)
        if (strcasecmp(ending, endings[i].ending) == 0) return endings[i].format;
    return FORMAT_TEXT;
}

const char *report_options_check(void *common)
{
    ReportOptions *options = &((CommonOptions *)common)->report;
    const bool needs_format = options->output && options->format == FORMAT_TEXT;
    if (needs_format && options->has_format)
        return "--format text cannot be combined with --output, since the text is printed in any case";
    if (needs_format) options->format = format_of_ending(options->output);
    if (options->output && options->format == FORMAT_TEXT)
        return "--output: the file's ending gives no format; use --format";
    return NULL;
}

// Appends the row's name, which consists of its first columns that have a value, separated by `between`.
static void name_append(Text *text, const ResultRow *row, const ResultTable *table, const char *between)
{
    for (size_t i = 0; table->names[i]; i++) {
        OwnedText value = column_text(row, table->names[i]);
        if (value.count > 0 || i == 0) text_appendf(text, "%s%s", i > 0 ? between : "", text_c(&value));
    }
}

typedef enum { ROW_PASSED, ROW_FAILED, ROW_UNAVAILABLE } RowOutcome;

static RowOutcome row_outcome(const ResultRow *row, const ResultTable *table)
{
    if (row_unavailable(row)) return ROW_UNAVAILABLE;
    const json_t *verdict = NULL;
    for (size_t i = 0; i < 2 && table->verdicts[i] && !verdict; i++)
        verdict = member_at(row->sources[0], table->verdicts[i]);
    OwnedText text = {0};
    value_append(&text, verdict);
    return verdict && strcmp(text_c(&text), table->failed) == 0 ? ROW_FAILED : ROW_PASSED;
}

// A character that a format reserves, and its replacement. A newline stands for all control characters, which
// are kept by a table without it. '\0' ends a table.
typedef struct {
    char character;
    const char *replacement;
} Escape;

static const Escape xml_escapes[] = {{'&', "&amp;"},  {'<', "&lt;"}, {'>', "&gt;"},
                                     {'"', "&quot;"}, {'\n', " "},   {'\0', NULL}};
static const Escape markdown_escapes[] = {
    {'|', "\\|"}, {'\\', "\\\\"}, {'<', "&lt;"}, {'\n', " "}, {'\0', NULL}};
static const Escape csv_escapes[] = {{'"', "\"\""}, {'\0', NULL}};

static void escaped_append(Text *text, const char *from, const Escape *escapes)
{
    for (; *from; from++) {
        const char character = (unsigned char)*from < ' ' ? '\n' : *from;
        const Escape *escape = escapes;
        while (escape->character && escape->character != character)
            escape++;
        const char *written = escape->character ? escape->replacement : from;
        text_append(text, written, escape->character ? strlen(written) : 1);
    }
}

typedef struct {
    const ResultTable *table;
    const json_t *document;
    Text body;
    size_t counts[ROW_UNAVAILABLE + 1];
    size_t row_count;
} Writing;

typedef void RowWriter(Writing *writing, const ResultRow *row);

static void csv_row(Writing *writing, const ResultRow *row)
{
    const char *column;
    for (size_t i = 0; (column = column_at(writing->table, i)); i++) {
        OwnedText value = column_text(row, column);
        const char *quote = strpbrk(text_c(&value), ",\"\r\n") ? "\"" : "";
        text_appendf(&writing->body, "%s%s", i > 0 ? "," : "", quote);
        escaped_append(&writing->body, text_c(&value), csv_escapes);
        text_appendf(&writing->body, "%s", quote);
    }
    text_appendf(&writing->body, "\n");
}

static void markdown_row(Writing *writing, const ResultRow *row)
{
    const char *column;
    for (size_t i = 0; (column = column_at(writing->table, i)); i++) {
        OwnedText value = column_text_short(row, column);
        text_appendf(&writing->body, "| ");
        escaped_append(&writing->body, text_c(&value), markdown_escapes);
        text_appendf(&writing->body, " ");
    }
    text_appendf(&writing->body, "|\n");
}

// Appends the values that are not in the row's name, for readers of a failure.
static void details_append(Text *text, const ResultRow *row, const ResultTable *table)
{
    const size_t start = text->count;
    for (size_t i = 0; table->values[i]; i++) {
        OwnedText value = column_text(row, table->values[i]);
        if (value.count > 0)
            text_appendf(text, "%s%s %s", text->count > start ? ", " : "",
                         column_heading(table->values[i]).text, text_c(&value));
    }
}

static void junit_row(Writing *writing, const ResultRow *row)
{
    OwnedText name = {0}, details = {0};
    Text *body = &writing->body;
    name_append(&name, row, writing->table, " ");
    const RowOutcome outcome = row_outcome(row, writing->table);
    writing->counts[outcome]++;
    text_appendf(body, "  <testcase classname=\"glint.%s\" name=\"", writing->table->command);
    escaped_append(body, text_c(&name), xml_escapes);
    const json_t *seconds = writing->table->seconds ? value_at(row, writing->table->seconds) : NULL;
    if (json_is_number(seconds)) text_appendf(body, "\" time=\"%.6f", json_number_value(seconds));
    if (outcome == ROW_UNAVAILABLE)
        text_appendf(&details, "%s", row_unavailable(row));
    else
        details_append(&details, row, writing->table);
    text_appendf(body, outcome == ROW_PASSED ? "\">\n    <system-out>" : "\">\n    <%s message=\"",
                 outcome == ROW_FAILED ? "failure" : "skipped");
    escaped_append(body, text_c(&details), xml_escapes);
    text_appendf(body, outcome == ROW_PASSED ? "</system-out>\n  </testcase>\n" : "\"/>\n  </testcase>\n");
}

// Writes one entry per run, as google/benchmark does with repetitions, so that its tools compare
// distributions. The times are milliseconds; its compare.py prints no decimals, hence microseconds.
static void benchmark_row(Writing *writing, const ResultRow *row)
{
    OwnedText name = {0};
    name_append(&name, row, writing->table, "/");
    const json_t *times = value_at(row, writing->table->times),
                 *processor =
                     writing->table->processor_times ? value_at(row, writing->table->processor_times) : NULL;
    const size_t count = json_is_number(times) ? 1 : json_array_size(times);
    for (size_t i = 0; i < count; i++) {
        const double time = json_number_value(json_is_number(times) ? times : json_array_get(times, i));
        const json_t *of_processor = json_array_get(processor, i);
        json_auto_t *entry = json_pack(
            "{s:s, s:s, s:s, s:I, s:i, s:i, s:i, s:f, s:f, s:s}", "name", text_c(&name), "run_name",
            text_c(&name), "run_type", "iteration", "repetitions", (json_int_t)count, "repetition_index",
            (int)i, "threads", 1, "iterations", 1, "real_time", 1e3 * time, "cpu_time",
            1e3 * (of_processor ? json_number_value(of_processor) : time), "time_unit", "us");
        OWNED char *dumped = entry ? json_dumps(entry, JSON_COMPACT) : NULL;
        if (!dumped) fault("out of memory: JSON");
        text_appendf(&writing->body, "%s    %s", writing->row_count++ > 0 ? ",\n" : "", dumped);
    }
}

static void rows_write(Writing *writing, RowWriter *write)
{
    ResultRows rows = result_rows(writing->document, writing->table);
    for (size_t i = 0; i < rows.count; i++)
        write(writing, &rows.items[i]);
    free(rows.items);
}

static void headings_append(Writing *writing, const char *before, const char *between, const char *after)
{
    const char *column;
    for (size_t i = 0; (column = column_at(writing->table, i)); i++)
        text_appendf(&writing->body, "%s%s", i > 0 ? between : before, column_heading(column).text);
    text_appendf(&writing->body, "%s", after);
}

static void document_write(Writing *writing, ReportFormat format, Text *text)
{
    const json_t *document = writing->document;
    switch (format) {
    case FORMAT_CSV:
        headings_append(writing, "", ",", "\n");
        rows_write(writing, csv_row);
        break;
    case FORMAT_MARKDOWN:
        headings_append(writing, "| ", " | ", " |\n");
        for (size_t i = 0; column_at(writing->table, i); i++)
            text_appendf(&writing->body, "| --- ");
        text_appendf(&writing->body, "|\n");
        rows_write(writing, markdown_row);
        break;
    case FORMAT_JUNIT:
        rows_write(writing, junit_row);
        text_appendf(text,
                     "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n<testsuite name=\"glint %s\" "
                     "tests=\"%zu\" "
                     "failures=\"%zu\" errors=\"0\" skipped=\"%zu\">\n",
                     writing->table->command,
                     writing->counts[ROW_PASSED] + writing->counts[ROW_FAILED] +
                         writing->counts[ROW_UNAVAILABLE],
                     writing->counts[ROW_FAILED], writing->counts[ROW_UNAVAILABLE]);
        text_appendf(&writing->body, "</testsuite>\n</testsuites>\n");
        break;
    case FORMAT_BENCHMARK: {
        rows_write(writing, benchmark_row);
        json_auto_t *context =
            json_pack("{s:O?, s:O?, s:O?, s:s, s:O?}", "date", json_object_get(document, "date"), "host_name",
                      member_at(document, "host.name"), "num_cpus", member_at(document, "host.processors"),
                      "executable", "glint", "device", member_at(document, "device.name"));
        OWNED char *dumped = context ? json_dumps(context, JSON_COMPACT) : NULL;
        if (!dumped) fault("out of memory: JSON");
        text_appendf(text, "{\n  \"context\": %s,\n  \"benchmarks\": [\n", dumped);
        text_appendf(&writing->body, "\n  ]\n}\n");
        break;
    }
    default:
        break;
    }
    text_append(text, writing->body.items, writing->body.count);
}

static json_t *document_load(const Text *document)
{
    json_t *loaded = json_loadb(text_c(document), document->count, JSON_ALLOW_NUL, NULL);
    if (!loaded) fault("JSON: a report cannot be read back");
    return loaded;
}

// Writes a document in the options' format, which is not FORMAT_TEXT.
static bool document_output(const Text *document, const ReportOptions *options)
{
    OwnedText text = {0};
    if (options->format != FORMAT_JSON) {
        json_auto_t *loaded = document_load(document);
        Writing writing = {.table = options->table, .document = loaded};
        document_write(&writing, options->format, &text);
        text_free(&writing.body);
    }
    const Text *written = options->format == FORMAT_JSON ? document : &text;
    if (!options->output) {
        fwrite(text_c(written), 1, written->count, stdout); // main reports a failure
        return true;
    }
    MessageList messages = {0};
    const bool is_written = output_write(&report_file, text_c(written), written->count, &messages) &&
                            output_commit(&report_file, &messages);
    messages_print(&messages, NULL);
    return is_written;
}

bool report_write(Json *json, const ReportOptions *options)
{
    OwnedText document = json_close(json);
    return document_output(&document, options);
}

bool report_output(Json *json, const ReportOptions *options, RowNotes *notes, const void *context)
{
    OwnedText document = json_close(json);
    if (report_has_text(options)) {
        json_auto_t *loaded = document_load(&document);
        result_text_print(loaded, options->table, notes, context, stdout);
    }
    return !report_has_document(options) || document_output(&document, options);
}
