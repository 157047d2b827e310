#include "host/compile/scene_bounds.h"

#include "host/compile/shapes.h"

static bool object_bounds(const Scene *scene, size_t index, Bounds *bounds)
{
    const Object *object = &scene->objects.items[index];
    return shape_ops[object->type]->bounds(scene, object, bounds);
}

Bounds scene_bounds(const Scene *scene, size_t *unbounded_count)
{
    Bounds all = bounds_empty(), bounds;
    *unbounded_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        if (object_bounds(scene, i, &bounds))
            all = bounds_join(all, bounds);
        else
            ++*unbounded_count;
    }
    return all;
}

double scene_smallest_size(const Scene *scene)
{
    double smallest = INFINITY;
    Bounds bounds;
    for (size_t i = 0; i < scene->objects.count; i++) {
        if (!object_bounds(scene, i, &bounds)) continue;
        double largest_side = vector_largest(vector_subtract(bounds.max, bounds.min));
        if (largest_side > 0) smallest = fmin(smallest, largest_side);
    }
    return isinf(smallest) ? 0 : smallest;
}
