#include "tests/random_ray.h"

Scene scene_of_shapes(Object *objects, size_t count, Material *material)
{
    Scene scene = {.camera = {.look_at = {0, 0, 1}, .half_tangent = 1}};
    *material = (Material){.color = {1, 1, 1}, .diffuse = {1, 1, 1}};
    scene.objects.items = objects;
    scene.objects.count = count;
    scene.materials.items = material;
    scene.materials.count = 1;
    return scene;
}

Vector3 random_cube_point(Random *random, double half)
{
    double x = random_between(random, -half, half), y = random_between(random, -half, half);
    return (Vector3){x, y, random_between(random, -half, half)};
}

static RandomRay ray_between(Vector3 eye, Vector3 target, Random *random)
{
    Vector3 direction = vector_normalize(vector_subtract(target, eye));
    return (RandomRay){eye, vector_scale(direction, random_power(random, -1, 1))};
}

static RandomRay torus_ray(const RandomShape *shape, Random *random)
{
    double major = shape->object.as.torus.major, minor = shape->object.as.torus.minor;
    Vector3 axis = vector_normalize(shape->axis);
    Vector3 in_plane = vector_normalize(vector_cross(axis, random_unit_vector(random)));
    Vector3 other = vector_normalize(vector_cross(axis, random_unit_vector(random)));
    Vector3 on_circle = vector_add(shape->center, vector_scale(in_plane, major));
    Vector3 in_tube = vector_add(on_circle, vector_scale(random_in_sphere(random), 0.9 * minor));
    Vector3 on_other = vector_add(shape->center, vector_scale(other, major));
    Vector3 in_hole = vector_add(shape->center, vector_scale(random_in_sphere(random), major - minor));
    double distance = shape->radius * random_power(random, log10(1.001), 4);
    switch (random_bits(random) % 4) {
    case 0:
        return ray_between(in_tube, vector_add(in_tube, random_in_sphere(random)), random);
    case 1:
        return ray_between(in_hole, vector_add(in_hole, random_in_sphere(random)), random);
    case 2: {
        // A ray in the circle's plane sees the torus edge-on.
        Vector3 target = vector_scale(other, shape->radius * random_between(random, -1.1, 1.1));
        return ray_between(vector_add(shape->center, vector_scale(in_plane, distance)),
                           vector_add(shape->center, target), random);
    }
    default:
        return ray_between(vector_add(on_circle, vector_scale(random_unit_vector(random), distance)),
                           vector_add(on_other, vector_scale(random_in_sphere(random), 1.5 * minor)), random);
    }
}

RandomRay random_ray(const RandomShape *shape, Random *random)
{
    Vector3 center = shape->center;
    double radius = shape->radius;
    double distance = radius * random_power(random, log10(1.001), 4);
    Vector3 eye = vector_add(center, vector_scale(random_unit_vector(random), distance));
    Vector3 near = vector_add(center, vector_scale(random_in_sphere(random), 1.1 * radius));
    Vector3 axis;
    if (shape->object.type == SHAPE_TORUS && random_coin(random)) return torus_ray(shape, random);
    switch (random_bits(random) % 8) {
    case 0:
        return ray_between(vector_add(center, vector_scale(random_in_sphere(random), 0.3 * radius)), eye,
                           random);
    case 1:
        axis = random_world_axis(random);
        return (RandomRay){vector_subtract(near, vector_scale(axis, distance)), axis};
    case 2:
        axis = vector_scale(shape->axis, random_coin(random) ? 1 : -1);
        eye = vector_subtract(near, vector_scale(vector_normalize(axis), distance));
        return (RandomRay){eye, axis};
    case 3: {
        // a point slightly inside or outside of the outline of a sphere of that radius
        Vector3 across =
            vector_normalize(vector_cross(vector_subtract(eye, center), random_unit_vector(random)));
        double miss = random_power(random, -6, -1) * (random_coin(random) ? 1 : -1);
        return ray_between(eye, vector_add(center, vector_scale(across, radius * (1 + miss))), random);
    }
    default:
        return ray_between(eye, near, random);
    }
}
