#include "host/compile/features.h"

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/compiled_scene.h"
#include "host/compile/shapes.h"
#include "host/scene/mesh.h"
#include <stdatomic.h>
#include <stdlib.h>

#define FEATURE_NAME(name, ...) #name,
const char *const feature_names[FEATURE_COUNT] = {FEATURE_LIST(FEATURE_NAME)};
#undef FEATURE_NAME

#define SHAPE_FEATURE(feature, Type, name, names) [TYPE_##feature] = FEATURE_##feature,
static const FeatureSet shape_features[TYPE_COUNT] = {SHAPE_LIST(SHAPE_FEATURE)};
#undef SHAPE_FEATURE

static const FeatureSet light_features[] = {
    [LIGHT_POINT] = FEATURE_POINT_LIGHTS,
    [LIGHT_DIRECTIONAL] = FEATURE_DIRECTIONAL_LIGHTS,
    [LIGHT_SPOT] = FEATURE_SPOT_LIGHTS,
};

FeatureSet material_features(const Material *material)
{
    FeatureSet set = 0;
    if (material->checker.is_on) set |= FEATURE_CHECKERS;
    if (material_any_texture(material)) set |= FEATURE_IMAGES;
    if (material->cutout.threshold > 0) set |= FEATURE_CUTOUTS;
    if (material->normal_map.texture > 0) set |= FEATURE_NORMAL_MAPS;
    if (material->reflection.largest > 0) set |= FEATURE_REFLECTION;
    // includes reflected rays, for total internal reflection
    if (material->transmission.largest > 0) set |= FEATURE_TRANSMISSION;
    // shadow rays must pass through it
    if (material->shadow == SHADOW_NONE) set |= FEATURE_TRANSMISSION;
    if (material->transmission.largest > 0 && !vector_is_zero(material->transmission.tint))
        set |= FEATURE_FILTERS | FEATURE_TINTS;
    if (material->transmission.largest > 0 && !vector_is_zero(material->absorption))
        set |= FEATURE_ABSORPTION | FEATURE_TINTS;
    if (!vector_is_zero(material->reflection.tint) || !vector_is_zero(material->specular.tint))
        set |= FEATURE_TINTS;
    if (!vector_is_zero(material->emission)) set |= FEATURE_EMISSION;
    if (material->conductor.n.x > 0 && set & FEATURE_REFLECTION) set |= FEATURE_CONDUCTORS | FEATURE_TINTS;
    // needs the index of refraction and the side of the surface
    if (material->fresnel && set & (FEATURE_REFLECTION | FEATURE_TRANSMISSION))
        set |= FEATURE_FRESNEL | FEATURE_TRANSMISSION;
    return set;
}

typedef struct {
    const Scene *scene;
    const FeatureSet *of_materials;
    _Atomic FeatureSet set;
} ObjectFeatures;

static void range_find_features(void *context, size_t begin, size_t end)
{
    ObjectFeatures *features = context;
    FeatureSet set = 0;
    for (size_t i = begin; i < end; i++) {
        const Object *object = &features->scene->objects.items[i];
        set |= features->of_materials[object->material];
        set |= shape_features[shape_primitive_type(object->type)];
        if (object->type == SHAPE_OVAL) set |= shape_features[object->as.oval.unit];
        if (object_is_smooth(features->scene, object)) set |= FEATURE_SMOOTH_NORMALS;
    }
    atomic_fetch_or(&features->set, set);
}

// Returns the union of the features of the materials of all triangles.
static FeatureSet meshes_materials(const ObjectFeatures *features)
{
    const Scene *scene = features->scene;
    FeatureSet set = 0;
    if (scene->meshes.count == 0) return set;
    OWNED bool *is_done = memory_allocate_zeroed(scene->meshes.count, sizeof *is_done);
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (object->type != SHAPE_MESH || is_done[object->as.mesh.index]) continue;
        const Mesh *mesh = &scene->meshes.items[object->as.mesh.index];
        const uint32_t *materials = mesh_materials(mesh, object);
        is_done[object->as.mesh.index] = materials != NULL;
        for (size_t k = 0; materials && k < mesh->triangle_count; k++)
            set |= features->of_materials[materials[k]];
    }
    return set;
}

FeatureSet features_of(const Scene *scene)
{
    OWNED FeatureSet *of_materials = memory_allocate(scene->materials.count, sizeof *of_materials);
    for (size_t i = 0; i < scene->materials.count; i++)
        of_materials[i] = material_features(&scene->materials.items[i]);
    ObjectFeatures features = {scene, of_materials, 0};
    parallel_run(scene->objects.count, FLAT_RANGE_MIN, range_find_features, &features);
    FeatureSet set = features.set | meshes_materials(&features);
    for (size_t i = 0; i < scene->lights.count; i++) {
        const Light *light = &scene->lights.items[i];
        set |= light_features[light->type];
        if (light_fades(light)) set |= FEATURE_FADING_LIGHTS;
        if (light->area.type != AREA_NONE) set |= FEATURE_AREA_LIGHTS;
        if (light->area.type == AREA_SKY) set |= FEATURE_SKY_LIGHT;
    }
    if (scene->camera.lens.radius > 0) set |= FEATURE_LENS;
    if (!vector_is_zero(scene->sky.up)) set |= FEATURE_SKY;
    if (scene->sky.texture > 0) set |= FEATURE_IMAGES;
    if (scene->camera.projection == PROJECTION_ORTHOGRAPHIC) set |= FEATURE_ORTHOGRAPHIC;
    if (scene->camera.projection == PROJECTION_EQUIRECTANGULAR) set |= FEATURE_EQUIRECTANGULAR;
    return set;
}

void features_write_prelude(Text *text, FeatureSet set)
{
    for (unsigned i = 0; i < FEATURE_COUNT; i++)
        text_appendf(text, "#define HAS_%s %d\n", feature_names[i], (int)(set >> i & 1));
}
