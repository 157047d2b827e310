// Classifies and describes what a passport found.
#include "host/opencl/passport.h"

#include "host/base/text.h"
#include <inttypes.h>

const char *const finding_names[] = {"sound", "unusual", "broken"};
const char *const property_names[PROPERTY_COUNT] = {
    [PROPERTY_CONTRACTION] = "contraction", [PROPERTY_TWO_SUM] = "two-sum",
    [PROPERTY_TWO_PRODUCT] = "two-product", [PROPERTY_FMA] = "fma",
    [PROPERTY_ROUNDING] = "rounding",       [PROPERTY_DIVISION] = "division",
    [PROPERTY_SQUARE_ROOT] = "square root", [PROPERTY_SUBNORMALS] = "subnormals",
    [PROPERTY_SPECIALS] = "inf and NaN",    [PROPERTY_CONVERSIONS] = "conversions",
    [PROPERTY_TIMERS] = "event timers"};

bool passport_rounds_correctly(const Passport *passport)
{
    return passport->has_promised_rounding && passport->quotients.wrong_count == 0 &&
           passport->roots.wrong_count == 0;
}

const char *const passport_timer_faults[] = {
    [TIMER_SOUND] = NULL,
    [TIMER_ABSENT] = "the runtime reports no times for events",
    [TIMER_COUNTER] = "event timestamps are a counter, not a clock",
    [TIMER_BACKWARD] = "event timestamps run backward",
    [TIMER_UNIT] = "event timestamps do not count nanoseconds",
};

const char *passport_timer_fault(const Device *device)
{
    const char *fault = NULL;
    for (size_t i = 0; i < passport_count(device) && !fault; i++)
        fault = passport_timer_faults[passport_at(device, i)->timer.fault];
    return fault;
}

static Finding found(Text *text, bool is_sound, const char *sound, const char *broken)
{
    text_appendf(text, "%s", is_sound ? sound : broken);
    return is_sound ? FINDING_SOUND : FINDING_BROKEN;
}

static Finding fma_finding(const Passport *passport, Text *text)
{
    if (passport->fma_is_fused) {
        text_appendf(text, "fused, %.2g times the time of a product and a sum", passport->fma_cost);
        if (passport->uses_fma) return FINDING_SOUND;
        if (passport->fma_cost < PASSPORT_FMA_COST_MAX) text_appendf(text, ", but not claimed in hardware");
    } else {
        text_appendf(text, "not fused (rounds twice)");
        if (passport->mode == PASSPORT_DOUBLE) return FINDING_BROKEN;
    }
    text_appendf(text, passport->fma_is_exact ? "; kernels compute it from products and sums"
                                              : "; its emulation by products and sums is not exact");
    return passport->fma_is_exact ? FINDING_UNUSUAL : FINDING_BROKEN;
}

// Appends the finding about quotients or roots. `allowed_ulp` is the error that OpenCL allows at `single`
// and that the bounds of `certified` assume.
static Finding results_finding(const Passport *passport, const RoundedResults *results, double allowed_ulp,
                               Text *text)
{
    if (results->wrong_count == 0)
        text_appendf(text, "correctly rounded");
    else
        text_appendf(text, "off by up to %.3g ulp", results->largest_ulp);
    text_appendf(text, " (%" PRIu64 " tried%s)", results->count,
                 results->is_exhaustive ? ", among them all mantissas of a binade" : "");
    if (results->wrong_count == 0) return FINDING_SOUND;
    if (passport->mode == PASSPORT_STRICT) {
        if (passport->has_promised_rounding) text_appendf(text, " against the driver's promise");
        text_appendf(text, results->is_repaired ? "; kernels repair it" : "; kernels cannot repair it");
        if (!results->is_repaired) return FINDING_BROKEN;
        return passport->has_promised_rounding ? FINDING_UNUSUAL : FINDING_SOUND;
    }
    if (results->largest_ulp <= allowed_ulp)
        return passport->mode == PASSPORT_DOUBLE ? FINDING_UNUSUAL : FINDING_SOUND;
    text_appendf(text, "; OpenCL allows %g ulp", allowed_ulp);
    return FINDING_BROKEN;
}

