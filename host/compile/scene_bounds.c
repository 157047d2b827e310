#include "host/compile/scene_bounds.h"

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/compile/shapes.h"
#include <stdlib.h>

enum { BLOCK_SIZE = 4096 };

double box_width(const Bounds *bounds)
{
    const Vector3 size = vector_subtract(bounds->max, bounds->min);
    const double middle = fmax(fmin(size.x, size.y), fmin(fmax(size.x, size.y), size.z));
    return middle > 0 ? middle : vector_largest(size);
}

static SceneExtent extent_empty(void)
{
    return (SceneExtent){bounds_empty(), 0, INFINITY};
}

typedef struct {
    const Scene *scene;
    SceneExtent *extents; // of blocks of objects
} BlockExtents;

static void blocks_bound(void *context, size_t begin, size_t end)
{
    const BlockExtents *blocks = context;
    const Scene *scene = blocks->scene;
    for (size_t block = begin; block < end; block++) {
        SceneExtent extent = extent_empty();
        for (size_t i = block * BLOCK_SIZE; i < scene->objects.count && i < (block + 1) * BLOCK_SIZE; i++) {
            const Bounds bounds = object_bounds(scene, &scene->objects.items[i]);
            if (bounds_is_everywhere(&bounds)) {
                extent.unbounded_count++;
                continue;
            }
            extent.bounds = bounds_join(extent.bounds, bounds);
            const double width = box_width(&bounds);
            if (width > 0 && width < extent.least_width) extent.least_width = width;
        }
        blocks->extents[block] = extent;
    }
}

SceneExtent scene_extent(const Scene *scene)
{
    const size_t block_count = scene->objects.count / BLOCK_SIZE + 1;
    BlockExtents blocks = {scene, memory_allocate(block_count, sizeof *blocks.extents)};
    parallel_run(block_count, 2, blocks_bound, &blocks);
    SceneExtent all = extent_empty();
    for (size_t i = 0; i < block_count; i++) {
        all.bounds = bounds_join(all.bounds, blocks.extents[i].bounds);
        all.unbounded_count += blocks.extents[i].unbounded_count;
        all.least_width = fmin(all.least_width, blocks.extents[i].least_width);
    }
    free(blocks.extents);
    return all;
}
