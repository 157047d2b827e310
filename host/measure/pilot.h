// Chooses the precision that keeps an image's error within a budget in the least time. A pilot renders a
// sparse sample of the image's pixels at each precision, on the device and scene in use, and compares them
// with `double`.
//
// The sample is stratified. It has one pixel of each square of pixels, at a place that a hash chooses
// (kernels/film.h), and every pixel of the columns at the right and the rows at the bottom that do not fill a
// square. docs/accuracy.md has the statistics.
#pragma once

#include "host/measure/error_budget.h"
#include "host/render/renderer.h"

typedef enum {
    PILOT_UNTRIED, // a cheaper one keeps the budget, or no sample of this size could show that this one does
    PILOT_MEASURED,
    PILOT_UNAVAILABLE // the device or the scene does not suit the precision
} PilotStatus;

typedef struct {
    PilotStatus status;
    SampleVerdict verdict; // for `double`, no error
    double pixel_seconds;  // the rendering time per pixel
} PilotCandidate;

typedef struct {
    ErrorBudget budget;
    double confidence; // the probability that every candidate's bound holds
    PilotCandidate candidates[ARITHMETIC_COUNT];
    Precision chosen;
    uint32_t cell;               // the side of the squares in pixels
    double color_max;            // the largest channel that the scene's lights and materials allow
    size_t pixels, image_pixels; // those rendered at each precision, and those in the region
    double seconds, build_seconds;
} Pilot;

// Chooses a precision for an image with these settings, whose precision is ignored. It is the fastest that
// keeps the budget, or, if several are about as fast, the most precise of these. Returns false with a message
// if the device does not support `double` or if the scene does not fit it, and false with no message if
// settings->stop ended the pilot or the device failed.
bool pilot_run(Pilot *pilot, const ErrorBudget *budget, Compute *compute, const Scene *scene,
               const RenderSettings *settings, MessageList *messages);

// Appends one line with the choice, what is known about its error, and the number of pixels that it took. The
// line contains no time, because it is stored in images, and equal renders must be equal bytes.
void pilot_describe(Text *text, const Pilot *pilot);
