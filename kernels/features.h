// Lists the kernel features that a scene may need, shared by host and kernels. In kernels each NAME is
// HAS_NAME, 0 or 1. build/tools/measure/features measures what each costs a scene that does not need it
// (docs/performance.md). Every primitive of PRIMITIVE_LIST (kernels/types.h) is a feature, so FEATURE takes a
// name and ignores the rest of its row.
#ifndef FEATURES_H
#define FEATURES_H

// clang-format off
#define FEATURE_LIST(FEATURE)     \
    PRIMITIVE_LIST(FEATURE)       \
    FEATURE(POINT_LIGHTS, )       \
    FEATURE(DIRECTIONAL_LIGHTS, ) \
    FEATURE(SPOT_LIGHTS, )        \
    FEATURE(FADING_LIGHTS, )      \
    FEATURE(AREA_LIGHTS, )        \
    FEATURE(SKY_LIGHT, )          \
    FEATURE(LENS, )               \
    FEATURE(ORTHOGRAPHIC, )       \
    FEATURE(EQUIRECTANGULAR, )    \
    FEATURE(SKY, )                \
    FEATURE(CHECKERS, )           \
    FEATURE(IMAGES, )             \
    FEATURE(CUTOUTS, )            \
    FEATURE(REFLECTION, )         \
    FEATURE(TRANSMISSION, )       \
    FEATURE(TINTS, )              \
    FEATURE(FILTERS, )            \
    FEATURE(EMISSION, )           \
    FEATURE(FRESNEL, )            \
    FEATURE(CONDUCTORS, )         \
    FEATURE(ABSORPTION, )         \
    FEATURE(EYE_POWERS, )         \
    FEATURE(BVH, )                \
    FEATURE(SMOOTH_NORMALS, )     \
    FEATURE(NORMAL_MAPS, )
// clang-format on

#endif
