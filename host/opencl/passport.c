// Acquires, caches and describes passports.
#include "host/opencl/passport.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/opencl/cache.h"
#include "host/opencl/passport_measure.h"
#include "host/opencl/passport_probe.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

const char *const passport_mode_names[PASSPORT_MODE_COUNT] = {"single", "strict", "double"};
const char *const finding_names[] = {"sound", "unusual", "broken"};
const char *const property_names[PROPERTY_COUNT] = {
    [PROPERTY_CONTRACTION] = "contraction", [PROPERTY_TWO_SUM] = "two-sum",
    [PROPERTY_TWO_PRODUCT] = "two-product", [PROPERTY_FMA] = "fma",
    [PROPERTY_ROUNDING] = "rounding",       [PROPERTY_DIVISION] = "division",
    [PROPERTY_SQUARE_ROOT] = "square root", [PROPERTY_SUBNORMALS] = "subnormals",
    [PROPERTY_SPECIALS] = "inf and NaN",    [PROPERTY_CONVERSIONS] = "conversions",
    [PROPERTY_TIMERS] = "event timers"};

struct DevicePassports {
    Passport **items; // each keeps its address
    size_t count, capacity;
};

DevicePassports *device_passports_open(void)
{
    return memory_allocate_zeroed(1, sizeof(DevicePassports));
}

void device_passports_close(DevicePassports *passports)
{
    if (!passports) return;
    for (size_t i = 0; i < passports->count; i++)
        free(passports->items[i]);
    free(passports->items);
    free(passports);
}

size_t passport_count(const Device *device)
{
    return device->passports ? device->passports->count : 0;
}

const Passport *passport_at(const Device *device, size_t index)
{
    return device->passports->items[index];
}

const char *passport_build_options(const Device *device, PassportMode mode)
{
    if (mode == PASSPORT_STRICT && device->correctly_rounded)
        return "-cl-std=CL1.2 -cl-fp32-correctly-rounded-divide-sqrt";
    return "-cl-std=CL1.2";
}

// Increment when the Passport struct or the measurement changes. The kernel's text is in the key.
enum { PASSPORT_FORMAT = 2 };

static char *passport_key(const Device *device, PassportMode mode, uint32_t lanes)
{
    Text prelude = {0};
    ProgramRequest request = passport_request(device, mode, lanes, true, false, &prelude);
    char *launch = text_format("passport %d of %zu bytes", PASSPORT_FORMAT, sizeof(Passport));
    request.launch = launch;
    char *key = program_key(device, &request);
    free(launch);
    text_free(&prelude);
    return key;
}

static bool passport_load(Passport *passport, const Device *device, PassportMode mode, uint32_t lanes)
{
    char *key = passport_key(device, mode, lanes);
    Text bytes = {0};
    const bool is_loaded = cache_load(key, &bytes) && bytes.count == sizeof *passport;
    if (is_loaded) memcpy(passport, bytes.items, sizeof *passport);
    text_free(&bytes);
    free(key);
    return is_loaded;
}

static void passport_store(const Passport *passport, const Device *device)
{
    char *key = passport_key(device, passport->mode, passport->lanes);
    Text bytes = {0};
    text_append(&bytes, (const char *)passport, sizeof *passport);
    cache_store(key, &bytes);
    text_free(&bytes);
    free(key);
}

// Returns the passport, or NULL if it is not known.
static Passport *passport_find(const Device *device, PassportMode mode, uint32_t lanes)
{
    for (size_t i = 0; i < passport_count(device); i++) {
        Passport *known = device->passports->items[i];
        if (known->mode == mode && known->lanes == lanes) return known;
    }
    return NULL;
}

static Passport *passport_keep(const Device *device, const Passport *passport)
{
    Passport *known = passport_find(device, passport->mode, passport->lanes);
    if (!known) {
        known = memory_allocate_zeroed(1, sizeof *known);
        array_push(*device->passports, known);
    }
    *known = *passport;
    return known;
}

static const Passport *measure_and_keep(Compute *compute, PassportMode mode, uint32_t lanes, bool is_thorough,
                                        bool no_cache)
{
    Passport passport;
    if (!passport_measure(&passport, compute, mode, lanes, is_thorough, no_cache)) return NULL;
    if (!no_cache) passport_store(&passport, compute->device);
    return passport_keep(compute->device, &passport);
}

const Passport *passport_acquire(Compute *compute, PassportMode mode, uint32_t lanes, bool is_thorough,
                                 bool no_cache)
{
    const Device *device = compute->device;
    Passport passport;
    const Passport *known = passport_find(device, mode, lanes);
    if (!known && !no_cache && passport_load(&passport, device, mode, lanes))
        known = passport_keep(device, &passport);
    if (known && (known->is_thorough || !is_thorough)) return known;
    return measure_and_keep(compute, mode, lanes, is_thorough, no_cache);
}

bool passports_measure(Compute *compute)
{
    for (PassportMode mode = 0; mode < PASSPORT_MODE_COUNT; mode++) {
        const bool is_double = mode == PASSPORT_DOUBLE;
        if (is_double && !compute->device->fp64) continue;
        if (!measure_and_keep(compute, mode, device_lanes(compute->device, is_double, 0), true, false))
            return false;
    }
    return true;
}

void passports_recall(const Device *device)
{
    for (PassportMode mode = 0; mode < PASSPORT_MODE_COUNT; mode++) {
        Passport passport;
        const uint32_t lanes = device_lanes(device, mode == PASSPORT_DOUBLE, 0);
        if (mode == PASSPORT_DOUBLE && !device->fp64) continue;
        if (passport_load(&passport, device, mode, lanes)) passport_keep(device, &passport);
    }
}

bool passport_rounds_correctly(const Passport *passport)
{
    return passport->has_promised_rounding && passport->quotients.wrong_count == 0 &&
           passport->roots.wrong_count == 0;
}

static const char *const timer_faults[] = {
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
        fault = timer_faults[device->passports->items[i]->timer.fault];
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
        text_appendf(text, "rounds twice");
        if (passport->mode == PASSPORT_DOUBLE) return FINDING_BROKEN;
    }
    text_appendf(text, passport->fma_is_exact ? "; kernels compute it from products and sums"
                                              : "; products and sums do not replace it");
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
    text_appendf(text, "; %g are allowed", allowed_ulp);
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
    text_appendf(text, "%s", timer_faults[timer->fault]);
    if (timer->fault == TIMER_UNIT) text_appendf(text, " but some %.2g of them", timer->tick_nanoseconds);
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
        Text what = {0};
        const bool is_broken = passport_finding(passport, property, &what) == FINDING_BROKEN;
        if (is_broken) text_appendf(text, "%s: %s", property_names[property], text_c(&what));
        text_free(&what);
        if (is_broken) return true;
    }
    return false;
}

bool passports_abnormal(const Device *device, Text *text)
{
    const size_t before = text->count;
    for (size_t i = 0; i < passport_count(device); i++) {
        const Passport *passport = passport_at(device, i);
        for (Property property = 0; property < PROPERTY_COUNT; property++) {
            Text what = {0};
            if (passport_finding(passport, property, &what) != FINDING_SOUND)
                text_appendf(text, "%s%s, %u lane%s: %s: %s", text->count > before ? "\n" : "",
                             passport_mode_names[passport->mode], passport->lanes,
                             text_plural(passport->lanes), property_names[property], text_c(&what));
            text_free(&what);
        }
    }
    return text->count > before;
}
