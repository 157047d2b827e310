#include "host/measure/error_budget.h"

#include "host/base/memory.h"
#include "host/image/flip.h"
#include "host/image/image_metrics.h"
#include "host/image/srgb.h"
#include "host/scene/vector.h"
#include <math.h>
#include <stdlib.h>

const char *const error_metric_names[ERROR_METRIC_COUNT] = {"rmse", "max", "flip"};

// FLIP blurs, so one wrong pixel adds to its neighbors' values. The sum is at most this many times the value
// that the pixel would have in an image of one color (21 times in 2000 trials on uniform, halved and random
// surroundings).
static const double flip_spread = 24;

// If the mean were m or more, the expected product of 1 + m - x over the values would be at most 1, because
// the product of the factors' means is, by the inequality of arithmetic and geometric means. So the product
// reaches 1 / risk with a probability of at most `risk` (Markov), and an m for which it does is a bound
// (Waudby-Smith, Ramdas: Estimating means of bounded random variables by betting, JRSS B 86(1), 2024; here
// with one fixed bet, the best one if the values are small). For n zeros the bound is about -ln(risk) / n.
// The logarithm of the product is concave in m, so Newton's method, started below its zero, stays below it.
double mean_upper_bound(const double *values, size_t count, double risk)
{
    enum { STEPS_MAX = 60 };
    const double target = -log(risk);
    double mean = 0;
    for (size_t i = 0; i < count; i++)
        mean += values[i] / (double)count;
    double bound = mean + target / (double)count;
    for (int step = 0; step < STEPS_MAX && bound < 1; step++) {
        double sum = -target, slope = 0;
        for (size_t i = 0; i < count; i++) {
            sum += log1p(bound - values[i]);
            slope += 1 / (1 + bound - values[i]);
        }
        const double next = bound - sum / slope;
        if (!(next > bound * (1 + 1e-12))) break;
        bound = next;
    }
    return fmin(bound, 1);
}

static void display_color(float display[3], const double color[3], bool display_values)
{
    for (int i = 0; i < 3; i++) {
        const double value = fmax(0, fmin(color[i], 1));
        display[i] = (float)(display_values ? value : srgb_encode(value));
    }
}

// Returns the largest channel of the film, or infinity if a color is not finite.
static double largest_channel(const Film *film)
{
    double largest = 0;
    for (size_t i = 0; i < 3 * film_pixel_count(film); i++)
        largest = isfinite(film->color[i]) ? fmax(largest, fabs(film->color[i])) : INFINITY;
    return largest;
}

// Returns the error of one pixel, within 0..1. The bound is computed from these errors.
static double pixel_share(const ErrorBudget *budget, const double reference[3], const double test[3],
                          double range, bool display_values)
{
    const Vector3 error = vector_subtract(vector_from(test), vector_from(reference));
    float colors[2][3];
    switch (budget->metric) {
    case ERROR_RMSE:
        return range > 0 ? vector_dot(error, error) / 3 / (range * range) : 0; // the mean of the channels
    case ERROR_MAX:
        return vector_largest(error) > budget->limit;
    case ERROR_FLIP:
    case ERROR_METRIC_COUNT:
        break;
    }
    display_color(colors[0], reference, display_values);
    display_color(colors[1], test, display_values);
    return flip_of_colors(colors[0], colors[1]);
}

double sample_rmse_floor(const Sampling *sampling)
{
    const double share = sampling->drawn > 0 ? expm1(-log(sampling->risk) / (double)sampling->drawn) : 1;
    return sampling->color_max * sqrt(sampling->drawn_share * fmin(share, 1));
}

static double mean_of(const double *values, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += values[i];
    return count > 0 ? sum / (double)count : 0;
}

SampleVerdict sample_classify(const ErrorBudget *budget, const Film *reference, const Film *sample,
                              const Sampling *sampling)
{
    const size_t count = film_pixel_count(reference), drawn = sampling->drawn;
    const double seen = fmax(largest_channel(reference), largest_channel(sample));
    const double range = fmax(sampling->color_max, seen);
    if (!isfinite(seen) || (budget->metric == ERROR_RMSE && !isfinite(range)))
        return (SampleVerdict){.error = INFINITY, .bound = INFINITY};
    OWNED double *shares = memory_allocate(count, sizeof *shares);
    for (size_t i = 0; i < count; i++)
        shares[i] = pixel_share(budget, reference->color + 3 * i, sample->color + 3 * i, range,
                                sampling->display_values);
    const double part = sampling->drawn_share, rest = (1 - part) * mean_of(shares + drawn, count - drawn);
    const double mean = part * mean_of(shares, drawn) + rest;
    const double bound = rest + (drawn > 0 ? part * mean_upper_bound(shares, drawn, sampling->risk) : 0);
    const ErrorSummary summary = error_summarize(reference->color, sample->color, 3 * count);
    switch (budget->metric) {
    case ERROR_RMSE:
        return (SampleVerdict){summary.rmse, range * sqrt(bound), range * sqrt(bound) <= budget->limit};
    case ERROR_MAX:
        return (SampleVerdict){summary.largest, bound, summary.largest <= budget->limit};
    case ERROR_FLIP:
    case ERROR_METRIC_COUNT:
        break;
    }
    return (SampleVerdict){mean, flip_spread * bound, flip_spread * bound <= budget->limit};
}
