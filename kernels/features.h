// The parts a scene may do without, read by the host and by the kernels. Each NAME is HAS_NAME, 0 or 1, in
// the kernels. docs/performance.md has what each one costs where it is not needed.
#ifndef FEATURES_H
#define FEATURES_H

// clang-format off
#define FEATURE_LIST(FEATURE) \
    FEATURE(SPHERES)          \
    FEATURE(PLANES)           \
    FEATURE(DISCS)            \
    FEATURE(BOXES)            \
    FEATURE(CYLINDERS)        \
    FEATURE(CONES)            \
    FEATURE(TRIANGLES)        \
    FEATURE(TORI)             \
    FEATURE(POINT_LIGHTS)     \
    FEATURE(DIRECTIONAL_LIGHTS) \
    FEATURE(SPOT_LIGHTS)      \
    FEATURE(CHECKERS)         \
    FEATURE(IMAGES)           \
    FEATURE(REFLECTION)       \
    FEATURE(TRANSMISSION)     \
    FEATURE(BVH)
// clang-format on

#endif
