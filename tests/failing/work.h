// Uses a device once as glint does: a render with counted rays and all AOVs, a trace, and a large buffer.
#pragma once

#include "host/render/render_job.h"

enum { SIDE = 8, BAND_ROWS = 4, RAY_COUNT = 3 };

typedef struct {
    float colors[SIDE * SIDE * 3];
    uint64_t ray_counts[RAYS_COUNT];
    size_t band_count;
    TraceHit hits[RAY_COUNT];
} WorkResult;

extern const Device *work_device;
extern Scene work_scene;
extern RenderSettings work_settings;
extern WorkResult right; // as undisturbed work gives it

// cmocka's group setup. Chooses the device, makes the scene, and gets the right result by working once.
int work_set_up(void **state);
int work_tear_down(void **state);

// Adds a band to a WorkResult. This is a BandSink.
bool work_receive_band(void *result, const Film *band);
// Returns true if all was done. The compute is left open.
bool work(Compute *compute, WorkResult *result);
// Closes the compute. Fails the test if an object was not released.
void compute_close_checked(Compute *compute);
// Works with no failure injected, and fails the test if the result is wrong. Returns the number of calls of a
// function, unless NULL.
size_t assert_work_is_right(const char *counted);
