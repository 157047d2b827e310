// Random objects of every shape and random rays at them, the same in every run. Axes and their ends are
// floats exactly, so that a ray along an axis is parallel to it at every precision.
#pragma once

#include "host/scene/scene.h"

typedef enum {
    SPECIMEN_SPHERE,
    SPECIMEN_PLANE,
    SPECIMEN_DISC,
    SPECIMEN_BOX,
    SPECIMEN_CYLINDER_CAPPED,
    SPECIMEN_CYLINDER_OPEN,
    SPECIMEN_CYLINDER_INFINITE,
    SPECIMEN_CONE_CAPPED,
    SPECIMEN_CONE_OPEN,
    SPECIMEN_CONE_TIP,
    SPECIMEN_CONE_INFINITE,
    SPECIMEN_TRIANGLE,
    SPECIMEN_TRIANGLE_SMOOTH,
    SPECIMEN_TORUS,
    SPECIMEN_TORUS_THIN,
    SPECIMEN_TORUS_FAT,
    SPECIMEN_TORUS_SPINDLE, // whose tube is wider than its circle: no hole
    SPECIMEN_PARABOLOID_CAPPED,
    SPECIMEN_PARABOLOID_OPEN,
    SPECIMEN_PARABOLOID_INFINITE,
    SPECIMEN_COUNT
} SpecimenKind;

extern const char *const specimen_names[SPECIMEN_COUNT];

typedef struct {
    SpecimenKind kind;
    Object object;
    Vector3 center;
    double reach; // radius about the center of what matters: all of a bounded object
    Vector3 axis; // along which rays are special: an axis, a normal, an edge; not unit
} Specimen;

typedef struct {
    uint64_t state;
} Random;

double random_between(Random *random, double low, double high);
Vector3 random_in_ball(Random *random);

Specimen specimen_make(SpecimenKind kind, Random *random);

typedef struct {
    Vector3 origin, direction;
} SpecimenRay;

// Aimed at the specimen and slightly past it from 1.001 to 10^4 times its reach; from inside; along the
// world's axes with zeros of either sign; along its own axis; at its outline. At a torus also from inside its
// tube, from within its hole, or where a spindle's
// tube lies in itself, and in the plane of its circle.
SpecimenRay specimen_ray(const Specimen *specimen, Random *random);
