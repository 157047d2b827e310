#include "host/render/features.h"

#define FEATURE_NAME(name) #name,
const char *const feature_names[FEATURE_COUNT] = {FEATURE_LIST(FEATURE_NAME)};
#undef FEATURE_NAME

static const FeatureSet shape_features[SHAPE_COUNT] = {
    [SHAPE_SPHERE] = FEATURE_SPHERES,     [SHAPE_PLANE] = FEATURE_PLANES,       [SHAPE_DISC] = FEATURE_DISCS,
    [SHAPE_BOX] = FEATURE_BOXES,          [SHAPE_CYLINDER] = FEATURE_CYLINDERS, [SHAPE_CONE] = FEATURE_CONES,
    [SHAPE_TRIANGLE] = FEATURE_TRIANGLES, [SHAPE_TORUS] = FEATURE_TORI,
};

static const FeatureSet light_features[] = {
    [LIGHT_POINT] = FEATURE_POINT_LIGHTS,
    [LIGHT_DIRECTIONAL] = FEATURE_DIRECTIONAL_LIGHTS,
    [LIGHT_SPOT] = FEATURE_SPOT_LIGHTS,
};

FeatureSet features_of(const Scene *scene)
{
    FeatureSet set = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        set |= shape_features[scene->objects.items[i].kind];
        const Material *material = &scene->materials.items[scene->objects.items[i].material];
        if (material->checker) set |= FEATURE_CHECKERS;
        if (material->reflection > 0) set |= FEATURE_REFLECTION;
        // total reflection makes mirrors of glass
        if (material->transmission > 0) set |= FEATURE_TRANSMISSION;
    }
    for (size_t i = 0; i < scene->lights.count; i++)
        set |= light_features[scene->lights.items[i].kind];
    return set;
}

void features_write_prelude(Text *text, FeatureSet set)
{
    for (unsigned i = 0; i < FEATURE_COUNT; i++)
        text_appendf(text, "#define HAS_%s %d\n", feature_names[i], (int)(set >> i & 1));
}
