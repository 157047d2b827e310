// Acquires and caches passports.
#include "host/opencl/passport.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/opencl/cache.h"
#include "host/opencl/passport_probe.h"
#include <stdlib.h>
#include <string.h>

const char *const passport_mode_names[PASSPORT_MODE_COUNT] = {"single", "strict", "double"};

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
    OwnedText prelude = {0};
    ProgramRequest request = passport_request(device, mode, lanes, true, false, &prelude);
    OWNED char *launch = text_format("passport %d of %zu bytes", PASSPORT_FORMAT, sizeof(Passport));
    request.launch = launch;
    return program_key(device, &request);
}

static bool passport_load(Passport *passport, const Device *device, PassportMode mode, uint32_t lanes)
{
    OWNED char *key = passport_key(device, mode, lanes);
    OwnedText bytes = {0};
    const bool is_loaded = cache_load(key, &bytes, device->warnings) && bytes.count == sizeof *passport;
    if (is_loaded) memcpy(passport, bytes.items, sizeof *passport);
    return is_loaded;
}

static void passport_store(const Passport *passport, const Device *device)
{
    OWNED char *key = passport_key(device, passport->mode, passport->lanes);
    OwnedText bytes = {0};
    text_append(&bytes, (const char *)passport, sizeof *passport);
    cache_store(key, &bytes, device->warnings);
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

static const Passport *passport_renew(Compute *compute, PassportMode mode, uint32_t lanes, bool is_thorough,
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
    return passport_renew(compute, mode, lanes, is_thorough, no_cache);
}

bool passports_measure(Compute *compute)
{
    for (PassportMode mode = 0; mode < PASSPORT_MODE_COUNT; mode++) {
        const bool is_double = mode == PASSPORT_DOUBLE;
        if (is_double && !compute->device->fp64) continue;
        if (!passport_renew(compute, mode, device_lanes(compute->device, is_double, 0), true, false))
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
