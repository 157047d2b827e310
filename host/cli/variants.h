// The ways of rendering that a command line asks for, each for every scene, run in turn and timed: what
// glint bench and glint accuracy share.
#pragma once

#include "host/cli/bench_variant.h"
#include "host/cli/options.h"
#include "host/cli/progress.h"

enum { SAMPLE_CHOICES_LARGEST = 16 };

typedef struct {
    CommonOptions common;
    unsigned precisions, lanes, bvhs; // sets; no lanes: the device's own
    uint32_t width, height;           // 0: not given
    uint32_t samples[SAMPLE_CHOICES_LARGEST];
    size_t sample_choices; // 0: one sample
    uint32_t bounce_count;
    double seconds; // 0: not given
} VariantOptions;

extern const VariantOptions
    variant_options_default; // single, of everything else the device's or program's own

enum {
    OPTION_SIZE = OPTION_OWN,
    OPTION_SECONDS,
    OPTION_SAMPLES,
    OPTION_BOUNCES,
    OPTION_BEYOND_VARIANTS // each subcommand's own start here
};

#define VARIANT_LONG_OPTIONS                                                                                 \
    {"precision", required_argument, NULL, OPTION_PRECISION},                                                \
        {"lanes", required_argument, NULL, OPTION_LANES}, {"bvh", required_argument, NULL, OPTION_BVH},      \
        {"size", required_argument, NULL, OPTION_SIZE},                                                      \
        {"seconds", required_argument, NULL, OPTION_SECONDS},                                                \
        {"device", required_argument, NULL, OPTION_DEVICE},                                                  \
    {                                                                                                        \
        "lenient", no_argument, NULL, OPTION_LENIENT                                                         \
    }

// Of those, but for --precision, whose default differs.
#define HELP_VARIANTS                                                                                        \
    "      --lanes LIST      of 1, 4, 8, 16 (default: the device's own)\n"                                   \
    "      --bvh LIST        of auto, on, off (default: auto)\n"                                             \
    "      --size WxH        of the pictures (default: as glint render has it)\n"                            \
    "      --seconds MAX     stop measuring after so long, settled or not (default: 5 for each "             \
    "row)\n" HELP_DEVICE HELP_LENIENT

// Takes one of them; *valid says whether its value was one; if not, why was printed. False if `option` is
// none.
bool variant_option(VariantOptions *options, int option, const char *value, bool *valid);
// Reads a number above 0. False: what is wrong was printed.
bool option_positive(const char *option, const char *value, double *result);

typedef struct {
    Scene *scenes;
    size_t scene_count;
    // side by side, those of a scene together
    Variant *variants;
    BenchRow *rows;
    size_t *scene_indices;
    size_t count;
} VariantSet;

// Reads the scenes. False: one cannot be read, which was printed; the set is still to be closed.
bool variant_set_open(VariantSet *set, const VariantOptions *options, char *const *paths, size_t count);
// Readies each variant for its runs, then measures: in turn (A B C A B C …), so that a machine that slows
// down does so for all; until times settle, or after options->seconds. `timing_builds`: rows get times of
// builds. False if the user stopped it.
bool variant_set_measure(VariantSet *set, const VariantOptions *options, Compute *compute, bool timing_builds,
                         Progress *progress);
bool variant_set_any_measured(const VariantSet *set);
void variant_set_close(VariantSet *set);
