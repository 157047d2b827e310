#include "host/compile/scene_bounds.h"

#include "host/base/parallel.h"
#include "host/compile/compiled_scene.h"
#include "host/compile/shapes.h"
#include "host/scene/oval.h"
#include <pthread.h>

double box_width(const Bounds *bounds)
{
    const Vector3 size = vector_subtract(bounds->max, bounds->min);
    const double middle = fmax(fmin(size.x, size.y), fmin(fmax(size.x, size.y), size.z));
    return middle > 0 ? middle : vector_largest(size);
}

double box_reach(const Bounds *bounds, Vector3 from)
{
    return fmax(vector_largest(vector_subtract(bounds->min, from)),
                vector_largest(vector_subtract(bounds->max, from)));
}

static SceneExtent extent_empty(void)
{
    return (SceneExtent){bounds_empty(), 0, INFINITY, 1};
}

typedef struct {
    const Scene *scene;
    pthread_mutex_t lock; // of `extent`
    SceneExtent extent;
} Measuring;

static void range_measure(void *context, size_t begin, size_t end)
{
    Measuring *measuring = context;
    const Scene *scene = measuring->scene;
    SceneExtent extent = extent_empty();
    for (size_t i = begin; i < end; i++) {
        const Object *object = &scene->objects.items[i];
        const Bounds bounds = object_bounds(scene, object);
        if (object->type == SHAPE_OVAL) {
            double shortest, longest;
            oval_stretches(object, &shortest, &longest);
            extent.largest_stretch = fmax(extent.largest_stretch, longest / shortest);
        }
        if (bounds_is_everywhere(&bounds)) {
            extent.unbounded_count++;
            continue;
        }
        extent.bounds = bounds_join(extent.bounds, bounds);
        const double width = box_width(&bounds);
        if (width > 0 && width < extent.least_width) extent.least_width = width;
    }
    pthread_mutex_lock(&measuring->lock);
    SceneExtent *all = &measuring->extent;
    all->bounds = bounds_join(all->bounds, extent.bounds);
    all->unbounded_count += extent.unbounded_count;
    all->largest_stretch = fmax(all->largest_stretch, extent.largest_stretch);
    all->least_width = fmin(all->least_width, extent.least_width);
    pthread_mutex_unlock(&measuring->lock);
}

SceneExtent scene_extent(const Scene *scene)
{
    Measuring measuring = {scene, PTHREAD_MUTEX_INITIALIZER, extent_empty()};
    parallel_run(scene->objects.count, FLAT_RANGE_MIN, range_measure, &measuring);
    return measuring.extent;
}
