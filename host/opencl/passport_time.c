// Measures the cost of fma and the behavior of a device's event timers.
#include "host/opencl/passport_probe.h"

#include <math.h>

enum { TIMED_ITEMS = 64, TIMED_ROUNDS_MAX = 1 << 26 };
static const double timed_seconds_wanted = 2e-3;

// Returns the least time of a chain over several launches by the host's clock.
static double chain_seconds(Measurement *measurement, cl_uint probe, cl_uint rounds, int launches)
{
    const cl_uint count = TIMED_ITEMS * measurement->passport->lanes;
    double least = INFINITY;
    for (int i = 0; i < launches; i++)
        least = fmin(least, probe_launch(measurement, probe, 0, rounds, 1, count).host_seconds);
    return least;
}

// The least times of two chains.
typedef struct {
    double fused, separate;
} ChainTimes;

// Doubles the rounds until the slower chain seems `wanted` seconds slower than an empty launch.
static cl_uint rounds_find(Measurement *measurement, cl_uint rounds, double launch, double wanted)
{
    for (; compute_ok(measurement->compute) && rounds < TIMED_ROUNDS_MAX; rounds *= 2) {
        const double slower = fmax(chain_seconds(measurement, PROBE_TIME_FMA, rounds, 2),
                                   chain_seconds(measurement, PROBE_TIME_SEPARATE, rounds, 2));
        if (slower - launch >= wanted) break;
    }
    return rounds;
}

// Times both chains in turn, with more turns if fma seems slow.
static ChainTimes chains_time(Measurement *measurement, cl_uint rounds, double launch, double wanted)
{
    enum { TURNS_MIN = 4, TURNS_MAX = 16 };
    ChainTimes times = {INFINITY, INFINITY};
    for (int turn = 1; turn <= TURNS_MAX && compute_ok(measurement->compute); turn++) {
        times.fused = fmin(times.fused, chain_seconds(measurement, PROBE_TIME_FMA, rounds, 1));
        times.separate = fmin(times.separate, chain_seconds(measurement, PROBE_TIME_SEPARATE, rounds, 1));
        const bool seems_slow = times.fused - launch >= PASSPORT_FMA_COST_MAX * (times.separate - launch);
        // the first turn alone may have waited for a processor
        const bool takes_long = turn > 1 && fmax(times.fused, times.separate) > 50 * wanted;
        if ((turn >= TURNS_MIN && !seems_slow) || takes_long) break;
    }
    return times;
}

double fma_cost(Measurement *measurement)
{
    enum { EMPTY_LAUNCHES = 4 };
    const Operands chain = operands_of(measurement, (Reals){0.75, 0.5, 0.5});
    operands_write(measurement, &chain, 1);
    const double launch = chain_seconds(measurement, PROBE_TIME_SEPARATE, 0, EMPTY_LAUNCHES);
    // at PASSPORT_FMA_COST_MAX the faster of the two then takes as long as an empty launch
    const double wanted = fmax(timed_seconds_wanted, PASSPORT_FMA_COST_MAX * launch);
    cl_uint rounds = rounds_find(measurement, 8, launch, wanted);
    ChainTimes times = chains_time(measurement, rounds, launch, wanted);
    // on a busy machine a few rounds may have waited rather than calculated
    while (fmax(times.fused, times.separate) - launch < 0.5 * wanted && rounds < TIMED_ROUNDS_MAX &&
           compute_ok(measurement->compute)) {
        rounds = rounds_find(measurement, 2 * rounds, launch, wanted);
        times = chains_time(measurement, rounds, launch, wanted);
    }
    measurement->timed_rounds = rounds;
    const double separate_min = 0.01 * wanted; // smaller times are noise of the launches
    return (times.fused - launch) / fmax(times.separate - launch, separate_min);
}

static uint64_t greatest_divisor(uint64_t a, uint64_t b)
{
    while (b != 0) {
        const uint64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

// Returns the largest ratio of an event's time to the host's among launches that are long enough to compare.
static double timer_ratio(const Measurement *measurement)
{
    double ratio = 0;
    for (size_t i = 0; i < measurement->launches.count; i++) {
        const LaunchTime *time = &measurement->launches.items[i];
        if (time->host_seconds >= 0.5 * timed_seconds_wanted)
            ratio = fmax(ratio, (time->end_seconds - time->start_seconds) / time->host_seconds);
    }
    return ratio;
}

void timer_measure(Measurement *measurement)
{
    const double timestamp_error = 1e-6; // exceeds the rounding error of a double of the seconds since 1970
    TimerFindings *timer = &measurement->passport->timer;
    // on a busy machine the host may wait much longer than an event lasts, but hardly each time or for long
    // ones
    enum { TRIES = 16 };
    cl_uint rounds = measurement->timed_rounds;
    for (int i = 0; i < TRIES && timer_ratio(measurement) < 0.5 && rounds > 0; i++) {
        const double seconds = chain_seconds(measurement, PROBE_TIME_SEPARATE, rounds, 1);
        if (seconds < 20 * timed_seconds_wanted && rounds < TIMED_ROUNDS_MAX) rounds *= 2;
    }
    bool is_absent = true, is_counter = true, goes_back = false;
    for (size_t i = 0; i < measurement->launches.count; i++) {
        const LaunchTime *time = &measurement->launches.items[i], *before = i > 0 ? time - 1 : time;
        const double seconds = time->end_seconds - time->start_seconds;
        if (time->start_seconds == 0 && time->end_seconds == 0) continue;
        is_absent = false;
        is_counter = is_counter && seconds < 1.5e-9;
        goes_back = goes_back || seconds < 0 ||
                    (i > 0 && time->start_seconds < before->end_seconds - timestamp_error);
        timer->step_nanoseconds =
            greatest_divisor(timer->step_nanoseconds, (uint64_t)llround(1e9 * time->event_seconds));
    }
    // known devices tick in 10 nanoseconds or more; on a busy machine the host may be late after every launch
    const double ratio = timer_ratio(measurement);
    timer->tick_nanoseconds = ratio > 0 ? 1 / ratio : 0;
    timer->fault = is_absent                                    ? TIMER_ABSENT
                   : goes_back                                  ? TIMER_BACKWARD
                   : is_counter                                 ? TIMER_COUNTER
                   : ratio > 0 && (ratio < 0.15 || ratio > 1.1) ? TIMER_UNIT
                                                                : TIMER_SOUND;
}
