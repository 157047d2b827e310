#include "host/cli/variants.h"

#include "host/base/clock.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/interrupts.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const VariantOptions variant_options_default = {.common.settings.bounce_count = BOUNCES_DEFAULT,
                                                .common.precisions = 1u << PRECISION_SINGLE,
                                                .bvhs = 1u << BVH_AUTO};

const double variants_opened_fraction = 0.4, variants_measured_fraction = 0.9;

enum { WARM_UP_RUNS = 3, WARM_UP_SECONDS = 2, ENOUGH_RUNS = 20 };

static bool samples_read(const Option *option, const char *value, void *options)
{
    VariantOptions *variants = options;
    const OptionItems list = {variants->samples, sizeof *variants->samples, SAMPLE_CHOICES_MAX,
                              &variants->sample_choices};
    return option_list(option, value, option_count, list);
}

#define FIELD(member) offsetof(VariantOptions, member)

const Option variant_choice_options[] = {
    {"samples", "LIST", "samples per pixel, with one row for each number (default: 1)", samples_read, 0,
     NUMBERS(1, SAMPLES_MAX)},
    {"lanes", "LIST", "any of 1, 4, 8, 16 (default and CPU maximum: vector width)", option_set, FIELD(lanes),
     NAMES(lanes_choice_names)},
    {"bvh", "LIST", "any of auto, on, off (default: auto)", option_set, FIELD(bvhs),
     NAMES(bvh_choice_names)}};
const Option variant_set_options[] = {{"seconds", "MAX",
                                       "time limit of the measurement, converged or not (default: 5 per row)",
                                       option_number, FIELD(seconds), NUMBERS_ABOVE(0, SECONDS_MAX)}};

// Adds a variant. `key` has what its row shares with others of its scene and choice.
static void variant_add(VariantSet *set, const VariantOptions *options, size_t choice, size_t scene_index,
                        const RenderSettings *settings, BenchKey key)
{
    Variant *variant = &set->variants[set->count];
    *variant = (Variant){.scene = &set->scenes[scene_index], .choice = choice, .settings = *settings};
    if (options->name) {
        variant->build_options = options->common.driver.build_options;
        memcpy(variant->work_group, options->common.driver.work_group, sizeof variant->work_group);
    }
    key.precision = precision_names[settings->precision];
    key.bvh = bvh_choice_names[settings->bvh];
    key.lanes = settings->lanes;
    key.samples = settings->sample_count;
    set->rows[set->count++] = (BenchRow){.key = key};
}

static uint64_t file_hash(uint64_t hash, const char *path)
{
    OwnedText text = {0};
    const bool is_read = path && text_read_file(&text, path, NULL);
    return is_read ? hash_bytes(hash, text.items, text.count) : hash;
}

// Returns the hash of the contents of the scene's file, meshes and textures, regardless of their names.
static uint64_t scene_files_hash(const Scene *scene)
{
    uint64_t hash = scene->text_hash;
    for (size_t i = 0; i < scene->meshes.count; i++)
        hash = file_hash(hash, scene->meshes.items[i].path);
    for (size_t i = 0; i < scene->textures.count; i++)
        hash = file_hash(hash, scene->textures.items[i].path);
    return hash;
}

// Adds the variants of one scene and choice. `key` has what the scene's rows share.
static void scene_add_variants(VariantSet *set, const VariantOptions *choices, size_t choice,
                               size_t scene_index, BenchKey key)
{
    const VariantOptions *options = &choices[choice];
    RenderSettings settings = settings_of_scene(&options->common, &set->scenes[scene_index]);
    uint32_t lanes_list[LANES_CHOICE_COUNT] = {0}; // without --lanes, 0 for the device's default
    size_t lanes_count = 0;
    for (size_t i = 0; i < LANES_CHOICE_COUNT; i++)
        if (options->lanes >> i & 1) lanes_list[lanes_count++] = lanes_choice_values[i];
    if (lanes_count == 0) lanes_count = 1;
    static const uint32_t one_sample = 1;
    const uint32_t *samples = options->sample_choices > 0 ? options->samples : &one_sample;
    const size_t samples_count = options->sample_choices > 0 ? options->sample_choices : 1;
    key.variant = options->name;
    key.width = settings.width;
    key.height = settings.height;
    key.bounces = settings.bounce_count;
    for (unsigned precision = 0; precision < PRECISION_COUNT; precision++) {
        if (!(options->common.precisions >> precision & 1)) continue;
        for (size_t lanes = 0; lanes < lanes_count; lanes++)
            for (unsigned bvh = 0; bvh < BVH_CHOICE_COUNT; bvh++) {
                if (!(options->bvhs >> bvh & 1)) continue;
                settings.precision = (Precision)precision;
                settings.lanes = lanes_list[lanes];
                settings.bvh = (BvhChoice)bvh;
                for (size_t i = 0; i < samples_count; i++) {
                    settings.sample_count = samples[i];
                    variant_add(set, options, choice, scene_index, &settings, key);
                }
            }
    }
}

