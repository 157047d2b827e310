#include "host/render/arithmetic.h"

// The precision modes that a precision's passes use. The uncertain pixels of one pass are re-rendered at the
// modes after the first.
static const struct {
    PassportMode modes[2];
    unsigned mode_count;
    bool relies; // is refused if a property of a mode is broken
} needs[PRECISION_COUNT] = {
    [PRECISION_SINGLE] = {{PASSPORT_SINGLE}, 1, false},
    [PRECISION_STRICT] = {{PASSPORT_STRICT}, 1, true},
    [PRECISION_DOUBLE] = {{PASSPORT_DOUBLE}, 1, true},
    [PRECISION_CERTIFIED] = {{PASSPORT_SINGLE, PASSPORT_DOUBLE}, 2, true},
};

const Passport *arithmetic_passport(Compute *compute, Precision precision, uint32_t lanes, bool no_cache)
{
    return passport_acquire(compute, needs[precision].modes[0], lanes, needs[precision].relies, no_cache);
}

static bool passport_refuses(const Passport *passport, Text *why)
{
    if (!passport_broken(passport, why)) return false;
    text_appendf(why, " (%s, %u lane%s)", passport_mode_names[passport->mode], passport->lanes,
                 text_plural(passport->lanes));
    return true;
}

bool arithmetic_suits(Compute *compute, const RenderSettings *settings, MessageList *messages)
{
    const Precision precision = settings->precision;
    for (unsigned i = 0; i < needs[precision].mode_count; i++) {
        const PassportMode mode = needs[precision].modes[i];
        Compute *runs = mode == PASSPORT_DOUBLE ? compute_in_double(compute) : compute;
        const Device *device = runs->device;
        const uint32_t lanes = device_lanes(device, mode == PASSPORT_DOUBLE, settings->lanes);
        const Passport *passport =
            passport_acquire(runs, mode, lanes, needs[precision].relies, settings->no_cache);
        if (!passport) {
            compute_check_reference(compute); // it may be `runs` that failed
            return false;
        }
        OwnedText why = {0};
        if (needs[precision].relies && passport_refuses(passport, &why))
            return message_error(messages,
                                 "the device \"%s\" lacks arithmetic that precision %s relies on: %s; "
                                 "precision single renders, but its errors may be larger than documented",
                                 device->name, precision_names[precision], text_c(&why));
    }
    return true;
}

bool device_suits(Compute *compute, const RenderSettings *settings, MessageList *messages)
{
    return compute_ok(compute) && settings_fit(settings, compute, messages) &&
           arithmetic_suits(compute, settings, messages);
}

bool arithmetic_refuses(const Device *device, Precision precision, Text *why)
{
    if (!needs[precision].relies) return false;
    for (size_t k = 0; k < passport_count(device); k++) {
        const Passport *passport = passport_at(device, k);
        for (unsigned i = 0; i < needs[precision].mode_count; i++)
            if (passport->mode == needs[precision].modes[i] &&
                passport->lanes == device_lanes(device, passport->mode == PASSPORT_DOUBLE, 0) &&
                passport_refuses(passport, why))
                return true;
    }
    return false;
}
