// Reads earlier reports of glint bench, to compare others with them.
#pragma once

#include "host/base/array.h"
#include "host/base/message.h"
#include "host/measure/bench.h"
#include "host/measure/calibration.h"
#include "host/measure/comparison.h"

// The version of the reports' schema, and the oldest that can be read.
enum { BENCH_SCHEMA = 7, BENCH_SCHEMA_OLDEST = 6 };

// The ratio of times up to which rows of two reports count as the same, unless the user chooses another.
extern const double baseline_tolerance;

// A row of a report, with times in seconds. Members that the report lacks are zeros, or "" for texts,
// except that a missing variant is NULL.
typedef struct {
    BenchKey key;
    const char *failure;   // why the row has no times
    Summary frame, kernel; // without quartiles if the report has only a summary
    double rays_per_second;
    Series frame_times, processor_times;
} BaselineRow;

typedef struct {
    ARRAY_OF(BaselineRow);
    Calibration calibration;
    // The report's origin. Each text is "" if it is unknown.
    const char *date, *version, *commit, *host;
    const char *device, *device_type, *board, *platform, *driver;
    bool is_calibrated;  // by this program's workload
    struct json_t *json; // owns the texts
} Baseline;

// Reads a file that glint bench --json wrote. Returns NULL with a message if it is not such a report, or if
// it needs a calibration and was calibrated by another workload.
Baseline *baseline_open(const char *path, bool needs_calibration, MessageList *messages);
void baseline_close(Baseline *baseline);

// Returns whether two keys name the same row. The scenes' paths are ignored, and "" is the same variant as
// NULL.
bool bench_key_equal(const BenchKey *a, const BenchKey *b);
// Finds the wall and processor times of the row with this key. The scene's path is ignored. Returns false if
// the baseline lacks the row.
bool baseline_find(const Baseline *baseline, const BenchKey *key, ReportTimes *wall, ReportTimes *processor);

// Returns why no claim can be made about which report's rows are faster, or NULL if it can. The text calls
// the newer report "it" and the older one "the first report".
const char *baselines_why_not_compared(const Baseline *newer, const Baseline *older);
