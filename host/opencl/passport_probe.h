// Measures a passport in parts, which launch the probes of kernels/passport.cl. The host checks all results
// of the device.
#pragma once

#include "host/base/array.h"
#include "host/opencl/exact.h"
#include "host/opencl/passport.h"
#include "kernels/probes.h"

enum {
    OPERANDS_MAX = 256,   // of a probe, a multiple of any LANES
    RESULTS_MAX = 1 << 19 // of a launch
};

// The bits of reals or integers of the kernel's size.
typedef struct {
    uint64_t a, b, c;
} Operands;

typedef struct {
    uint64_t first, second;
} Results;

typedef struct {
    Passport *passport;
    Compute *compute;
    bool is_double, no_cache;
    ProgramRequest request;
    Text prelude;
    Program program;
    cl_mem operands, results;
    ARRAY_OF(LaunchTime) launches;
    cl_uint timed_rounds; // of chains that are long enough to be timed
    double start;         // of the measurement, after the builds
    uint64_t random;
} Measurement;

typedef struct {
    double a, b, c;
} Reals;

// Returns the request of passport.cl's program for a mode and a width. The caller frees the prelude.
ProgramRequest passport_request(const Device *device, PassportMode mode, uint32_t lanes, bool has_fma,
                                bool no_cache, Text *prelude);

// Builds the kernel and launches it once, since a driver may finish the build only then.
void probe_kernel_open(Measurement *measurement, bool has_fma);
void probe_kernel_close(Measurement *measurement);
// Open and close the buffers of operands and results. Closing also frees the list of launches.
void probe_buffers_open(Measurement *measurement);
void probe_buffers_close(Measurement *measurement);

void operands_write(Measurement *measurement, const Operands *operands, size_t count);
// Launches a probe over `count` lanes, at most RESULTS_MAX.
LaunchTime probe_launch(Measurement *measurement, cl_uint probe, cl_uint first, cl_uint round_count,
                        cl_uint operand_count, cl_uint count);
// Runs a probe of at most OPERANDS_MAX operands. If the device failed, sets all results to 0 and returns
// false.
bool probe_run(Measurement *measurement, cl_uint probe, const Operands *operands, size_t count,
               Results *results);

uint64_t probe_random_bits(Measurement *measurement); // 64 random bits
// Returns a random real of either sign with an exponent of -span to span. Its mantissa is random, short, so
// that a product may lie halfway between two reals, or near 1 or 2.
double probe_random_real(Measurement *measurement, int span);
// Makes OPERANDS_MAX pairs of random reals, some of whose sums cancel or end in half an ulp.
void reals_make(Measurement *measurement, Reals *reals, Operands *operands);

// Measures the passport with the parts below. Returns false if the device failed.
bool passport_measure(Passport *passport, Compute *compute, PassportMode mode, uint32_t lanes,
                      bool is_thorough, bool no_cache);
// Returns the ratio of fma's time to that of a product and a sum, each without the time of an empty launch.
// Each time is the shortest of alternating launches, of which there are more if fma seems slow, since that
// may be chance. Sets timed_rounds.
double fma_cost(Measurement *measurement);
// Sets the passport's timer from all launches so far and some more. Call fma_cost first.
void timer_measure(Measurement *measurement);
// Sets the passport's quotients and roots. A thorough measurement uses the rest of PASSPORT_SECONDS_MAX.
void quotients_measure(Measurement *measurement);

static inline size_t scalar_size(const Measurement *measurement)
{
    return measurement->is_double ? sizeof(double) : sizeof(float);
}

static inline uint64_t bits_of(const Measurement *measurement, double value)
{
    return real_bits(measurement->is_double, value);
}

static inline double value_of(const Measurement *measurement, uint64_t bits)
{
    return real_value(measurement->is_double, bits);
}

static inline Operands operands_of(const Measurement *measurement, Reals reals)
{
    return (Operands){bits_of(measurement, reals.a), bits_of(measurement, reals.b),
                      bits_of(measurement, reals.c)};
}
