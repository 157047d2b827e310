// Tests how rows are handed out to workers. Bands reach the sink in order from the top whatever the order
// they end in, sizes follow the paces, and the rows of a failed worker go to the others.
#include "host/render/scheduler.h"
#include "tests/check.h"
#include <pthread.h>
#include <stdatomic.h>

enum { WIDTH = 4, ROWS = 64, STEP = 4, ROWS_MAX = 16, COMPONENTS = 3 };

typedef struct {
    uint32_t rows, bands; // of the sink, in order
    uint32_t bands_max;   // the sink ends the render after these; 0: never
    size_t dropped, dropped_count;
    bool is_right;
} Sink;

// The clock of the scheduler (the Makefile's --wrap), which only tests advance.
static atomic_uint milliseconds;
double __wrap_clock_seconds(void);
double __wrap_clock_seconds(void)
{
    return 1e-3 * milliseconds;
}

// Checks that bands arrive in order and that each of their values is its row.
static bool band_sink(void *context, const Film *band)
{
    Sink *sink = context;
    const float *values = band->layers[LAYER_COLOR];
    sink->is_right = sink->is_right && band->first_row == sink->rows;
    for (uint32_t row = 0; row < band->height; row++)
        for (uint32_t i = 0; i < WIDTH * COMPONENTS; i++)
            sink->is_right =
                sink->is_right && values[row * WIDTH * COMPONENTS + i] == (float)(sink->rows + row);
    sink->rows += band->height;
    sink->bands++;
    return sink->bands != sink->bands_max;
}

static void worker_dropped(void *context, size_t worker)
{
    Sink *sink = context;
    sink->dropped = worker;
    sink->dropped_count++;
}

static Scheduler *start(Sink *sink, size_t worker_count)
{
    *sink = (Sink){.is_right = true};
    return scheduler_open(&(SchedulerSettings){.row_count = ROWS,
                                               .worker_count = worker_count,
                                               .sink = band_sink,
                                               .dropped = worker_dropped,
                                               .context = sink});
}

static BandRows acquire(Scheduler *scheduler, size_t worker)
{
    return scheduler_acquire(scheduler, worker, ROWS_MAX, STEP);
}

static bool deliver(Scheduler *scheduler, size_t worker, BandRows rows)
{
    float values[ROWS * WIDTH * COMPONENTS];
    for (uint32_t row = 0; row < rows.row_count; row++)
        for (uint32_t i = 0; i < WIDTH * COMPONENTS; i++)
            values[row * WIDTH * COMPONENTS + i] = (float)(rows.first_row + row);
    Film band = {
        .width = WIDTH, .height = rows.row_count, .first_row = rows.first_row, .real_size = sizeof(float)};
    band.layers[LAYER_COLOR] = values;
    bool continues = scheduler_deliver(scheduler, worker, &band);
    memset(values, 0, sizeof values); // the renderer's memory is for its next band
    return continues;
}

static void work(Scheduler *scheduler, size_t worker)
{
    for (BandRows rows; (rows = acquire(scheduler, worker)).row_count > 0;)
        if (!deliver(scheduler, worker, rows)) break;
}

// Renders the rows in their time at that pace.
static bool deliver_at(Scheduler *scheduler, size_t worker, BandRows rows, unsigned rows_per_second)
{
    milliseconds += 1000 * rows.row_count / rows_per_second;
    return deliver(scheduler, worker, rows);
}

// Renders each worker's first band at its pace.
static void set_paces(Scheduler *scheduler, size_t worker_count, const unsigned *rows_per_second)
{
    for (size_t i = 0; i < worker_count; i++)
        assert_true(deliver_at(scheduler, i, acquire(scheduler, i), rows_per_second[i]));
}

TEST(one_worker_gets_what_it_asks_for)
{
    Sink sink;
    WorkerShare share;
    Scheduler *scheduler = start(&sink, 1);
    work(scheduler, 0);
    assert_true(scheduler_close(scheduler, &share));
    assert_true(sink.is_right);
    assert_int_equal(sink.bands, ROWS / ROWS_MAX);
    assert_int_equal(share.rows, ROWS);
    assert_int_equal(share.bands, ROWS / ROWS_MAX);
}

