// Renders one image on two devices, of which one or both fail, at each call of the first band in turn. The
// image must be whole if one device is left, and the failure must be reported.
// run_tests: sanitized
#include "tests/check.h"
#include "tests/failing/faults.h"
#include "tests/failing/work.h"
#include <pthread.h>
#include <semaphore.h>

// Two renderers, as on two devices, of which the second renders in a thread. Each waits until the other has
// taken a band, or the second has failed.
static struct {
    sem_t first_continues, second_continues;
    bool first_has_waited, second_has_waited;
    size_t dropped_count, dropped;
} pair;

static bool pair_wait(void *context)
{
    (void)context;
    bool is_first = pthread_equal(pthread_self(), first_thread);
    bool *has_waited = is_first ? &pair.first_has_waited : &pair.second_has_waited;
    if (*has_waited) return false;
    *has_waited = true;
    sem_post(is_first ? &pair.second_continues : &pair.first_continues);
    sem_wait(is_first ? &pair.first_continues : &pair.second_continues);
    return false;
}

static void pair_dropped(void *context, size_t index)
{
    (void)context;
    pair.dropped_count++;
    pair.dropped = index;
    sem_post(&pair.first_continues);
    sem_post(&pair.second_continues);
}

// Returns whether the image is whole. The computes are left open.
static bool pair_work(Compute computes[2], WorkResult *result)
{
    memset(&pair, 0, sizeof pair);
    memset(result, 0, sizeof *result);
    sem_init(&pair.first_continues, 0, 0);
    sem_init(&pair.second_continues, 0, 0);
    Renderer *renderers[2];
    work_settings.stop = pair_wait;
    for (size_t i = 0; i < 2; i++) {
        compute_open(&computes[i], work_device);
        renderers[i] = renderer_open(&computes[i], &work_scene, &work_settings, NULL);
    }
    const RenderJob job = {.renderers = renderers,
                           .count = 2,
                           .aovs = AOVS_ALL,
                           .sink = work_receive_band,
                           .dropped = pair_dropped,
                           .context = result};
    bool whole = render_job_run(&job);
    work_settings.stop = NULL;
    for (size_t i = 0; i < 2; i++)
        renderer_close(renderers[i]);
    sem_destroy(&pair.first_continues);
    sem_destroy(&pair.second_continues);
    return whole;
}

static void pair_close(Compute computes[2])
{
    compute_close(&computes[0]);
    compute_close_checked(&computes[1]);
}

// One of two devices fails, at each call of its first band in turn. The other renders the whole image.
TEST(one_of_two_devices)
{
    static const char *const needed[] = {
        "clCreateBuffer",     "clSetKernelArg", "clEnqueueWriteBuffer",   "clEnqueueReadBuffer",
        "clEnqueueMapBuffer", "clGetEventInfo", "clEnqueueNDRangeKernel", "clWaitForEvents"};
    Compute computes[2];
    WorkResult result;
    for (size_t i = 0; i < COUNT_OF(needed); i++) {
        injected = (Fault){.call = needed[i], .is_in_threads = true, .act = FAULT_COUNT};
        assert_true(pair_work(computes, &result));
        assert_int_equal(pair.dropped_count, 0);
        assert_memory_equal(result.colors, right.colors, sizeof right.colors);
        pair_close(computes);
        const size_t count = injected.count;
        assert_true(count > 0);
        for (size_t k = 0; k < count; k++) {
            injected = (Fault){.call = needed[i], .index = k, .is_in_threads = true, .act = FAULT_FAIL};
            bool whole = pair_work(computes, &result);
            if (!whole) fail_msg("%s, call %zu: no image", needed[i], k);
            assert_int_equal(pair.dropped_count, 1);
            assert_int_equal(pair.dropped, 1);
            assert_int_equal(result.band_count, 2);
            assert_memory_equal(result.colors, right.colors, sizeof right.colors);
            assert_true(compute_ok(&computes[0]));
            assert_string_equal(computes[1].failure.call, needed[i]);
            pair_close(computes);
        }
    }
    injected.call = NULL;
}

// The second device gets no thread, and the first renders the whole image.
TEST(a_device_without_a_thread)
{
    Compute computes[2];
    WorkResult result;
    injected = (Fault){.call = "pthread_create", .index = EVERY_CALL, .act = FAULT_FAIL};
    assert_true(pair_work(computes, &result));
    injected.call = NULL;
    assert_int_equal(pair.dropped_count, 1);
    assert_int_equal(pair.dropped, 1);
    assert_memory_equal(result.colors, right.colors, sizeof right.colors);
    assert_true(compute_ok(&computes[0]));
    assert_string_equal(computes[1].failure.call, "pthread_create");
    pair_close(computes);
}

TEST(both_of_two_devices)
{
    Compute computes[2];
    WorkResult result;
    injected = (Fault){.call = "clEnqueueNDRangeKernel", .index = EVERY_CALL, .act = FAULT_FAIL};
    assert_false(pair_work(computes, &result));
    assert_int_equal(pair.dropped_count, 1); // the last one reports for all
    assert_false(compute_ok(&computes[0]) || compute_ok(&computes[1]));
    assert_int_equal(result.band_count, 0);
    pair_close(computes);
    injected.call = NULL;
}

TEST_MAIN(work_set_up, work_tear_down)
