// Makes spheres in Embree, in one of two ways. Its own geometry for them tests several spheres against one
// ray. A user geometry has callbacks that test one sphere against the 16 rays of a packet.
#pragma once

#include "description.h"
#include <embree3/rtcore.h>

RTCGeometry spheres_embree(RTCDevice device, Sphere *spheres, size_t count);

// Only packets of 16 rays with unit directions are supported. `spheres` must outlive the geometry.
RTCGeometry spheres_user(RTCDevice device, Sphere *spheres, size_t count);