TEST(lower_bands_wait)
{
    Sink sink;
    WorkerShare shares[3];
    Scheduler *scheduler = start(&sink, 3);
    BandRows first = acquire(scheduler, 0), second = acquire(scheduler, 1), third = acquire(scheduler, 2);
    assert_int_equal(first.first_row, 0);
    assert_int_equal(second.first_row, first.row_count);
    assert_int_equal(third.first_row, second.first_row + second.row_count);
    assert_true(deliver(scheduler, 2, third));
    assert_true(deliver(scheduler, 1, second));
    assert_int_equal(sink.rows, 0);
    assert_true(deliver(scheduler, 0, first));
    assert_int_equal(sink.bands, 3);
    work(scheduler, 2);
    assert_true(scheduler_close(scheduler, shares));
    assert_true(sink.is_right);
    assert_int_equal(shares[0].rows + shares[1].rows + shares[2].rows, ROWS);
    assert_int_equal(shares[1].rows, second.row_count);
}

// A worker may be a thousand times slower than the others.
TEST(first_bands_are_short)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 3);
    for (size_t i = 0; i < 3; i++)
        assert_int_equal(acquire(scheduler, i).row_count, STEP);
    scheduler_end(scheduler);
    assert_false(scheduler_close(scheduler, NULL));
}

// A band is half of a worker's share of the rows that are left, in whole steps and at least one.
TEST(bands_shrink)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 2);
    set_paces(scheduler, 2, (const unsigned[]){4, 4});
    static const uint32_t expected[] = {12, 8, 8, 4, 4, 4, 4, 4, 4, 4}; // of 56, 44, 36, 28 …
    for (size_t i = 0; i < COUNT_OF(expected); i++) {
        const BandRows rows = acquire(scheduler, i % 2);
        assert_int_equal(rows.row_count, expected[i]);
        assert_true(deliver_at(scheduler, i % 2, rows, 4));
    }
    assert_true(scheduler_close(scheduler, NULL));
    assert_true(sink.is_right);
}

TEST(bands_follow_the_pace)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 2);
    set_paces(scheduler, 2, (const unsigned[]){1, 4});
    assert_int_equal(scheduler_acquire(scheduler, 0, ROWS, 1).row_count, 5);  // half of a fifth of 56
    assert_int_equal(scheduler_acquire(scheduler, 1, ROWS, 1).row_count, 20); // half of four fifths of 51
    scheduler_end(scheduler);
    assert_false(scheduler_close(scheduler, NULL));
}

// A worker gets no rows where the other ends sooner with all that are left, unless that fails.
TEST(the_slow_leave_the_rest)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 2);
    set_paces(scheduler, 2, (const unsigned[]){1, 100});
    bool waits = false;
    assert_int_equal(scheduler_try(scheduler, 0, ROWS_MAX, STEP, &waits).row_count, 0);
    assert_true(waits);
    const BandRows lost = acquire(scheduler, 1);
    assert_int_equal(lost.row_count, ROWS_MAX);
    scheduler_drop(scheduler, 1);
    work(scheduler, 0);
    assert_true(scheduler_close(scheduler, NULL));
    assert_true(sink.is_right);
}

TEST(a_dropped_workers_rows_go_to_others)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 2);
    BandRows lost = acquire(scheduler, 1), kept = acquire(scheduler, 0);
    assert_int_equal(lost.first_row, 0);
    scheduler_drop(scheduler, 1);
    assert_int_equal(sink.dropped_count, 1);
    assert_int_equal(sink.dropped, 1);
    assert_true(deliver(scheduler, 0, kept));
    assert_int_equal(sink.rows, 0);
    BandRows again = acquire(scheduler, 0);
    assert_int_equal(again.first_row, 0);
    assert_true(deliver(scheduler, 0, again));
    work(scheduler, 0);
    assert_true(scheduler_close(scheduler, NULL));
    assert_true(sink.is_right);
}

TEST(nobody_is_left)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 2);
    acquire(scheduler, 0);
    scheduler_drop(scheduler, 0);
    acquire(scheduler, 1);
    scheduler_drop(scheduler, 1);
    assert_int_equal(sink.dropped_count, 1); // nobody could continue after the last
    assert_false(scheduler_close(scheduler, NULL));
}

