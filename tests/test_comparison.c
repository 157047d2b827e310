// Tests the statistic of glint bench on synthetic times: how often it reports a difference where there is
// none, how often it finds one, and that it reports when it cannot decide. The seeds are fixed, so that each
// run is the same.
#include "host/measure/comparison.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"

static Random generator;

static double random_unit(void)
{
    return random_between(&generator, 0, 1);
}

static double random_normal(void)
{
    return sqrt(-2 * log(1 - random_unit())) * cos(6.283185307179586 * random_unit());
}

// A machine on which other work comes in bursts that slow all runs, and the clock's frequency drifts.
typedef struct {
    double scatter;              // of a run, as a logarithm, and its outliers are ten times that
    double burst_share;          // of the runs
    double burst_slowdown;       // of what runs within one
    double calibration_slowdown; // the same, of the calibration
    double drift;                // of a round, as a logarithm: a random walk
    double placement;            // of a process, as a logarithm
    // state
    double speed;
    bool is_burst;
} Machine;

static const Machine quiet = {.scatter = 0.005, .placement = 0.005};
static const Machine busy = {.scatter = 0.03,
                             .burst_share = 0.4,
                             .burst_slowdown = 1.8,
                             .calibration_slowdown = 1.5,
                             .drift = 0.01,
                             .placement = 0.01};
static const Machine hopeless = {
    .scatter = 0.4, .burst_share = 0.5, .burst_slowdown = 3, .drift = 0.05, .placement = 0.1};

// Advances the machine by a round. A burst lasts for 30 rounds on average.
static void machine_step(Machine *machine)
{
    const double ends = 1.0 / 30;
    double starts = ends * machine->burst_share / (1 - machine->burst_share);
    machine->is_burst = machine->is_burst ? random_unit() >= ends : random_unit() < starts;
    machine->speed += machine->drift * random_normal();
}

static double run_seconds(const Machine *machine, double slowdown)
{
    double outlier = random_unit() < 0.1 ? 10 * fabs(random_normal()) : 0;
    return (machine->is_burst ? slowdown : 1) *
           exp(machine->speed + machine->scatter * (random_normal() + outlier));
}

// Simulates glint bench --against on such a machine, for a build that takes `slowdown` times as long.
static Verdict against_simulate(Machine machine, double slowdown, double tolerance)
{
    enum { ROWS = 1, LOOKS = 3, ROUNDS = 12 };
    Series ratios = {0};
    Comparison comparison = {0};
    for (size_t look = 0; look < LOOKS && comparison.verdict == VERDICT_UNDECIDED; look++) {
        while (ratios.count < comparison_pairs_at_look(look, ROWS)) {
            Series times[2] = {{0}, {0}};
            double place[2] = {exp(machine.placement * random_normal()),
                               slowdown * exp(machine.placement * random_normal())};
            for (int round = 0; round < ROUNDS; round++)
                for (int turn = 0; turn < 2; turn++) {
                    int which = (turn + round + (int)ratios.count) % 2;
                    machine_step(&machine);
                    series_add(&times[which], place[which] * run_seconds(&machine, machine.burst_slowdown));
                }
            series_add(&ratios, comparison_log_ratio(&times[1], &times[0]));
            series_free(&times[0]);
            series_free(&times[1]);
        }
        comparison = comparison_of_pairs(comparison, &ratios, look, ROWS, tolerance);
    }
    series_free(&ratios);
    return comparison.verdict;
}

// Simulates a report of 200 runs, which is one process.
static void report_simulate(Machine machine, double slowdown, Series *frame, Series *calibration)
{
    double place = slowdown * exp(machine.placement * random_normal());
    for (int i = 0; i < 200; i++) {
        machine_step(&machine);
        series_add(frame, place * run_seconds(&machine, machine.burst_slowdown));
        series_add(calibration, run_seconds(&machine, machine.calibration_slowdown));
    }
}

static Verdict reports_simulate(Machine old_machine, Machine new_machine, double slowdown, double tolerance)
{
    Series series[4] = {{0}, {0}, {0}, {0}};
    report_simulate(old_machine, 1, &series[0], &series[1]);
    report_simulate(new_machine, slowdown, &series[2], &series[3]);
    Comparison comparison = comparison_of_reports((ReportTimes){&series[2], &series[3]},
                                                  (ReportTimes){&series[0], &series[1]}, 1, tolerance);
    for (int i = 0; i < 4; i++)
        series_free(&series[i]);
    return comparison.verdict;
}

// The estimate of a report with few runs is that of their medians, and undecided.
TEST(reports_of_few_runs)
{
    Series old_frame = {0}, new_frame = {0}, calibration = {0};
    for (int i = 0; i < 5; i++) {
        series_add(&old_frame, 0.010 + 0.001 * i);
        series_add(&new_frame, 0.020 + 0.002 * i);
        series_add(&calibration, 0.003);
    }
    const Comparison comparison = comparison_of_reports((ReportTimes){&new_frame, &calibration},
                                                        (ReportTimes){&old_frame, &calibration}, 1, 1.1);
    assert_true(fabs(comparison.ratio - 2) < 1e-9);
    assert_int_equal(comparison.verdict, VERDICT_UNDECIDED);
    assert_true(isinf(comparison.high));
    series_free(&old_frame);
    series_free(&new_frame);
    series_free(&calibration);
}

