#include "host/measure/work.h"

#include "host/compile/shapes.h"

double work_flops_per_ray(const Scene *scene)
{
    double sum = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        sum += shape_ops[object->kind]->test_flops * (double)object_primitive_count(scene, object);
    }
    return sum;
}