TEST(the_sink_ends_the_render)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 2);
    sink.bands_max = 2;
    BandRows first = acquire(scheduler, 0), second = acquire(scheduler, 1);
    assert_true(deliver(scheduler, 0, first));
    BandRows third = acquire(scheduler, 0);
    assert_false(scheduler_has_ended(scheduler));
    assert_false(deliver(scheduler, 1, second));
    assert_false(deliver(scheduler, 0, third));
    assert_true(scheduler_has_ended(scheduler));
    assert_int_equal(acquire(scheduler, 1).row_count, 0);
    assert_false(scheduler_close(scheduler, NULL));
    assert_int_equal(sink.bands, 2);
}

// Takes a step's rows for worker 1, which must not wait.
static void work_a_step(Scheduler *scheduler, uint32_t first_row)
{
    bool waits;
    BandRows rows = scheduler_try(scheduler, 1, STEP, STEP, &waits);
    assert_int_equal(rows.first_row, first_row);
    assert_int_equal(rows.row_count, STEP);
    assert_true(deliver(scheduler, 1, rows));
}

// A worker that is too far ahead waits for the one that has the top, or for what that leaves.
TEST(few_bands_wait)
{
    for (int is_dropped = 0; is_dropped < 2; is_dropped++) {
        enum { ROW_BYTES = WIDTH * COMPONENTS * sizeof(float) };
        Sink sink = {.is_right = true};
        Scheduler *scheduler =
            scheduler_open(&(SchedulerSettings){.row_count = ROWS,
                                                .worker_count = 2,
                                                .sink = band_sink,
                                                .context = &sink,
                                                .waiting_bytes_max = 3 * STEP * ROW_BYTES});
        BandRows top = acquire(scheduler, 0);
        assert_int_equal(top.row_count, STEP);
        work_a_step(scheduler, STEP);
        work_a_step(scheduler, 2 * STEP);
        bool waits = false;
        assert_int_equal(scheduler_try(scheduler, 1, STEP, STEP, &waits).row_count, 0);
        assert_true(waits);
        if (is_dropped) {
            scheduler_drop(scheduler, 0);
            work_a_step(scheduler, 0);
        } else {
            assert_true(deliver(scheduler, 0, top));
            work_a_step(scheduler, 3 * STEP);
        }
        work(scheduler, 1);
        assert_true(scheduler_close(scheduler, NULL));
        assert_true(sink.is_right);
    }
}

typedef struct {
    Scheduler *scheduler;
    size_t worker;
    atomic_uint delivered_rows;
} WorkerThread;

static void *thread_work(void *argument)
{
    WorkerThread *thread = argument;
    for (BandRows rows; (rows = acquire(thread->scheduler, thread->worker)).row_count > 0;) {
        if (!deliver(thread->scheduler, thread->worker, rows)) break;
        thread->delivered_rows += rows.row_count;
    }
    return NULL;
}

// A worker without rows waits, since it receives those of a worker that fails later.
TEST(idle_workers_wait_for_lost_rows)
{
    Sink sink;
    Scheduler *scheduler = start(&sink, 2);
    const BandRows lost = acquire(scheduler, 0);
    WorkerThread other = {.scheduler = scheduler, .worker = 1};
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, thread_work, &other), 0);
    while (other.delivered_rows < ROWS - lost.row_count)
        usleep(1000);
    usleep(20000); // so that it is already waiting; the test would also pass if it were not
    bool waits;
    assert_int_equal(scheduler_try(scheduler, 1, ROWS_MAX, STEP, &waits).row_count, 0);
    assert_true(waits);
    scheduler_drop(scheduler, 0);
    pthread_join(thread, NULL);
    assert_true(scheduler_close(scheduler, NULL));
    assert_true(sink.is_right);
}

TEST(many_threads)
{
    enum { COUNT = 4, ROUNDS = 200 };
    for (int round = 0; round < ROUNDS; round++) {
        Sink sink;
        WorkerThread workers[COUNT];
        pthread_t threads[COUNT];
        Scheduler *scheduler = start(&sink, COUNT);
        for (size_t i = 0; i < COUNT; i++) {
            workers[i] = (WorkerThread){.scheduler = scheduler, .worker = i};
            assert_int_equal(pthread_create(&threads[i], NULL, thread_work, &workers[i]), 0);
        }
        for (size_t i = 0; i < COUNT; i++)
            pthread_join(threads[i], NULL);
        assert_true(scheduler_close(scheduler, NULL));
        assert_true(sink.is_right);
    }
}

static int alarm_set(void **state)
{
    (void)state;
    alarm(60); // ends a test in which a worker waits forever
    return 0;
}

TEST_MAIN(alarm_set, NULL)
