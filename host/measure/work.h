// The arithmetic that an image needs at least, to hold against what a device can do.
#pragma once

#include "host/scene/scene.h"

// Operations of one ray that looks for its closest hit and misses every object of the scene: an addition,
// multiplication, comparison, division or square root counts as one. The same for every precision, so that
// the share of a device's peak tells one way of computing from another.
double work_flops_per_ray(const Scene *scene);
