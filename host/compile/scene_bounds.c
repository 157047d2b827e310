#include "host/compile/scene_bounds.h"

#include "host/compile/shapes.h"

Bounds scene_bounds(const Scene *scene, size_t *unbounded_count)
{
    Bounds all = bounds_empty(), bounds;
    *unbounded_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (shape_ops[object->type]->bounds(scene, object, &bounds))
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
        const Object *object = &scene->objects.items[i];
        if (!shape_ops[object->type]->bounds(scene, object, &bounds)) continue;
        double largest_side = vector_largest(vector_subtract(bounds.max, bounds.min));
        if (largest_side > 0) smallest = fmin(smallest, largest_side);
    }
    return isinf(smallest) ? 0 : smallest;
}
