// Random objects of every shape for tests and `glint verify`, the same in every run. Axes and their ends are
// floats exactly, so that a ray along an axis is parallel to it at every precision.
#pragma once

#include "host/scene/scene.h"

typedef struct {
    uint64_t state;
} Random;

uint64_t random_bits(Random *random);
bool random_coin(Random *random);
double random_between(Random *random, double low, double high);
double random_power(Random *random, double low, double high); // 10^low to 10^high, uniform in the exponent
Vector3 random_in_sphere(Random *random);                     // of radius 1
Vector3 random_unit_vector(Random *random);
Vector3 random_world_axis(Random *random); // either way, its zeros of either sign

// Returns the nearest point of a grid that is fine for the sizes and coarse for the positions of random
// objects, so that sums and differences are floats.
Vector3 vector_on_grid(Vector3 point);

typedef struct {
    Object object;
    Vector3 center;
    double radius; // around the center; contains all of a bounded object
    Vector3 axis;  // along which rays are special: an axis, a normal, an edge; not unit
} RandomShape;

enum { FORMS_OF_SHAPE_MAX = 4 };

// The random forms of a shape. The files of shapes/ have a row for each shape.
typedef struct {
    const char *names[FORMS_OF_SHAPE_MAX]; // up to the first NULL
    // Sets made->object's shape to a random one of a form, of about made->radius around made->center, along
    // made->axis if it has an axis or normal. Updates the radius and the axis if it chooses others.
    void (*randomize)(RandomShape *made, unsigned form, Random *random);
} RandomForms;

// A form of a shape, such as "open cylinder".
typedef struct {
    ShapeType type;
    unsigned form;
    const char *name;
    bool bounded;
} ShapeForm;

// Lists every form of every shape except the mesh, shape by shape. Returns their number.
enum { SHAPE_FORMS_MAX = 64 };
size_t shape_forms(ShapeForm forms[SHAPE_FORMS_MAX]);

RandomShape random_shape(const ShapeForm *form, Random *random); // 0.1 to 10 large, within 8 of the origin
RandomShape random_shape_at(const ShapeForm *form, Vector3 center, double size, Random *random);
