// Measures a device's arithmetic and event timers with kernels/passport.cl, which is built like the
// renderer's kernels. Compares the results with exact ones on the host, and caches them by the device, its
// driver and the text of that kernel.
#pragma once

#include "host/base/text.h"
#include "host/opencl/compute.h"
#include "host/opencl/exact.h"

// The sets of build options and functions that kernels of a precision share.
typedef enum { PASSPORT_SINGLE, PASSPORT_STRICT, PASSPORT_DOUBLE, PASSPORT_MODE_COUNT } PassportMode;
extern const char *const passport_mode_names[PASSPORT_MODE_COUNT];

typedef enum { SUBNORMALS_KEPT, SUBNORMALS_FLUSHED, SUBNORMALS_MIXED } Subnormals;

// The results of division or of the square root.
typedef struct {
    double largest_ulp;          // the largest error, infinite if a result is not finite
    uint64_t count, wrong_count; // a wrong result is not correctly rounded
    bool is_exhaustive;          // whether all mantissas of a binade are among them
    bool is_repaired;            // the function that kernels call returned only correctly rounded results
} RoundedResults;

typedef enum {
    TIMER_SOUND,
    TIMER_ABSENT,   // only zeros
    TIMER_COUNTER,  // numbers commands
    TIMER_BACKWARD, // a command ends before it starts, or starts before the one before it ended
    TIMER_UNIT      // does not count nanoseconds
} TimerFault;

typedef struct {
    TimerFault fault;
    double tick_nanoseconds;   // how long one unit lasts by the host's clock, 0 if unknown
    uint64_t step_nanoseconds; // the greatest common divisor of all times, 0 if unknown
} TimerFindings;

// The passport of one mode at one vector width.
typedef struct {
    PassportMode mode;
    uint32_t lanes;
    bool is_thorough;  // covered all mantissas, as far as PASSPORT_SECONDS_MAX allowed
    bool uses_fma;     // HAS_FMA of kernels, set if fma is fused and its cost below the limit
    bool fma_is_fused; // fma of the device
    bool fma_is_exact; // fma of the kernels, perhaps emulated
    double fma_cost;   // its time over that of a product and a sum, 0 if not fused or not measured
    bool contracts, two_sum_is_exact, two_product_is_exact;
    RoundingMode rounding;
    RoundedResults quotients, roots;
    bool has_promised_rounding; // whether the build has an option that asks for it in quotients and roots
    Subnormals subnormals;
    bool has_promised_subnormals;
    bool has_infinities_and_nans, converts_exactly;
    TimerFindings timer;
    double build_seconds, seconds; // of the kernel's build and of the measurement
} Passport;

// The maximum seconds of a measurement, except on devices that are too slow even for the fewest operands.
// Three measurements, one of each mode, take less than a second.
#define PASSPORT_SECONDS_MAX 0.3
// Fused hardware takes about half the time of a product and a sum, an emulation dozens of times that. The
// second limit is for devices that do not report the hardware. Intel's runtime for CPUs does not report it.
// On a busy machine, rusticl's emulation was measured at 7.9.
#define PASSPORT_FMA_COST_MAX           8.0
#define PASSPORT_UNCLAIMED_FMA_COST_MAX 2.0

// Returns the compiler's options of a mode on a device.
const char *passport_build_options(const Device *device, PassportMode mode);

// Returns the passport of a mode and width, measured earlier in this process, loaded from the cache, or
// measured now. A thorough measurement takes up to PASSPORT_SECONDS_MAX, others some hundredths of a second,
// and both a build. Returns NULL if the device failed. The passport lives as long as the device's list. Two
// threads must not call this for one device.
const Passport *passport_acquire(Compute *compute, PassportMode mode, uint32_t lanes, bool is_thorough,
                                 bool no_cache);
// Thoroughly measures all modes of the device at their default widths and replaces the cached passports.
bool passports_measure(Compute *compute);
// Loads the cached passports of all modes at the default widths. Measures nothing.
void passports_recall(const Device *device);

// The passports of a device that are known, in the order in which they were acquired.
typedef struct DevicePassports DevicePassports;
DevicePassports *device_passports_open(void);
void device_passports_close(DevicePassports *passports); // accepts NULL
size_t passport_count(const Device *device);
const Passport *passport_at(const Device *device, size_t index);

// Returns whether the driver promises correctly rounded quotients and roots, and nothing refuted that.
bool passport_rounds_correctly(const Passport *passport);

extern const char *const passport_timer_faults[]; // by TimerFault, in words; NULL if sound
// Returns why the events' times of the device are not trusted, or NULL if they are or nothing is known.
const char *passport_timer_fault(const Device *device);

// The finding about a property. It is sound, unusual in a way that glint allows for, or broken although the
// precisions of the mode other than `single` rely on it.
typedef enum { FINDING_SOUND, FINDING_UNUSUAL, FINDING_BROKEN } Finding;
extern const char *const finding_names[];

typedef enum {
    PROPERTY_CONTRACTION,
    PROPERTY_TWO_SUM,
    PROPERTY_TWO_PRODUCT,
    PROPERTY_FMA,
    PROPERTY_ROUNDING,
    PROPERTY_DIVISION,
    PROPERTY_SQUARE_ROOT,
    PROPERTY_SUBNORMALS,
    PROPERTY_SPECIALS,
    PROPERTY_CONVERSIONS,
    PROPERTY_TIMERS,
    PROPERTY_COUNT
} Property;
extern const char *const property_names[PROPERTY_COUNT];

// Appends a description of the property and returns its finding.
Finding passport_finding(const Passport *passport, Property property, Text *text);
// Appends the first broken property and its description. Returns false if none is broken.
bool passport_broken(const Passport *passport, Text *text);
// Appends all properties that are not sound, for a line of a report. Returns false if all are sound.
bool passports_abnormal(const Device *device, Text *text);
