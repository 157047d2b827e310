// The arithmetic that an image needs at least, to compare with what a device can do.
#pragma once

#include "host/scene/scene.h"

// Operations of one ray that looks for its closest hit and misses every object of the scene: an addition,
// multiplication, comparison, division or square root counts as one. The same for every precision, so that
// shares of a device's peak compare ways of computing.
double work_flops_per_ray(const Scene *scene);
