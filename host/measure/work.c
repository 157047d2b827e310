#include "host/measure/work.h"

// Counted by hand up to where a miss is certain, in the usual forms: the discriminant of a quadratic around
// the shape's center or axis, slabs for the box, the first barycentric coordinate of Möller and Trumbore's
// test for the triangle (Journal of Graphics Tools 2(1), 1997), and the coefficients of the torus' quartic.
static const double test_flops[SHAPE_COUNT] = {
    [SHAPE_SPHERE] = 17,   [SHAPE_PLANE] = 14, [SHAPE_DISC] = 14,     [SHAPE_BOX] = 22,
    [SHAPE_CYLINDER] = 40, [SHAPE_CONE] = 50,  [SHAPE_TRIANGLE] = 23, [SHAPE_TORUS] = 60,
};

double work_flops_per_ray(const Scene *scene)
{
    double sum = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (object->kind == SHAPE_MESH)
            sum += test_flops[SHAPE_TRIANGLE] *
                   (double)scene->meshes.items[object->as.mesh.index].triangle_count;
        else
            sum += test_flops[object->kind];
    }
    return sum;
}
