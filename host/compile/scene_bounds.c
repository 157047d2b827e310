#include "host/compile/scene_bounds.h"

#include "host/compile/shapes.h"

Bounds scene_bounds(const Scene *scene, size_t *unbounded_count)
{
    Bounds all = bounds_empty();
    *unbounded_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Bounds bounds = object_bounds(scene, &scene->objects.items[i]);
        if (bounds_is_everywhere(&bounds))
            ++*unbounded_count;
        else
            all = bounds_join(all, bounds);
    }
    return all;
}
