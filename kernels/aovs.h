// Lists the layers of a film: the color of each pixel, and its AOVs (arbitrary output variables), most of
// which describe the ray through its center. The layers' numbers and names, their offsets on the device and
// the files follow from these lists. Adding an AOV also takes its computation in a kernel and its
// documentation.
//
// LAYER(NAME, name, type, components, note). The type is REAL, of the kernel's precision; LENGTH, a real in
// the scene's unit of length; or INTEGER, of 32 bits. Components are values per pixel; PER_LIGHT means one
// for each light.
#ifndef AOVS_H
#define AOVS_H

#define PER_LIGHT 0

// clang-format off
// aov.cl
#define HIT_AOV_LIST(LAYER)                                                                                    \
    LAYER(T,        t,        LENGTH,  1, "distance from the eye; infinite for a miss")               \
    LAYER(NORMAL,   normal,   REAL,    3, "unit shading normal, on the side that is seen; 0 for a miss") \
    LAYER(POSITION, position, LENGTH,  3, "hit point, in the scene's coordinates")                              \
    LAYER(OBJECT,   object,   INTEGER, 1, "number of the object, from 0; 4294967295 for a miss")      \
    LAYER(SHADOW,   shadow,   INTEGER, PER_LIGHT, "1 where that light is occluded, 0 elsewhere")                \
    LAYER(RAY,      ray,      REAL,    3, "direction from the eye")

// path.cl
#define PATH_AOV_LIST(LAYER) \
    LAYER(PATH, path, INTEGER, 1, "signature of all objects hit, also in mirrors and through glass")

// coverage.cl
#define SAMPLED_AOV_LIST(LAYER) \
    LAYER(COVERAGE, coverage, REAL, 1, "fraction of the samples that hit an object") \
    LAYER(BACKDROP, backdrop, REAL, 3, "the background's part of the color")

// render.cl
#define COLOR_LAYER(LAYER) \
    LAYER(COLOR, color, REAL, 3, "linear RGB, the mean of all samples")

// host/render/rerender.c
#define HOST_AOV_LIST(LAYER) \
    LAYER(FLAG, flag, INTEGER, 1, "at certified 1 where re-rendered in double, 2 where uncertified, else 0")

#define LAYER_LIST(LAYER) \
    HIT_AOV_LIST(LAYER) PATH_AOV_LIST(LAYER) SAMPLED_AOV_LIST(LAYER) COLOR_LAYER(LAYER) HOST_AOV_LIST(LAYER)
// clang-format on

// Holds the offset of each layer in a band's buffer, in units of ARENA_UNIT. The sum of each pixel's colors
// is first, and the compensation of its rounding follows (render.cl).
#define LAYER_OFFSET(NAME, name, type, components, note) unsigned name;
typedef struct {
    LAYER_LIST(LAYER_OFFSET)
} LayerOffsets;

#endif
