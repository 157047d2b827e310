#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <stdlib.h>

// Returns the largest side of the smallest bounded object's box, or 0 if none has any size.
static double smallest_size(const Scene *scene)
{
    double smallest = INFINITY;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Bounds bounds = object_bounds(scene, &scene->objects.items[i]);
        double largest_side = vector_largest(vector_subtract(bounds.max, bounds.min));
        if (largest_side > 0) smallest = fmin(smallest, largest_side); // infinite if unbounded
    }
    return isinf(smallest) ? 0 : smallest;
}

// In float a torus of 1e12 units, or of 1e-12, is lost, because the third and fourth powers of lengths
// overflow or underflow. Other shapes are lost at 1e19 and 1e-19. If the farthest point lies beyond 2^30 or
// within 2^-30, the unit is the geometric mean of its distance and the smallest object's size, which puts
// them on the two sides of 1, unless that would enlarge a large scene. Powers of two are exact, so the image
// is that of the scene as it is.
double scene_unit(const Scene *scene, const SceneExtent *extent, const CompileSettings *settings)
{
    if (settings->precision == PRECISION_DOUBLE) return 1;
    const int harmless = 30; // exponents up to there
    if (bounds_is_empty(&extent->bounds)) return 1;
    int farthest, smallest;
    frexp(box_reach(&extent->bounds, eye_of(scene, settings)), &farthest);
    if (abs(farthest) <= harmless) return 1;
    frexp(smallest_size(scene), &smallest);
    int middle = (farthest + smallest) / 2;
    return farthest > 0 && middle < 0 ? 1 : ldexp(1, middle);
}
