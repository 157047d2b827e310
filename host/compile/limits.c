#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/camera_basis.h"
#include "host/compile/instances.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include "host/scene/mesh.h"
#include <float.h>
#include <stdatomic.h>
#include <stdlib.h>

bool size_fits(const CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
               MessageList *messages)
{
    const size_t id_max = INT32_MAX - 1;
    const size_t bvh_max = (size_t)1 << 28;    // the most primitives that bvh_build accepts
    const size_t copied_max = (size_t)1 << 24; // bounds the cost of a hostile file
    const InstancePlan *plan = compiled->instances;
    const size_t count = scene_primitive_count(scene), single = count - (plan ? plan->triangle_count : 0);
    if (count > id_max)
        return message_error(messages,
                             "the scene has %zu objects and triangles, those of all instances included; at "
                             "most %zu are supported",
                             count, id_max);
    if (single > bvh_max)
        return message_error(messages, "the scene has %zu objects and triangles; at most %zu are supported",
                             single, bvh_max);
    if (scene->meshes.count == 0) return true;
    size_t copied = 0;
    OWNED uint32_t *uses = instance_uses(scene);
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (object_is_instance(object) && uses[object->as.mesh.index] > 1 && instance_mesh(compiled, i) == 0)
            copied += object_primitive_count(scene, object);
    }
    if (copied <= copied_max) return true;
    return message_error(messages,
                         "copies of meshes have %zu triangles in total; at most %zu are allowed; %s", copied,
                         copied_max,
                         settings->certifies ? "precision certified copies the mesh of each instance"
                                             : "a mesh is copied if a transform stretches it unevenly");
}

typedef struct {
    const Object *object;
    double size;
} Extreme;

// Returns the shape of an object and its line. The caller frees it.
static char *shape_and_line(const Scene *scene, const Object *object)
{
    const char *name = shape_names[object_shape(object)];
    if (object->line == 0) return memory_copy_text(name);
    if (object->file == 0) return text_format("%s on line %u", name, object->line);
    return text_format("%s on line %u of %s", name, object->line,
                       scene->included.items[object->file - 1].path);
}

void sizes_check(const Scene *scene, const SceneExtent *extent, const CompileSettings *settings,
                 MessageList *messages)
{
    const double detail = 1e-12;
    if (settings->precision == PRECISION_DOUBLE || settings->certifies) return;
    const Vector3 eye = eye_of(scene, settings);
    if (!(extent->least_width < detail * box_reach(&extent->bounds, eye))) return;
    Extreme farthest = {NULL, 0}, smallest = {NULL, INFINITY};
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const Bounds bounds = object_bounds(scene, object);
        if (bounds_is_everywhere(&bounds)) continue;
        const double reach = box_reach(&bounds, eye), width = box_width(&bounds);
        if (reach > farthest.size) farthest = (Extreme){object, reach};
        if (width > 0 && width < smallest.size) smallest = (Extreme){object, width};
    }
    OWNED char *farthest_name = shape_and_line(scene, farthest.object),
               *smallest_name = shape_and_line(scene, smallest.object);
    message_warning(
        messages,
        "the %s reaches %.3g from the eye, and the width of the %s is %.3g: precision %s may lose "
        "details smaller than a trillionth of the scene; change the sizes, or use --precision double",
        farthest_name, farthest.size, smallest_name, smallest.size, precision_names[settings->precision]);
}

// Returns the first object with a material that has the feature, or that casts no shadow for a feature of 0.
static const Object *object_with(const Scene *scene, FeatureSet feature)
{
    OWNED bool *has_feature = memory_allocate(scene->materials.count, sizeof *has_feature),
               *is_done = memory_allocate_zeroed(scene->meshes.count, sizeof *is_done);
    for (size_t i = 0; i < scene->materials.count; i++) {
        const Material *material = &scene->materials.items[i];
        has_feature[i] = feature ? material_features(material) & feature : material->shadow == SHADOW_NONE;
    }
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const Mesh *mesh = object->type == SHAPE_MESH ? &scene->meshes.items[object->as.mesh.index] : NULL;
        const uint32_t *of_triangles = mesh ? mesh_materials(mesh, object) : NULL;
        if (!of_triangles && has_feature[object->material]) return object;
        if (!of_triangles || is_done[object->as.mesh.index]) continue;
        is_done[object->as.mesh.index] = true;
        for (size_t k = 0; k < mesh->triangle_count; k++)
            if (has_feature[of_triangles[k]]) return object;
    }
    return NULL;
}

static bool refuse_unbounded(const Scene *scene, const char *what, const Object *object,
                             MessageList *messages)
{
    OWNED char *name = object ? shape_and_line(scene, object) : NULL;
    return message_error(messages, "certified has no error bounds for %s%s%s%s; use another precision", what,
                         name ? " (" : "", name ? name : "", name ? ")" : "");
}