// Simulates two rows of one process in turn, the second of which takes `slowdown` times as long.
static Verdict rounds_simulate(Machine machine, double slowdown, int rounds)
{
    Series times[2] = {{0}, {0}};
    const double place[2] = {exp(machine.placement * random_normal()),
                             slowdown * exp(machine.placement * random_normal())};
    for (int round = 0; round < rounds; round++)
        for (int row = 0; row < 2; row++) {
            machine_step(&machine);
            series_add(&times[row], place[row] * run_seconds(&machine, machine.burst_slowdown));
        }
    const Comparison comparison = comparison_of_rounds(&times[1], &times[0], 1, 1);
    series_free(&times[0]);
    series_free(&times[1]);
    return comparison.verdict;
}

typedef struct {
    int of[VERDICT_FASTER + 1];
} Counts;

static Counts against_count(Machine machine, double slowdown, int tries)
{
    Counts counts = {{0}};
    generator.state = 1;
    for (int i = 0; i < tries; i++)
        counts.of[against_simulate(machine, slowdown, 1.02)]++;
    return counts;
}

static Counts reports_count(Machine old_machine, Machine new_machine, double slowdown, int tries)
{
    Counts counts = {{0}};
    generator.state = 1;
    for (int i = 0; i < tries; i++)
        counts.of[reports_simulate(old_machine, new_machine, slowdown, 1.1)]++;
    return counts;
}

static void counts_print(const char *what, Counts counts)
{
    print_message("%-44s %5d undecided %5d same %5d slower %5d faster\n", what, counts.of[VERDICT_UNDECIDED],
                  counts.of[VERDICT_SAME], counts.of[VERDICT_SLOWER], counts.of[VERDICT_FASTER]);
}

enum { TRIES = 1000 };

// False alarms are at most 1 % whatever the machine.
TEST(same_build_against_itself)
{
    const Machine *machines[] = {&quiet, &busy, &hopeless};
    for (int i = 0; i < 3; i++) {
        Counts counts = against_count(*machines[i], 1, TRIES);
        counts_print("against itself", counts);
        assert_true(counts.of[VERDICT_SLOWER] + counts.of[VERDICT_FASTER] <= TRIES / 100);
        assert_true(i > 0 || counts.of[VERDICT_SAME] >= TRIES * 95 / 100);
        assert_true(i < 2 || counts.of[VERDICT_UNDECIDED] >= TRIES * 95 / 100);
    }
}

TEST(slower_build_is_found)
{
    Counts slower = against_count(quiet, 1.05, TRIES), faster = against_count(quiet, 1 / 1.05, TRIES),
           noisy = against_count(busy, 1.05, TRIES);
    counts_print("5 % slower, quiet", slower);
    counts_print("5 % faster, quiet", faster);
    counts_print("5 % slower, busy", noisy);
    assert_true(slower.of[VERDICT_SLOWER] >= TRIES * 99 / 100);
    assert_true(faster.of[VERDICT_FASTER] >= TRIES * 99 / 100);
    assert_true(noisy.of[VERDICT_SLOWER] >= TRIES * 95 / 100);
    assert_int_equal(noisy.of[VERDICT_FASTER], 0);
}

// Reports on a quiet and on a busy or slower machine give no false alarm, but no claim either.
TEST(reports_of_one_build)
{
    Machine slow = quiet, thermal = quiet;
    slow.speed = log(1.4);
    thermal.drift = 0.002;
    const struct {
        const char *what;
        const Machine *old, *new;
    } cases[] = {
        {"reports: quiet, quiet", &quiet, &quiet},      {"reports: quiet, busy", &quiet, &busy},
        {"reports: busy, quiet", &busy, &quiet},        {"reports: busy, busy", &busy, &busy},
        {"reports: quiet, 1.4 as slow", &quiet, &slow}, {"reports: drift, drift", &thermal, &thermal},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        Counts counts = reports_count(*cases[i].old, *cases[i].new, 1, TRIES);
        counts_print(cases[i].what, counts);
        assert_true(counts.of[VERDICT_SLOWER] + counts.of[VERDICT_FASTER] <= TRIES / 100);
        assert_true(i > 0 || counts.of[VERDICT_SAME] >= TRIES * 99 / 100);
    }
}

TEST(reports_of_a_slower_build)
{
    Counts counts = reports_count(quiet, quiet, 1.2, TRIES);
    counts_print("reports: quiet, 20 % slower", counts);
    assert_true(counts.of[VERDICT_SLOWER] >= TRIES * 99 / 100);
}

