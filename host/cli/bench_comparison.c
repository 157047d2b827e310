#include "host/cli/bench_comparison.h"

#include "host/base/exit_status.h"
#include "host/cli/command_line.h"
#include "host/cli/report_json.h"
#include <math.h>

RowComparison row_compare(const RowTimes *newer, const RowTimes *older, bool is_cpu, size_t row_count,
                          double tolerance)
{
    const size_t count = row_count * (is_cpu ? 2 : 1);
    RowComparison row = {.has_processor = is_cpu,
                         .frame = comparison_of_reports(newer->wall, older->wall, count, tolerance)};
    row.verdict = row.frame.verdict;
    if (!is_cpu) return row;
    row.processor = comparison_of_reports(newer->processor, older->processor, count, tolerance);
    row.verdict = verdict_of_row(row.frame.verdict, row.processor.verdict);
    return row;
}

static void ratio_append(Text *notes, const char *of_what, const Comparison *result)
{
    text_appendf(notes, "    new/old %s time %.3f", of_what, result->ratio);
    if (isfinite(result->high)) text_appendf(notes, " (%.3f to %.3f)", result->low, result->high);
    switch (result->verdict) {
    case VERDICT_UNDECIDED:
        text_appendf(notes, ": too noisy to decide\n");
        break;
    case VERDICT_SAME:
        text_appendf(notes, ": same within %.1f%%\n", 100 * fmax(result->high - 1, 1 / result->low - 1));
        break;
    case VERDICT_SLOWER:
        text_appendf(notes, ": slower by at least %.1f%%\n", 100 * (result->low - 1));
        break;
    case VERDICT_FASTER:
        text_appendf(notes, ": faster by at least %.1f%%\n", 100 * (1 / result->high - 1));
        break;
    }
}

void comparison_append(Text *notes, const RowComparison *comparison)
{
    if (comparison->why_not) return;
    ratio_append(notes, "frame", &comparison->frame);
    if (comparison->has_processor) ratio_append(notes, "processor", &comparison->processor);
}

int comparisons_status(const RowComparison *comparisons, size_t count, const char *other)
{
    size_t counts[VERDICT_FASTER + 1] = {0}, compared = 0;
    for (size_t i = 0; i < count; i++) {
        if (comparisons[i].why_not) continue;
        compared++;
        counts[comparisons[i].verdict]++;
    }
    if (compared == 0) {
        stderr_print("%s has no row of these scenes and options, so nothing was compared", other);
        return EXIT_USER;
    }
    if (counts[VERDICT_SLOWER] > 0) {
        stderr_print("%zu of %zu rows are slower than %s", counts[VERDICT_SLOWER], compared, other);
        return EXIT_CHECK;
    }
    if (counts[VERDICT_UNDECIDED] > 0) {
        stderr_print("too noisy to compare %zu of %zu rows with %s", counts[VERDICT_UNDECIDED], compared,
                     other);
        return EXIT_UNDECIDED;
    }
    return EXIT_DONE;
}

void verdict_json(Json *json, const Comparison *comparison, Verdict verdict)
{
    json_text(json, "verdict", verdict_names[verdict]);
    ratio_json(json, comparison);
}

void comparison_json(Json *json, const RowComparison *comparison)
{
    json_begin_object(json, "comparison");
    if (comparison->why_not) {
        unavailable_json(json, comparison->why_not);
    } else {
        verdict_json(json, &comparison->frame, comparison->verdict);
        if (comparison->has_processor) {
            json_begin_object(json, "processor");
            verdict_json(json, &comparison->processor, comparison->processor.verdict);
            json_end(json);
        }
    }
    json_end(json);
}
