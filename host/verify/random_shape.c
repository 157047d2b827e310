#include "host/verify/random_shape.h"

#include "host/base/fault.h"
#include "host/base/random.h"
#include "host/compile/shapes.h"

#define FORMS_DECLARE(feature, Type, name, names) extern const RandomForms name##_forms;
SHAPE_LIST(FORMS_DECLARE)

// Indexed by ShapeType, which follows SHAPE_LIST.
#define FORMS_ROW(feature, Type, name, names) &name##_forms,
static const RandomForms *const shapes[SHAPE_MESH] = {SHAPE_LIST(FORMS_ROW)};

uint64_t random_bits(Random *random)
{
    return random_next(&random->state);
}

bool random_coin(Random *random)
{
    return random_bits(random) >> 63;
}

double random_between(Random *random, double low, double high)
{
    return low + (high - low) * (double)(random_bits(random) >> 11) * 0x1p-53;
}

double random_power(Random *random, double low, double high)
{
    return pow(10, random_between(random, low, high));
}

Vector3 random_in_sphere(Random *random)
{
    for (;;) {
        Vector3 point = {random_between(random, -1, 1), random_between(random, -1, 1),
                         random_between(random, -1, 1)};
        if (vector_dot(point, point) <= 1) return point;
    }
}

Vector3 random_unit_vector(Random *random)
{
    return vector_normalize(random_in_sphere(random));
}

Vector3 random_world_axis(Random *random)
{
    double parts[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        if (random_coin(random)) parts[i] = -0.0;
    parts[random_bits(random) % 3] = random_coin(random) ? 1 : -1;
    return (Vector3){parts[0], parts[1], parts[2]};
}

Vector3 vector_on_grid(Vector3 point)
{
    const double cells = 0x1p18;
    return (Vector3){rint(point.x * cells) / cells, rint(point.y * cells) / cells,
                     rint(point.z * cells) / cells};
}

size_t shape_forms(ShapeForm forms[SHAPE_FORMS_MAX])
{
    size_t count = 0;
    for (ShapeType type = 0; type < SHAPE_MESH; type++) {
        const char *const *names = shapes[type]->names;
        for (unsigned form = 0; form < FORMS_OF_SHAPE_MAX && names[form]; form++) {
            if (count == SHAPE_FORMS_MAX) fault("more than %d forms of shapes", SHAPE_FORMS_MAX);
            ShapeForm *entry = &forms[count++];
            *entry = (ShapeForm){type, form, names[form], false};
            const RandomShape one = random_shape(entry, &(Random){0});
            const Bounds bounds = object_bounds(NULL, &one.object);
            entry->bounded = !bounds_is_everywhere(&bounds);
        }
    }
    return count;
}

static RandomShape shape_make(const ShapeForm *form, Vector3 center, double size, Vector3 axis,
                              Random *random)
{
    RandomShape made = {.object.type = form->type, .center = center, .radius = size, .axis = axis};
    shapes[form->type]->randomize(&made, form->form, random);
    return made;
}

RandomShape random_shape(const ShapeForm *form, Random *random)
{
    double size = random_power(random, -1, 1);
    Vector3 center = vector_scale(random_in_sphere(random), 8);
    Vector3 axis = vector_on_grid(vector_scale(random_unit_vector(random), random_power(random, -1, 1)));
    return shape_make(form, center, size, axis, random);
}

RandomShape random_shape_at(const ShapeForm *form, Vector3 center, double size, Random *random)
{
    return shape_make(form, center, size, vector_on_grid(random_unit_vector(random)), random);
}
