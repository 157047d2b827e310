#include "host/measure/pilot.h"

#include "host/base/clock.h"
#include <math.h>

// Enough pixels that a wrong one in 25,000 would be seen; few enough to cost a small part of the image.
enum { PIXELS_WANTED = 100000, CELL_MIN = 3, CELL_MAX = 4096 };
static const double pilot_confidence = 0.95;
// Times differ by as much from run to run: no reason for less precision.
static const double time_tolerance = 1.1;

static uint32_t cell_choose(const RenderSettings *settings)
{
    const double pixels = (double)settings->region_width * settings->region_height;
    uint32_t cell = (uint32_t)fmin(fmax(floor(sqrt(pixels / PIXELS_WANTED)), CELL_MIN), CELL_MAX);
    while (cell > 1 && (cell > settings->region_width || cell > settings->region_height))
        cell--;
    return cell;
}

// The sample as it comes, and when.
typedef struct {
    Film film;
    size_t first_pixels, pixels;
    double first_seconds, last_seconds;
} SampleFilm;

static bool sample_take(void *context, const Film *band, double fraction_done)
{
    (void)fraction_done;
    SampleFilm *sample = context;
    sample->last_seconds = clock_seconds();
    sample->pixels += film_pixel_count(band);
    if (sample->first_pixels == 0) {
        sample->first_pixels = sample->pixels;
        sample->first_seconds = sample->last_seconds;
    }
    film_copy_band(&sample->film, band);
    return true;
}

// The first band is left out: drivers finish their build then. If it was the only one, it is rendered again.
static double pixel_seconds(const SampleFilm *sample)
{
    return (sample->last_seconds - sample->first_seconds) / (double)(sample->pixels - sample->first_pixels);
}

// Renders the sample. False as pilot_run; there is nothing to free then.
static bool sample_render(Pilot *pilot, Precision precision, SampleFilm *sample, Compute *compute,
                          const Scene *scene, RenderSettings settings, MessageList *messages)
{
    PilotCandidate *candidate = &pilot->candidates[precision];
    candidate->status = PILOT_UNAVAILABLE;
    settings.precision = precision;
    if (precision == PRECISION_DOUBLE) settings.perturb_seed = settings.perturb_scale = 0;
    Renderer *renderer = renderer_open(compute, scene, &settings, messages);
    if (!renderer) return false;
    *sample =
        (SampleFilm){.film = film_allocate(settings.region_width, settings.region_height, 0, AOV_COLOR)};
    bool whole = renderer_render(renderer, 0, sample_take, sample);
    if (whole && sample->pixels == sample->first_pixels)
        whole = renderer_render(renderer, 0, sample_take, sample);
    if (whole) {
        candidate->status = PILOT_MEASURED;
        candidate->pixel_seconds = pixel_seconds(sample);
        pilot->build_seconds += renderer_report(renderer)->build_seconds;
    } else {
        film_free(&sample->film);
    }
    renderer_close(renderer);
    return whole;
}

// The fastest within the budget.
static Precision fastest_choose(const Pilot *pilot)
{
    double least = INFINITY;
    for (unsigned i = 0; i < ARITHMETIC_COUNT; i++) {
        const PilotCandidate *candidate = &pilot->candidates[i];
        if (candidate->verdict.keeps) least = fmin(least, candidate->pixel_seconds);
    }
    Precision chosen = PRECISION_DOUBLE;
    for (unsigned i = ARITHMETIC_COUNT; i-- > 0;) // from the most precise
        if (pilot->candidates[i].verdict.keeps &&
            pilot->candidates[i].pixel_seconds <= time_tolerance * least)
            return (Precision)i;
    return chosen;
}

static bool candidates_measure(Pilot *pilot, const Film *reference, Compute *compute, const Scene *scene,
                               const RenderSettings *settings)
{
    // all bounds hold together
    const double risk = (1 - pilot->confidence) / (ARITHMETIC_COUNT - 1);
    const bool is_display = scene->color_meaning == COLORS_DISPLAY;
    if (!sample_judge(&pilot->budget, reference, reference, risk, is_display).keeps) return true;
    bool is_kept = false;
    for (unsigned i = 0; i < ARITHMETIC_COUNT; i++) {
        if (i == PRECISION_DOUBLE) continue;
        // those beyond single do more work than it, and build another kernel
        if (i > PRECISION_SINGLE && is_kept) break;
        SampleFilm sample;
        MessageList unfit = {0};
        const bool whole = sample_render(pilot, (Precision)i, &sample, compute, scene, *settings, &unfit);
        const bool is_unfit = unfit.count > 0;
        message_list_free(&unfit);
        if (!whole && is_unfit) continue;
        if (!whole) return false;
        PilotCandidate *candidate = &pilot->candidates[i];
        candidate->verdict = sample_judge(&pilot->budget, reference, &sample.film, risk, is_display);
        is_kept = is_kept || candidate->verdict.keeps;
        film_free(&sample.film);
    }
    return true;
}

bool pilot_run(Pilot *pilot, const ErrorBudget *budget, Compute *compute, const Scene *scene,
               const RenderSettings *settings, MessageList *messages)
{
    const double start = clock_seconds();
    RenderSettings sparse = *settings;
    sparse.cell = cell_choose(settings);
    sparse.region_width /= sparse.cell;
    sparse.region_height /= sparse.cell;
    sparse.hashes_scene = false;
    *pilot = (Pilot){
        .budget = *budget,
        .confidence = pilot_confidence,
        .pixels = (size_t)sparse.region_width * sparse.region_height,
        .image_pixels = (size_t)settings->region_width * settings->region_height,
    };
    SampleFilm reference;
    if (!sample_render(pilot, PRECISION_DOUBLE, &reference, compute, scene, sparse, messages)) return false;
    pilot->candidates[PRECISION_DOUBLE].verdict.keeps = true;
    const bool whole = candidates_measure(pilot, &reference.film, compute, scene, &sparse);
    film_free(&reference.film);
    pilot->chosen = fastest_choose(pilot);
    pilot->seconds = clock_seconds() - start;
    return whole;
}

void pilot_describe(Text *text, const Pilot *pilot)
{
    const ErrorBudget *budget = &pilot->budget;
    const SampleVerdict *verdict = &pilot->candidates[pilot->chosen].verdict;
    const double percent = 100 * pilot->confidence;
    text_appendf(text, "%s: ", precision_names[pilot->chosen]);
    if (pilot->chosen == PRECISION_DOUBLE) {
        bool is_kept = false; // by another, which was no faster here
        for (unsigned i = 0; i < ARITHMETIC_COUNT; i++)
            is_kept = is_kept || (i != PRECISION_DOUBLE && pilot->candidates[i].verdict.keeps);
        text_appendf(text,
                     is_kept ? "none that keeps %s within %g is faster"
                             : "no faster precision is known to keep %s within %g",
                     error_metric_names[budget->metric], budget->limit);
    } else if (budget->metric == ERROR_MAX) {
        text_appendf(
            text,
            "largest error in the sample %.2g; with %g %% confidence at most %.2g %% of pixels exceed %g",
            verdict->error, percent, 100 * verdict->bound, budget->limit);
    } else {
        text_appendf(text, "%s at most %.2g with %g %% confidence", error_metric_names[budget->metric],
                     verdict->bound, percent);
    }
    text_appendf(text, "; %zu of %zu pixels", pilot->pixels, pilot->image_pixels);
}
