#include "host/cli/bench_variant.h"

#include "host/base/clock.h"
#include "host/base/memory.h"
#include "host/opencl/passport.h"
#include <string.h>

enum { BUILD_TEST_SIDE = 64 };

static bool band_skip(void *context, const Film *band)
{
    (void)context, (void)band;
    return true;
}

// Returns the seconds from the start of the build to the end of the first launch, in which drivers may finish
// the build.
static double build_seconds_with_launch(const RenderReport *report)
{
    double seconds = report->build_seconds;
    if (report->launches.count > 0) {
        const LaunchTime *first = &report->launches.items[0].time;
        seconds += first->host_seconds - (first->fault ? 0 : first->event_seconds);
    }
    return seconds;
}

// Renders a corner of the image with a newly built program. Sets *from_cache if the program came from the
// cache. Returns false if the settings do not fit the device.
static bool build_try(Compute *compute, const Variant *variant, bool no_cache, double *seconds,
                      bool *from_cache, MessageList *messages)
{
    RenderSettings settings = variant->settings;
    settings.no_cache = no_cache;
    if (settings.region_width > BUILD_TEST_SIDE) settings.region_width = BUILD_TEST_SIDE;
    if (settings.region_height > BUILD_TEST_SIDE) settings.region_height = BUILD_TEST_SIDE;
    Renderer *renderer = renderer_open(compute, variant->scene, &settings, messages);
    if (!renderer) return false;
    renderer_render(renderer, 0, band_skip, NULL);
    *seconds = build_seconds_with_launch(renderer_report(renderer));
    *from_cache = renderer_report(renderer)->build_from_cache;
    renderer_close(renderer);
    return true;
}

// Acquires the passports of the device. Builds without the cache would otherwise measure them again, although
// they are not part of a build's time. Returns false if the settings do not fit the device.
static bool passports_acquire(Compute *compute, const Variant *variant, MessageList *messages)
{
    Renderer *renderer = renderer_open_empty(compute, &variant->settings, NULL, messages);
    const bool is_fit = renderer != NULL;
    renderer_close(renderer);
    return is_fit;
}

static bool builds_measure(Compute *compute, const Variant *variant, BenchRow *row, MessageList *messages)
{
    bool from_cache = false;
    if (!passports_acquire(compute, variant, messages)) return false;
    if (!build_try(compute, variant, true, &row->build_cold.value, &from_cache, messages)) return false;
    // the first build may fill the cache
    for (int attempt = 0; attempt < 2 && !from_cache; attempt++)
        if (!build_try(compute, variant, false, &row->build_cached.value, &from_cache, messages))
            return false;
    if (!from_cache) row->build_cached.why_not = "there is no cache, or the driver provides no binary for it";
    return true;
}

static bool rays_count(Compute *compute, const Variant *variant, BenchRow *row, MessageList *messages)
{
    RenderSettings settings = variant->settings;
    settings.counting = true;
    Renderer *renderer = renderer_open(compute, variant->scene, &settings, messages);
    if (!renderer) return false;
    renderer_render(renderer, 0, band_skip, NULL);
    memcpy(row->rays, renderer_report(renderer)->rays, sizeof row->rays);
    renderer_close(renderer);
    return true;
}

Device variant_device(const Device *device, const Variant *variant)
{
    Device changed = *device;
    if (variant->build_options) changed.build_options = variant->build_options;
    for (size_t i = 0; i < 2 && variant->work_group[0] > 0; i++)
        changed.work_group[i] = variant->work_group[i];
    return changed;
}

// Returns the Compute that the variant renders with.
static Compute *variant_compute(Compute *compute, Variant *variant)
{
    variant->compute = compute;
    if (!variant->build_options && variant->work_group[0] == 0) return compute;
    variant->private_device = variant_device(compute->device, variant);
    if (variant->build_options) variant->private_device.passports = device_passports_open();
    variant->private_compute = *compute;
    variant->private_compute.device = &variant->private_device;
    return &variant->private_compute;
}

// Copies a failure of the variant's Compute to the command's, which owns what both share.
static void variant_copy_failure(Variant *variant)
{
    if (!variant->private_compute.context || !compute_ok(variant->compute)) return;
    variant->compute->failure = variant->private_compute.failure;
    if (variant->compute->unmap_failure.call[0] == '\0')
        variant->compute->unmap_failure = variant->private_compute.unmap_failure;
}

