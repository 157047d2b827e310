#include "host/measure/pilot.h"

#include "host/base/clock.h"
#include <float.h>
#include <math.h>
#include <string.h>

// Enough pixels to notice one wrong pixel in 25,000, and few enough to cost a small fraction of the image.
enum { PIXELS_WANTED = 100000, CELL_MIN = 3, CELL_MAX = 4096 };
static const double pilot_confidence = 0.95;
// Times vary by this ratio from run to run, so such a difference does not justify less precision.
static const double time_tolerance = 1.1;

static uint32_t cell_for(const RenderSettings *settings, double pixels_wanted)
{
    const double pixels = (double)settings->region_width * settings->region_height;
    const double cell = fmin(fmax(floor(sqrt(pixels / pixels_wanted)), CELL_MIN), CELL_MAX);
    return (uint32_t)fmax(1, fmin(cell, fmin(settings->region_width, settings->region_height)));
}

// Returns the settings that render one pixel of each of the image's squares.
static RenderSettings squares_of(const RenderSettings *settings, uint32_t cell)
{
    RenderSettings squares = *settings;
    squares.cell = cell;
    squares.region_width /= cell;
    squares.region_height /= cell;
    return squares;
}

enum { REST_COUNT = 2 };

// Sets `rest` to the columns at the right and the rows at the bottom that lie outside the squares.
static void rest_of(const RenderSettings *settings, uint32_t cell, RenderSettings rest[REST_COUNT])
{
    const uint32_t columns = settings->region_width % cell, rows = settings->region_height % cell;
    RenderSettings *right = &rest[0], *bottom = &rest[1];
    *right = *bottom = *settings;
    right->region_x += settings->region_width - columns;
    right->region_width = columns;
    bottom->region_y += settings->region_height - rows;
    bottom->region_width -= columns;
    bottom->region_height = rows;
}

static Sampling sampling_of(const Pilot *pilot, const RenderSettings *settings, uint32_t cell)
{
    const RenderSettings squares = squares_of(settings, cell);
    const size_t drawn = (size_t)squares.region_width * squares.region_height;
    return (Sampling){.drawn = drawn,
                      .drawn_share = (double)drawn * cell * cell / (double)pilot->image_pixels,
                      .color_max = pilot->color_max,
                      // all bounds hold together
                      .risk = (1 - pilot->confidence) / (ARITHMETIC_COUNT - 1)};
}

// Returns the side of the squares. If showing that an RMSE is kept needs more pixels than usual, there are
// enough to show it even if some of them are wrong.
static uint32_t cell_choose(const Pilot *pilot, const RenderSettings *settings)
{
    static const double margin = 0.7;
    const uint32_t usual = cell_for(settings, PIXELS_WANTED), least = cell_for(settings, INFINITY);
    const Sampling most = sampling_of(pilot, settings, least);
    if (pilot->budget.metric != ERROR_RMSE || sample_rmse_floor(&most) > pilot->budget.limit) return usual;
    uint32_t cell = usual;
    for (; cell > least; cell--) {
        const Sampling sampling = sampling_of(pilot, settings, cell);
        if (sample_rmse_floor(&sampling) <= margin * pilot->budget.limit) break;
    }
    return cell;
}

// The image of which every precision renders a sample.
typedef struct {
    Pilot *pilot;
    Compute *compute;
    const Scene *scene;
    RenderSettings settings; // the precision is ignored
} PilotRun;

// The sample as its bands arrive, with their times.
typedef struct {
    Film film;
    size_t first_pixels, pixels;
    double first_seconds, last_seconds;
} SampleFilm;

