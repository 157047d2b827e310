// Which precision keeps an image's error within a budget in the least time: a pilot renders a sparse sample
// of the image's pixels at the precisions, on the device and scene at hand, and compares them with `double`.
//
// The sample is stratified: one pixel of each square of pixels, at a place that a hash chooses
// (kernels/film.h), and every pixel of the columns and rows at the right and bottom that fill no square.
// docs/accuracy.md has the statistics.
#pragma once

#include "host/measure/error_budget.h"
#include "host/render/renderer.h"

typedef enum {
    PILOT_UNTRIED, // a cheaper one keeps the budget, or no sample of this size could show that it does
    PILOT_MEASURED,
    PILOT_UNAVAILABLE // the device or scene does not fit it
} PilotStatus;

typedef struct {
    PilotStatus status;
    SampleVerdict verdict; // of `double`: no error
    double pixel_seconds;  // rendering time of a pixel
} PilotCandidate;

typedef struct {
    ErrorBudget budget;
    double confidence; // that every candidate's bound holds
    PilotCandidate candidates[ARITHMETIC_COUNT];
    Precision chosen;
    uint32_t cell;               // side of the squares
    double color_max;            // the largest channel that the scene's lights and materials allow
    size_t pixels, image_pixels; // rendered at each precision; in the region
    double seconds, build_seconds;
} Pilot;

// Chooses a precision for what `settings` say otherwise. Among those that keep the budget it is the fastest;
// of several about as fast the most precise. False with a message where the device has no `double` or the
// scene does not fit it; without one if settings->stop ended it or the device failed.
bool pilot_run(Pilot *pilot, const ErrorBudget *budget, Compute *compute, const Scene *scene,
               const RenderSettings *settings, MessageList *messages);

// One line: the choice, what is known of its error, and the pixels it took. No time: it
// stands in images, and equal renders are equal bytes.
void pilot_describe(Text *text, const Pilot *pilot);
