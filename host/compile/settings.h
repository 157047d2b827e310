// The settings that a Scene is compiled for.
#pragma once

#include "host/base/stage.h"
#include "host/compile/features.h"

typedef enum {
    PRECISION_SINGLE, // float, uncontracted; divisions and roots as the device has them
    PRECISION_STRICT, // float, compensated and correctly rounded: the same bits on every device
    PRECISION_DOUBLE, // double
    // single, with a bound on the error of each decision; pixels with an uncertain one are re-rendered in
    // double
    PRECISION_CERTIFIED,
    PRECISION_COUNT,
    ARITHMETIC_COUNT = PRECISION_CERTIFIED // those of one arithmetic come first
} Precision;
extern const char *const precision_names[PRECISION_COUNT];

// Selects whether rays traverse a BVH. The image is the same either way.
typedef enum { BVH_AUTO, BVH_ON, BVH_OFF, BVH_CHOICE_COUNT } BvhChoice;
extern const char *const bvh_choice_names[BVH_CHOICE_COUNT];

// Selects whether instances of a mesh share it or each has a copy.
typedef enum {
    INSTANCES_AUTO, // shared if copies would be large
    INSTANCES_SHARED,
    INSTANCES_COPIED
} InstanceChoice;

typedef struct {
    uint32_t width, height;  // of the whole image
    uint32_t sample_count;   // per pixel, >= 1
    uint32_t bounce_count;   // of a ray, at most
    double min_contribution; // the least weight of a secondary ray
    Precision precision;
    bool certifies; // at `certified`, and at `double` for what it re-renders: culls are wider
    uint32_t lanes; // of the kernel: 1, 4, 8, 16
    BvhChoice bvh;
    InstanceChoice instances;
    FeatureSet extra_features; // built in although the scene does not need them
    bool shift_to_eye;         // positions are relative to the eye; else as they are
    bool hashes_primitives;    // sets CompiledScene.primitives_hash
    bool is_preview;           // scene_move leaves the arrays as the last eye saw them, and takes no time
    // Reused from an earlier compilation of the same textures, whose arrays are then left empty, or NULL.
    const struct CompiledTexture *textures;
    Stage *stage; // may be NULL
} CompileSettings;