static bool sample_receive(void *context, const Film *band)
{
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

// Returns the seconds per pixel. Excludes the first band, during which drivers finish their build. If a
// sample has one band, sample_render renders it twice.
static double pixel_seconds(const SampleFilm *sample)
{
    return (sample->last_seconds - sample->first_seconds) / (double)(sample->pixels - sample->first_pixels);
}

// Renders the pixels outside the squares, with these settings, and stores them behind the `drawn` ones, which
// are from the squares.
static bool rest_render(const PilotRun *run, Renderer *renderer, const RenderSettings *settings, Film *film,
                        size_t drawn, MessageList *messages)
{
    RenderSettings rest[REST_COUNT];
    rest_of(settings, run->pilot->cell, rest);
    double *colors = film->color + 3 * drawn;
    for (int i = 0; i < REST_COUNT; i++) {
        OwnedFilm part = {0};
        if (rest[i].region_width == 0 || rest[i].region_height == 0) continue;
        if (!renderer_move(renderer, run->scene, &rest[i], messages) ||
            !renderer_render_film(renderer, 0, &part))
            return false;
        const size_t count = 3 * film_pixel_count(&part);
        memcpy(colors, part.color, count * sizeof *colors);
        colors += count;
    }
    return true;
}

// Renders the sample into a film of one row. Returns false with nothing to free if the precision does not
// suit the device or the scene, if settings->stop ended the pilot or if the device failed.
static bool sample_render(const PilotRun *run, Precision precision, Film *film, MessageList *messages)
{
    Pilot *pilot = run->pilot;
    const Scene *scene = run->scene;
    RenderSettings settings = run->settings;
    PilotCandidate *candidate = &pilot->candidates[precision];
    candidate->status = PILOT_UNAVAILABLE;
    settings.precision = precision;
    if (precision == PRECISION_DOUBLE) settings.perturb_seed = settings.perturb_scale = 0;
    uint32_t cell = pilot->cell > 0 ? pilot->cell : cell_for(&settings, PIXELS_WANTED);
    RenderSettings squares = squares_of(&settings, cell);
    Renderer *renderer = renderer_open(run->compute, scene, &squares, messages);
    if (!renderer) return false;
    bool whole = true;
    if (pilot->cell == 0) {
        pilot->color_max = renderer_color_max(renderer, scene);
        pilot->cell = cell_choose(pilot, &settings);
        squares = squares_of(&settings, pilot->cell);
        whole = pilot->cell == cell || renderer_move(renderer, scene, &squares, messages);
        cell = pilot->cell;
    }
    SampleFilm sample = {.film = film_allocate(squares.region_width, squares.region_height, 0, AOV_COLOR)};
    whole = whole && renderer_render(renderer, 0, sample_receive, &sample);
    if (whole && sample.pixels == sample.first_pixels)
        whole = renderer_render(renderer, 0, sample_receive, &sample);
    const size_t drawn = film_pixel_count(&sample.film);
    const size_t rest = pilot->image_pixels - drawn * cell * cell;
    *film = film_allocate((uint32_t)(drawn + rest), 1, 0, AOV_COLOR);
    memcpy(film->color, sample.film.color, 3 * drawn * sizeof *film->color);
    film_free(&sample.film);
    whole = whole && rest_render(run, renderer, &settings, film, drawn, messages);
    if (whole) {
        candidate->status = PILOT_MEASURED;
        candidate->pixel_seconds = pixel_seconds(&sample);
        pilot->pixels = drawn + rest;
        pilot->build_seconds += renderer_report(renderer)->build_seconds;
    } else {
        film_free(film);
    }
    renderer_close(renderer);
    return whole;
}

// Returns the most precise of the precisions that keep the budget and are about as fast as the fastest of
// these.
static Precision fastest_choose(const Pilot *pilot)
{
    double least = INFINITY;
    for (unsigned i = 0; i < ARITHMETIC_COUNT; i++) {
        const PilotCandidate *candidate = &pilot->candidates[i];
        if (candidate->verdict.keeps) least = fmin(least, candidate->pixel_seconds);
    }
    for (unsigned i = ARITHMETIC_COUNT; i-- > 0;) // from the most precise
        if (pilot->candidates[i].verdict.keeps &&
            pilot->candidates[i].pixel_seconds <= time_tolerance * least)
            return (Precision)i;
    return PRECISION_DOUBLE;
}

static bool candidates_measure(const PilotRun *run, const Film *reference)
{
    Pilot *pilot = run->pilot;
    Sampling sampling = sampling_of(pilot, &run->settings, pilot->cell);
    sampling.display_values = run->scene->color_meaning == COLORS_DISPLAY;
    if (!sample_classify(&pilot->budget, reference, reference, &sampling).keeps) return true;
    bool is_kept = false;
    for (unsigned i = 0; i < ARITHMETIC_COUNT; i++) {
        if (i == PRECISION_DOUBLE) continue;
        // precisions beyond single do more work than single, and build another kernel
        if (i > PRECISION_SINGLE && is_kept) break;
        OwnedFilm sample = {0};
        OwnedMessageList unfit = {0};
        const bool whole = sample_render(run, (Precision)i, &sample, &unfit);
        if (!whole && message_count(&unfit, MESSAGE_ERROR) > 0) continue;
        if (!whole) return false;
        PilotCandidate *candidate = &pilot->candidates[i];
        candidate->verdict = sample_classify(&pilot->budget, reference, &sample, &sampling);
        is_kept = is_kept || candidate->verdict.keeps;
    }
    return true;
}

bool pilot_run(Pilot *pilot, const ErrorBudget *budget, Compute *compute, const Scene *scene,
               const RenderSettings *settings, MessageList *messages)
{
    const double start = clock_seconds();
    PilotRun run = {pilot, compute, scene, *settings};
    run.settings.hashes_scene = false;
    run.settings.moves = true;
    *pilot = (Pilot){
        .budget = *budget,
        .confidence = pilot_confidence,
        .image_pixels = (size_t)settings->region_width * settings->region_height,
    };
    OwnedFilm reference = {0};
    if (!sample_render(&run, PRECISION_DOUBLE, &reference, messages)) return false;
    pilot->candidates[PRECISION_DOUBLE].verdict.keeps = true;
    const bool whole = candidates_measure(&run, &reference);
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
        bool is_kept = false; // whether another precision keeps the budget, but is not faster
        for (unsigned i = 0; i < ARITHMETIC_COUNT; i++)
            is_kept = is_kept || (i != PRECISION_DOUBLE && pilot->candidates[i].verdict.keeps);
        text_appendf(text,
                     is_kept
                         ? "no precision that keeps %s within %g is faster"
                         : "no faster precision is known to keep %s within %g; a larger image or budget may "
                           "allow one",
                     error_metric_names[budget->metric], budget->limit);
    } else if (budget->metric == ERROR_MAX) {
        text_appendf(
            text, "largest error in the sample %.2g; with %g%% confidence at most %.2g%% of pixels exceed %g",
            verdict->error, percent, 100 * verdict->bound, budget->limit);
    } else {
        text_appendf(text,
                     budget->metric == ERROR_FLIP ? "%s at most %.2g (estimated, %g%% confidence)"
                                                  : "%s at most %.2g with %g%% confidence",
                     error_metric_names[budget->metric], verdict->bound, percent);
    }
    text_appendf(text, "; the sample has %zu of %zu pixels", pilot->pixels, pilot->image_pixels);
    if (budget->metric != ERROR_RMSE) return;
    if (pilot->color_max <= DBL_MAX)
        text_appendf(text, "; no color is above %.3g", pilot->color_max);
    else
        text_appendf(text, "; the RMSE has no bound, because a fading light has no greatest brightness");
}