// Rows of one process tie unless one is slower, and no few runs tell.
TEST(rows_of_one_process)
{
    const struct {
        const char *what;
        const Machine *machine;
        double slowdown;
        int rounds;
        int slower_min, slower_max; // of TRIES
    } cases[] = {
        {"rows: equal, quiet", &quiet, 1, 20, 0, TRIES / 100},
        {"rows: equal, busy", &busy, 1, 20, 0, TRIES / 100},
        {"rows: equal, busy, long", &busy, 1, 400, 0, TRIES / 100},
        {"rows: 10 % slower, quiet", &quiet, 1.1, 20, TRIES * 99 / 100, TRIES},
        {"rows: 20 % slower, busy, long", &busy, 1.2, 400, TRIES * 95 / 100, TRIES},
        {"rows: twice as slow, 7 rounds", &quiet, 2, 7, 0, 0},
        {"rows: twice as slow, 8 rounds", &quiet, 2, 8, TRIES * 99 / 100, TRIES},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        Counts counts = {{0}};
        generator.state = 1;
        for (int k = 0; k < TRIES; k++)
            counts.of[rounds_simulate(*cases[i].machine, cases[i].slowdown, cases[i].rounds)]++;
        counts_print(cases[i].what, counts);
        const int slower = counts.of[VERDICT_SLOWER];
        assert_true(slower >= cases[i].slower_min && slower <= cases[i].slower_max);
        assert_true(counts.of[VERDICT_FASTER] <= TRIES / 100);
    }
}

TEST(rows)
{
    static const struct {
        Verdict frame, processor, row;
    } rows[] = {
        {VERDICT_SLOWER, VERDICT_SAME, VERDICT_SLOWER},
        {VERDICT_SLOWER, VERDICT_FASTER, VERDICT_SLOWER},
        {VERDICT_SAME, VERDICT_SLOWER, VERDICT_SLOWER},
        {VERDICT_FASTER, VERDICT_FASTER, VERDICT_FASTER},
        {VERDICT_SAME, VERDICT_FASTER, VERDICT_FASTER},
        {VERDICT_FASTER, VERDICT_SAME, VERDICT_UNDECIDED},
        {VERDICT_FASTER, VERDICT_SLOWER, VERDICT_SLOWER},
        {VERDICT_SAME, VERDICT_SAME, VERDICT_SAME},
        {VERDICT_FASTER, VERDICT_UNDECIDED, VERDICT_UNDECIDED},
        {VERDICT_SAME, VERDICT_UNDECIDED, VERDICT_SAME},
    };
    for (size_t i = 0; i < COUNT_OF(rows); i++)
        assert_int_equal(verdict_of_row(rows[i].frame, rows[i].processor), rows[i].row);
}

// The ends are the order statistics that the binomial distribution gives, worked out by hand.
TEST(intervals)
{
    // 2 / 2^9 <= 0.01 / 2 < 2 / 2^8, and each further look takes twice as many
    assert_int_equal(comparison_pairs_at_look(0, 1), 9);
    assert_int_equal(comparison_pairs_at_look(2, 1), 36);
    assert_int_equal(comparison_pairs_at_look(0, 10), 12);
    Series ratios = {0};
    for (int i = 0; i < 8; i++)
        series_add(&ratios, 0.01 * (i + 1));
    Comparison few = comparison_of_pairs((Comparison){0}, &ratios, 0, 1, 1.02);
    assert_true(few.low == 0 && few.high == INFINITY && few.verdict == VERDICT_UNDECIDED);
    series_add(&ratios, 5); // one outlier of nine is an end
    Comparison nine = comparison_of_pairs((Comparison){0}, &ratios, 0, 1, 1.02);
    assert_true(fabs(log(nine.ratio) - 0.05) < 1e-12 && fabs(log(nine.low) - 0.01) < 1e-12);
    assert_true(fabs(log(nine.high) - 5) < 1e-12 && nine.verdict == VERDICT_SLOWER);
    assert_true(comparison_of_pairs((Comparison){0}, &ratios, 0, 1, 200).verdict == VERDICT_SAME);
    // of 18, 2 (1 + 18 + 153) / 2^18 <= 0.01 / 4: the third from each end, but not the fourth
    for (int i = 0; i < 9; i++)
        series_add(&ratios, -0.01 * (i + 1));
    Comparison eighteen = comparison_of_pairs((Comparison){0}, &ratios, 1, 1, 1.02);
    assert_true(fabs(log(eighteen.low) + 0.07) < 1e-12 && fabs(log(eighteen.high) - 0.07) < 1e-12);
    assert_true(eighteen.verdict == VERDICT_UNDECIDED);
    assert_int_equal(comparison_of_pairs(nine, &ratios, 1, 1, 1.02).verdict, VERDICT_SLOWER);
    series_free(&ratios);
    // of 5000, 2^-5000 underflows: the 2401st from each end, since twice the probability of at most 2400
    // heads is 0.00488 and of 2401 is 0.00533
    for (int i = 0; i < 5000; i++)
        series_add(&ratios, 1e-4 * (i + 1));
    Comparison many = comparison_of_pairs((Comparison){0}, &ratios, 0, 1, 1.02);
    assert_true(fabs(log(many.low) - 0.2401) < 1e-12 && fabs(log(many.high) - 0.26) < 1e-12);
    series_free(&ratios);
}

TEST_MAIN(NULL, NULL)