bool variant_set_open(VariantSet *set, const VariantOptions *choices, size_t choice_count, char *const *paths,
                      size_t count)
{
    const size_t largest =
        count * choice_count * PRECISION_COUNT * LANES_CHOICE_COUNT * BVH_CHOICE_COUNT * SAMPLE_CHOICES_MAX;
    *set = (VariantSet){
        .scenes = memory_allocate_zeroed(count, sizeof *set->scenes),
        .scene_count = count,
        .variants = memory_allocate_zeroed(largest, sizeof *set->variants),
        .rows = memory_allocate_zeroed(largest, sizeof *set->rows),
    };
    for (size_t i = 0; i < count; i++) {
        if (!scene_open(&set->scenes[i], paths[i], &choices[0].common)) return false;
        const BenchKey key = {.scene = paths[i], .scene_hash = scene_files_hash(&set->scenes[i])};
        for (size_t k = 0; k < choice_count; k++)
            scene_add_variants(set, choices, k, i, key);
    }
    set->row_count = set->count;
    return true;
}

VariantSet variant_set_part(const VariantSet *set, size_t first, size_t count)
{
    return (VariantSet){.variants = set->variants + first,
                        .rows = set->rows + first,
                        .count = count,
                        .rows_before = first,
                        .row_count = set->count};
}

double variant_set_fraction(const VariantSet *set, double fraction_done)
{
    return ((double)set->rows_before + fraction_done * (double)set->count) / (double)set->row_count;
}

static bool all_converged(const VariantSet *set)
{
    for (size_t i = 0; i < set->count; i++)
        if (set->variants[i].renderer && !bench_converged(&set->rows[i].times, ENOUGH_RUNS)) return false;
    return true;
}

bool variant_set_round(VariantSet *set, bool warm_up)
{
    for (size_t i = 0; i < set->count; i++)
        if (set->variants[i].renderer &&
            !variant_run(&set->variants[i], warm_up ? NULL : &set->rows[i].times))
            return false;
    return true;
}

// Returns whether a variant renders as a later one of the same scene and --variant does with these lanes.
static bool renders_as(const BenchRow *row, const Variant *variant, const Variant *later, uint32_t lanes)
{
    const RenderSettings *one = &variant->settings, *other = &later->settings;
    return row->key.lanes == lanes && variant->scene == later->scene && variant->choice == later->choice &&
           one->precision == other->precision && one->bvh == other->bvh &&
           one->sample_count == other->sample_count;
}

void variant_set_fit_lanes(VariantSet *set, const Device *device)
{
    for (size_t i = 0; i < set->count; i++) {
        const RenderSettings *settings = &set->variants[i].settings;
        BenchRow *row = &set->rows[i];
        const uint32_t lanes = device_lanes(device, settings->precision == PRECISION_DOUBLE, settings->lanes);
        for (size_t k = 0; k < i && lanes < settings->lanes && !row->failure; k++)
            if (renders_as(&set->rows[k], &set->variants[k], &set->variants[i], lanes))
                row->failure =
                    text_format("%u lanes exceed the device's vectors, and the row of %u lanes is the same",
                                settings->lanes, lanes);
        if (!row->failure) row->key.lanes = lanes;
    }
}

bool variant_set_start(VariantSet *set, Compute *compute, bool timing_builds, Progress *progress)
{
    variant_set_fit_lanes(set, compute->device);
    for (size_t i = 0; i < set->count; i++) {
        if (is_interrupted()) return false;
        if (set->rows[i].failure) continue;
        const double done = variants_opened_fraction * (double)i / (double)set->count;
        if (progress)
            progress_step(progress, variant_set_fraction(set, done), "building row %zu of %zu",
                          set->rows_before + i + 1, set->row_count);
        variant_open(compute, &set->variants[i], &set->rows[i], timing_builds);
        if (!compute_ok(compute)) return false;
    }
    double start = clock_seconds();
    for (int i = 0; i < WARM_UP_RUNS && (i == 0 || clock_seconds() - start < WARM_UP_SECONDS); i++)
        if (!variant_set_round(set, true)) return false;
    return true;
}