bool features_fit(const Scene *scene, const CompileSettings *settings, MessageList *messages)
{
    static const struct {
        FeatureSet feature;
        const char *text;
    } unbounded[] = {
        {FEATURE_FRESNEL, "'fresnel'"},
        {FEATURE_CONDUCTORS, "'conductor'"},
        {FEATURE_ABSORPTION, "'absorption'"},
        {FEATURE_SKY_LIGHT, "a sky that is a light"},
        {FEATURE_AREA_LIGHTS, "lights with an area"},
        {FEATURE_LENS, "a camera with an 'aperture'"},
        {FEATURE_ORTHOGRAPHIC, "a camera with parallel rays"},
        {FEATURE_EQUIRECTANGULAR, "an equirectangular camera"},
        {FEATURE_CUTOUTS, "'cutout'"},
        {FEATURE_NORMAL_MAPS, "normal maps"},
    };
    if (!settings->certifies) return true;
    const FeatureSet features = features_of(scene);
    for (size_t i = 0; i < COUNT_OF(unbounded); i++)
        if (features & unbounded[i].feature)
            return refuse_unbounded(scene, unbounded[i].text, object_with(scene, unbounded[i].feature),
                                    messages);
    const CameraBasis basis = camera_basis(&scene->camera, settings->width, settings->height);
    if (camera_direction_error(&basis) > CAMERA_DIRECTION_ERROR_MAX)
        return message_error(
            messages,
            "'shift' moves the middle of the frame to %.3g focal lengths from the eye, where "
            "certified has error bounds up to %.3g; use another precision",
            vector_length(basis.middle), (double)CAMERA_DIRECTION_ERROR_MAX / CAMERA_SHIFT_ERROR - 1);
    const Object *unshadowed = object_with(scene, 0);
    return !unshadowed || refuse_unbounded(scene, "'shadow: false'", unshadowed, messages);
}

bool lights_fit(const CompiledScene *compiled, const Scene *scene, const SceneExtent *extent,
                const CompileSettings *settings, MessageList *messages)
{
    const double farthest = 1e18 * fmin(1, 4 / extent->largest_stretch);
    const Vector3 eye = eye_of(scene, settings);
    if (settings->precision == PRECISION_DOUBLE) return true;
    for (size_t i = 0; i < scene->lights.count; i++) {
        const Light *light = &scene->lights.items[i];
        const double distance = vector_largest(vector_subtract(light->position, eye)) + light->area.radius +
                                vector_largest(light->area.across[0]) + vector_largest(light->area.across[1]);
        if (light->type == LIGHT_DIRECTIONAL || distance <= farthest) continue;
        return message_error(
            messages,
            "a light is %.3g from the eye, but at most %.3g is possible at precision %s; use a directional "
            "light or --precision double",
            distance * compiled->unit, farthest * compiled->unit, precision_names[settings->precision]);
    }
    return true;
}

typedef struct {
    const FlatArray *array;
    double largest;
    atomic_bool exceeds;
} ArrayLimit;

static void range_check(void *context, size_t begin, size_t end)
{
    ArrayLimit *limit = context;
    for (size_t i = begin; i < end; i++) {
        const double *numbers = flat_array_at(limit->array, i);
        for (size_t k = 0; k < 4 * limit->array->layout.scalar4_count; k++)
            if (!(fabs(numbers[k]) <= limit->largest)) {
                atomic_store(&limit->exceeds, true);
                return;
            }
    }
}

static bool array_fits(const FlatArray *array, double largest)
{
    ArrayLimit limit = {array, largest, false};
    parallel_run(array->count, FLAT_RANGE_MIN, range_check, &limit);
    return !limit.exceeds;
}

bool numbers_fit(const CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                 MessageList *messages)
{
    bool is_double = settings->precision == PRECISION_DOUBLE;
    double largest = is_double ? DBL_MAX : FLT_MAX;
    CameraBasis basis = camera_basis(&scene->camera, settings->width, settings->height);
    bool fits = vector_is_within(scene->background, largest) && vector_is_within(scene->ambient, largest) &&
                vector_is_within(scene->sky.zenith, largest) && vector_is_within(scene->sky.nadir, largest) &&
                vector_is_within(basis.middle, largest) && vector_is_within(basis.right, largest) &&
                vector_is_within(basis.up, largest) &&
                vector_is_within(vector_add(compiled->eye_offset, basis.shift), largest);
    for (size_t type = 0; type < FLAT_COUNT && fits; type++)
        fits = !compiled->changed[type] || array_fits(&compiled->arrays[type], largest);
    if (fits) return true;
    return message_error(messages,
                         "a number of the scene does not fit precision %s: its magnitude is beyond %s",
                         precision_names[settings->precision], is_double ? "1.8e308" : "3.4e38");
}
