// The parts of the kernel that a scene needs. kernels/features.h lists them.
#pragma once

#include "host/base/text.h"
#include "host/scene/scene.h"
#include "kernels/features.h"
#include "kernels/types.h"
#include <stdint.h>

#define FEATURE_BIT_INDEX(name, ...) FEATURE_INDEX_##name,
enum { FEATURE_LIST(FEATURE_BIT_INDEX) FEATURE_COUNT };
#undef FEATURE_BIT_INDEX

// Uses a GNU extension, because enumeration constants are int in ISO C.
#define FEATURE_BIT(name, ...) FEATURE_##name = UINT64_C(1) << FEATURE_INDEX_##name,
__extension__ typedef enum {
    FEATURE_LIST(FEATURE_BIT) FEATURE_ALL = (UINT64_C(1) << FEATURE_COUNT) - 1
} FeatureBits;
#undef FEATURE_BIT

typedef uint64_t FeatureSet;

extern const char *const feature_names[FEATURE_COUNT]; // "SPHERES", …

FeatureSet features_of(const Scene *scene);
FeatureSet material_features(const Material *material);
void features_write_prelude(Text *text, FeatureSet set); // `#define HAS_SPHERES 1` … one for each feature