// Runs rounds until the times converge, but a benchmark for at least a fifth of its time, so that passing
// disturbances show.
static bool rounds_run(VariantSet *set, double seconds, bool is_benchmark, Progress *progress)
{
    double start = clock_seconds(), spent = 0;
    const size_t first = set->rows_before + 1, last = set->rows_before + set->count;
    const double opened = variants_opened_fraction, rest = variants_measured_fraction - opened;
    if (first == last)
        progress_step(progress, variant_set_fraction(set, opened), "measuring row %zu of %zu", first,
                      set->row_count);
    else
        progress_step(progress, variant_set_fraction(set, opened), "measuring rows %zu to %zu of %zu", first,
                      last, set->row_count);
    while (spent < seconds && ((is_benchmark && spent < seconds / 5) || !all_converged(set))) {
        if (is_benchmark) calibration_run(&set->calibration);
        if (!variant_set_round(set, false)) return false;
        spent = clock_seconds() - start;
        progress_show(progress, variant_set_fraction(set, opened + rest * fmin(spent / seconds, 1)));
    }
    return true;
}

// Measures the energy of each row's frames, where the device has a meter. Returns false if a render failed or
// the user interrupted.
static bool energy_measure(VariantSet *set, const Device *device, Progress *progress)
{
    const char *why_not = NULL;
    EnergyMeter *meter = energy_open(device, &why_not);
    bool is_whole = true;
    for (size_t i = 0; i < set->count && is_whole; i++) {
        set->rows[i].energy.why_not = why_not;
        if (!meter || !set->variants[i].renderer) continue;
        progress_step(progress, variant_set_fraction(set, variants_measured_fraction),
                      "measuring the energy of row %zu of %zu", set->rows_before + i + 1, set->row_count);
        is_whole = variant_run_energy(&set->variants[i], meter, &set->rows[i]);
    }
    energy_close(meter);
    return is_whole;
}

bool variant_set_measure(VariantSet *set, const VariantOptions *options, Compute *compute, bool is_benchmark,
                         Progress *progress)
{
    if (!variant_set_start(set, compute, is_benchmark && !options->no_build_times, progress)) return false;
    const double row_seconds = options->seconds > 0 ? options->seconds / (double)set->row_count : 5;
    const double seconds = row_seconds * (double)set->count;
    bool whole = rounds_run(set, seconds, is_benchmark, progress);
    if (whole && is_benchmark) whole = energy_measure(set, compute->device, progress);
    for (size_t i = 0; i < set->count && whole; i++)
        if (set->variants[i].renderer)
            set->rows[i].kernel_hash = renderer_report(set->variants[i].renderer)->kernel_hash;
    return whole;
}

size_t variant_set_first(const VariantSet *set, size_t row)
{
    const RenderSettings *settings = &set->variants[row].settings;
    size_t first = row;
    int most = -1;
    for (size_t i = 0; i < set->count; i++) {
        if (set->variants[i].scene != set->variants[row].scene || set->variants[i].choice > 0) continue;
        const RenderSettings *other = &set->variants[i].settings;
        const int common = (other->precision == settings->precision) + (other->lanes == settings->lanes) +
                           (other->bvh == settings->bvh) + (other->sample_count == settings->sample_count);
        if (common <= most) continue;
        most = common;
        first = i;
    }
    return first;
}

bool variant_set_any_measured(const VariantSet *set)
{
    for (size_t i = 0; i < set->count; i++)
        if (!set->rows[i].failure) return true;
    return false;
}

void variant_set_close(VariantSet *set)
{
    for (size_t i = 0; i < set->count; i++) {
        variant_close(&set->variants[i]);
        bench_row_free(&set->rows[i]);
    }
    for (size_t i = 0; i < set->scene_count; i++)
        scene_free(&set->scenes[i]);
    free(set->scenes);
    free(set->variants);
    free(set->rows);
    calibration_free(&set->calibration);
    *set = (VariantSet){0};
}
