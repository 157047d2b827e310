// What the probe cases ask and what the exact answers are: rays, scenes and expected hits. The tables are
// written by tests/oracle/write_tables.py.
#pragma once

#include "host/verify/families.h"
#include <math.h>

// A ray of decimal numbers, each to be rounded once to the precision. It stands for up to five: itself, then
// with the x of its origin and that of its direction one unit in the last place farther from 0 and nearer.
typedef struct {
    double origin[3], direction[3], start;
} PlainRay;

#define MISS       UINT32_MAX
#define ANY_OBJECT (UINT32_MAX - 1)

// Of one ray. Tiers are A, B, C at the width of float, D alone at that of double.
typedef struct {
    double t, rest; // the distance is t + rest
    uint32_t object;
    unsigned open;    // a bit for each tier that leaves open whether there is a hit
    double bounds[3]; // what t may be off, at each tier
} Expected;

typedef struct {
    const char *name;  // of the case
    const char *scene; // YAML, without a camera; NULL: built by scene_make
    void (*scene_make)(Scene *);
    const PlainRay *rays; // NULL: a family's first ray_count
    RayFamily family;
    size_t ray_count;
    const Expected *expected[2]; // narrow, wide: of the rays and those beside them, or of a family's first
    size_t expected_count[2];
    bool closed; // every ray of the family meets something
} ProbeTable;

extern const ProbeTable probe_tables[];
extern const size_t probe_table_count;