void variant_open(Compute *shared, Variant *variant, BenchRow *row, bool timing_builds)
{
    Compute *compute = variant_compute(shared, variant);
    OwnedMessageList messages = {0};
    const RenderSettings *settings = &variant->settings;
    if (!timing_builds) row->build_cold.why_not = row->build_cached.why_not = "builds were not timed";
    if ((!timing_builds || builds_measure(compute, variant, row, &messages)) &&
        rays_count(compute, variant, row, &messages))
        variant->renderer = renderer_open(compute, variant->scene, settings, &messages);
    if (variant->renderer) {
        const RenderReport *report = renderer_report(variant->renderer);
        row->traverses_bvh = (report->features & FEATURE_BVH) != 0;
    } else {
        const char *error = message_first_error(&messages);
        row->failure = memory_copy_text(error[0] != '\0' ? error : "the device failed");
    }
    variant_copy_failure(variant);
}

enum { PAGE_BYTES = 4096 };

// Reads one value per memory page, since a driver may leave a mapped page on the device until it is read.
static bool band_read(void *context, const Film *band)
{
    double *end_seconds = context;
    const volatile unsigned char *bytes = band->layers[LAYER_COLOR];
    const size_t size = film_layer_size(band, LAYER_COLOR);
    for (size_t i = 0; i < size; i += PAGE_BYTES)
        (void)bytes[i];
    *end_seconds = clock_seconds();
    return true;
}

bool variant_run(Variant *variant, BenchTimes *times)
{
    renderer_report_restart(variant->renderer);
    const RenderReport *report = renderer_report(variant->renderer);
    double end_seconds = 0, processor_start_seconds = clock_processor_seconds();
    const bool is_whole = renderer_render(variant->renderer, 0, band_read, &end_seconds);
    variant_copy_failure(variant);
    if (!is_whole) return false;
    for (size_t i = 0; times && i < report->launches.count; i++)
        bench_add_launch(times, &report->launches.items[i].time);
    if (times)
        bench_end_run(times, end_seconds - report->launches.items[0].time.host_start_seconds,
                      clock_processor_seconds() - processor_start_seconds);
    return true;
}

// Renders that are measured with an energy counter.
typedef struct {
    Variant *variant;
    EnergyMeter *meter;
    double joules, read_seconds; // the counter's last reading, and how long that took
    size_t count;                // of the frames
    bool is_whole;               // false once a render failed or the user interrupted
} EnergyRun;

// Renders frames until at least `seconds_min` have passed and the counter has changed since its previous
// reading, for at most `seconds_max` if it does not change.
// The device idles during a reading (3.5 ms with NVML), so the frames between two readings take READ_SHARE
// times as long as one.
static void frames_run(EnergyRun *run, double seconds_min)
{
    enum { READ_SHARE = 20 };
    static const double seconds_max = 5;
    const double start_seconds = clock_seconds();
    double before, seconds;
    do {
        before = run->joules;
        const double frames_start_seconds = clock_seconds();
        do {
            run->is_whole = run->is_whole && variant_run(run->variant, NULL);
            run->count++;
        } while (run->is_whole && clock_seconds() - frames_start_seconds < READ_SHARE * run->read_seconds);
        const double read_start_seconds = clock_seconds();
        run->joules = energy_joules(run->meter);
        run->read_seconds = clock_seconds() - read_start_seconds;
        seconds = clock_seconds() - start_seconds;
    } while (run->is_whole && (seconds < seconds_min || (run->joules == before && seconds < seconds_max)));
}

bool variant_run_energy(Variant *variant, EnergyMeter *meter, BenchRow *row)
{
    static const double seconds_min = 1;
    EnergyRun run = {variant, meter, .joules = energy_joules(meter), .is_whole = true};
    row->energy.why_not = "the energy counter did not change or could not be read";
    const double first_joules = run.joules;
    frames_run(&run, 0);
    if (!(run.joules > first_joules)) return run.is_whole;
    const double start_seconds = clock_seconds(), start_joules = run.joules;
    run.count = 0;
    frames_run(&run, seconds_min);
    if (run.joules > start_joules)
        row->energy = (BenchEnergy){.source = energy_source(meter),
                                    .joules = (run.joules - start_joules) / (double)run.count,
                                    .seconds = (clock_seconds() - start_seconds) / (double)run.count};
    return run.is_whole;
}

void variant_close(Variant *variant)
{
    renderer_close(variant->renderer);
    if (variant->private_compute.context && variant->build_options)
        device_passports_close(variant->private_device.passports);
    *variant = (Variant){0};
}