static Finding subnormals_finding(const Passport *passport, Text *text)
{
    static const char *const names[] = {"kept", "flushed to zero",
                                        "kept by some operations, flushed by others"};
    text_appendf(text, "%s", names[passport->subnormals]);
    const bool breaks_promise = passport->subnormals != SUBNORMALS_KEPT && passport->has_promised_subnormals;
    if (breaks_promise) text_appendf(text, ", although the driver promises to keep them");
    return breaks_promise || passport->subnormals == SUBNORMALS_MIXED ? FINDING_UNUSUAL : FINDING_SOUND;
}

static Finding timers_finding(const TimerFindings *timer, Text *text)
{
    if (timer->fault == TIMER_SOUND) {
        text_appendf(text, "nanoseconds, in steps of %" PRIu64, timer->step_nanoseconds);
        return FINDING_SOUND;
    }
    text_appendf(text, "%s", passport_timer_faults[timer->fault]);
    if (timer->fault == TIMER_UNIT)
        text_appendf(text, "; one unit is about %.2g ns", timer->tick_nanoseconds);
    return FINDING_UNUSUAL;
}

Finding passport_finding(const Passport *passport, Property property, Text *text)
{
    static const char *const roundings[] = {"to nearest, ties to even", "toward zero", "up", "down",
                                            "in no mode of IEEE 754"};
    switch (property) {
    case PROPERTY_CONTRACTION:
        return found(text, !passport->contracts, "none",
                     "a * b + c is contracted although FP_CONTRACT is off");
    case PROPERTY_TWO_SUM:
        return found(text, passport->two_sum_is_exact, "exact", "loses the rounding error of a sum");
    case PROPERTY_TWO_PRODUCT:
        return found(text, passport->two_product_is_exact, "exact", "loses the rounding error of a product");
    case PROPERTY_FMA:
        return fma_finding(passport, text);
    case PROPERTY_ROUNDING:
        return found(text, passport->rounding == ROUNDING_NEAREST, roundings[0],
                     roundings[passport->rounding]);
    case PROPERTY_DIVISION:
        return results_finding(passport, &passport->quotients, 2.5, text);
    case PROPERTY_SQUARE_ROOT:
        return results_finding(passport, &passport->roots, 3, text);
    case PROPERTY_SUBNORMALS:
        return subnormals_finding(passport, text);
    case PROPERTY_SPECIALS:
        return found(text, passport->has_infinities_and_nans, "as in IEEE 754", "not as in IEEE 754");
    case PROPERTY_CONVERSIONS:
        return found(text, passport->converts_exactly, "exact", "of integers or reals are wrong");
    default:
        return timers_finding(&passport->timer, text);
    }
}

bool passport_broken(const Passport *passport, Text *text)
{
    for (Property property = 0; property < PROPERTY_COUNT; property++) {
        OwnedText what = {0};
        if (passport_finding(passport, property, &what) != FINDING_BROKEN) continue;
        text_appendf(text, "%s: %s", property_names[property], text_c(&what));
        return true;
    }
    return false;
}

bool passports_abnormal(const Device *device, Text *text)
{
    const size_t before = text->count;
    for (size_t i = 0; i < passport_count(device); i++) {
        const Passport *passport = passport_at(device, i);
        for (Property property = 0; property < PROPERTY_COUNT; property++) {
            OwnedText what = {0};
            if (passport_finding(passport, property, &what) != FINDING_SOUND)
                text_appendf(text, "%s%s, %u lane%s: %s: %s", text->count > before ? "\n" : "",
                             passport_mode_names[passport->mode], passport->lanes,
                             text_plural(passport->lanes), property_names[property], text_c(&what));
        }
    }
    return text->count > before;
}
