// What a device does for glint, once: a render with counted rays and all AOVs, a trace, and a large buffer.
#pragma once

#include "host/render/renderer.h"

enum { SIDE = 8, BAND_ROWS = 4, RAY_COUNT = 3 };

typedef struct {
    float colors[SIDE * SIDE * 3];
    uint64_t ray_counts[5];
    size_t band_count;
    TraceHit hits[RAY_COUNT];
} Answer;

extern const Device *work_device;
extern Scene work_scene;
extern RenderSettings work_settings;
extern Answer right; // as undisturbed work gives it

// Chooses the device and makes the scene, and the right answer by working once: a group's set-up of cmocka.
int work_set_up(void **state);
int work_tear_down(void **state);

// A BandSink into an Answer.
bool work_receive_band(void *answer, const Film *band, double fraction_done);
// Returns whether all was done; the compute is left open.
bool work(Compute *compute, Answer *answer);
// Fails the test where an object is not released.
void compute_close_checked(Compute *compute);
// Works with no failure injected.
void assert_work_is_right(void);
