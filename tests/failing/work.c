#include "tests/failing/work.h"
#include "host/base/memory.h"
#include "tests/check.h"
#include "tests/failing/calls.h"
#include "tests/failing/faults.h"
#include "tests/scene_reading.h"
#include <stdlib.h>
#include <string.h>

enum { LARGE_BYTES = 4 << 20 };

static DeviceList devices;
const Device *work_device;
Scene work_scene;
WorkResult right;

bool work_receive_band(void *context, const Film *band)
{
    WorkResult *result = context;
    memcpy(result->colors + (size_t)band->first_row * SIDE * 3, band->layers[LAYER_COLOR],
           (size_t)band->height * SIDE * 3 * sizeof *result->colors);
    result->band_count++;
    return true;
}

RenderSettings work_settings = {.width = SIDE,
                                .height = SIDE,
                                .region_width = SIDE,
                                .region_height = SIDE,
                                .sample_count = 1,
                                .precision = PRECISION_SINGLE,
                                .lanes = 1,
                                .counting = true,
                                .shift_to_eye = true,
                                .band_rows = BAND_ROWS};

bool work(Compute *compute, WorkResult *result)
{
    static const TraceRay rays[RAY_COUNT] = {{{0, 0, 5}, {0, 0, -1}, 0, 100},
                                             {{0, 3, 5}, {0, 0, -1}, 0, 100},
                                             {{1, 1, 5}, {0, -0.25, -1}, 0, 100}};
    MessageList messages = {0};
    memset(result, 0, sizeof *result);
    compute_open(compute, work_device);
    cl_mem large = buffer_adopt(compute, LARGE_BYTES, memory_allocate_large(LARGE_BYTES, 1));
    Renderer *renderer = renderer_open(compute, &work_scene, &work_settings, &messages);
    bool done = renderer && renderer_render(renderer, AOVS_ALL, work_receive_band, result) &&
                renderer_trace(renderer, rays, RAY_COUNT, result->hits);
    if (renderer) memcpy(result->ray_counts, renderer_report(renderer)->rays, sizeof result->ray_counts);
    renderer_close(renderer);
    buffer_release(large);
    assert_int_equal(messages.count, 0); // the user made no mistake
    message_list_free(&messages);
    assert_int_equal(done, compute_ok(compute));
    return done;
}

void compute_close_checked(Compute *compute)
{
    compute_close(compute);
    if (live_count != 0) fail_msg("%ld objects were not released", live_count);
}

size_t assert_work_is_right(const char *counted)
{
    injected = (Fault){.call = counted, .act = FAULT_COUNT};
    Compute compute;
    WorkResult result;
    assert_true(work(&compute, &result));
    compute_close_checked(&compute);
    assert_memory_equal(&result, &right, sizeof result);
    return injected.count;
}

int work_set_up(void **state)
{
    (void)state;
    first_thread = pthread_self();
    setenv("TMPDIR", "/dev/null", 1); // no place for the text of programs that do not build
    MessageList messages = {0};
    device_list_open(&devices, NULL);
    work_device = device_choose(&devices, device_selector(NULL), &messages);
    message_list_print(&messages, stderr);
    message_list_free(&messages);
    if (!work_device) return -1;
    work_scene = scene_of_text("tiny.yaml", "camera: {position: [0, 1, 5], look_at: [0, 0, 0]}\n"
                                            "lights: [{point: {position: [3, 5, 4]}}]\n"
                                            "objects: [{sphere: {center: [0, 0, 0], radius: 1}}]\n");
    Compute compute;
    if (!work(&compute, &right)) return -1;
    compute_close(&compute);
    bool is_right = right.hits[0].object == 0 && right.colors[(SIDE + 1) * SIDE / 2 * 3] > 0 &&
                    right.ray_counts[RAYS_CAMERA] == SIDE * SIDE;
    return is_right ? 0 : -1;
}

int work_tear_down(void **state)
{
    (void)state;
    scene_free(&work_scene);
    device_list_close(&devices);
    return 0;
}
