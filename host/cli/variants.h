// Runs the configurations of a command line, each for every scene, interleaved and timed. Shared by glint
// bench and glint accuracy.
#pragma once

#include "host/cli/bench_variant.h"
#include "host/cli/options.h"
#include "host/cli/progress.h"
#include "host/measure/calibration.h"

enum { SAMPLE_CHOICES_MAX = 16 };

typedef struct {
    CommonOptions common;
    unsigned lanes, bvhs; // sets, where empty lanes mean the device's default
    uint32_t samples[SAMPLE_CHOICES_MAX];
    size_t sample_choices; // 0 for one sample
    double seconds;        // 0 for the default
    bool no_build_times;   // of a benchmark
    const char *name;      // the text of --variant, or NULL
} VariantOptions;

extern const VariantOptions variant_options_default; // precision single, defaults for everything else

extern const Option variant_choice_options[3]; // --variant accepts these and others
extern const Option variant_set_options[1];    // shared by all rows
enum { SECONDS_MAX = 1000000000 };

// The groups of options of a command with VariantOptions, which follow the command's other groups.
#define VARIANT_OPTIONS                                                                                      \
    OPTIONS(variant_choice_options), OPTION(ray_options[RAY_BOUNCES]), OPTIONS(size_option),                 \
        OPTIONS(variant_set_options), OPTIONS(set_options), OPTIONS(device_option),                          \
        OPTIONS(reference_option), OPTION(common_options[COMMON_LENIENT]), OPTIONS(max_pixels_option)

typedef struct {
    Scene *scenes;
    size_t scene_count;
    // Parallel arrays, grouped by scene:
    Variant *variants;
    BenchRow *rows;
    size_t count;
    size_t rows_before, row_count; // positions in the set that this one is a part of
    Calibration calibration;       // runs before each round of a benchmark
} VariantSet;

// Reads the scenes. The choices are the options of each --variant, or those of a command without any. Returns
// false with a message if a scene cannot be read; the set must still be closed.
bool variant_set_open(VariantSet *set, const VariantOptions *choices, size_t choice_count, char *const *paths,
                      size_t count);
// Returns the variants of one scene as a set that shares them, for variant_set_measure. It must not be
// closed.
VariantSet variant_set_part(const VariantSet *set, size_t first, size_t count);
// Sets the rows' lanes to those that the device uses. If it uses fewer than requested and the row equals an
// earlier one, the row keeps the requested lanes and is not available.
void variant_set_fit_lanes(VariantSet *set, const Device *device);
// Opens each available variant and warms it up. `progress` may be NULL. Returns false if the user interrupted
// or the device failed.
bool variant_set_start(VariantSet *set, Compute *compute, bool timing_builds, Progress *progress);
// Runs every variant once. Returns false if the user interrupted or the device failed.
bool variant_set_round(VariantSet *set, bool warm_up);
// The fractions of a row's work that are done after it is opened, and after it is measured.
extern const double variants_opened_fraction, variants_measured_fraction;
// Measures the variants interleaved (A B C A B C …), so that drift affects all alike, until the times
// converge or a share of options->seconds passes. If `is_benchmark`, also times the builds unless
// options->no_build_times, and calibrates each round. Returns false if the user interrupted or the device
// failed.
bool variant_set_measure(VariantSet *set, const VariantOptions *options, Compute *compute, bool is_benchmark,
                         Progress *progress);
bool variant_set_any_measured(const VariantSet *set);
// Returns the row with which a variant is compared. Among the rows of the same scene and the first --variant,
// it is the earliest that has most of precision, lanes, BVH and samples in common.
size_t variant_set_first(const VariantSet *set, size_t row);
// Returns the fraction of all rows that is done if one set after another is opened, measured and compared. It
// counts the rows before those of the set, and the fraction of the set's rows.
double variant_set_fraction(const VariantSet *set, double fraction_done);
void variant_set_close(VariantSet *set);
