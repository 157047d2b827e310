#include "tests/specimen.h"

const char *const specimen_names[SPECIMEN_COUNT] = {
    "sphere",
    "plane",
    "disc",
    "box",
    "capped cylinder",
    "open cylinder",
    "infinite cylinder",
    "capped cone",
    "open cone",
    "pointed cone",
    "infinite cone",
    "triangle",
    "smooth triangle",
    "torus",
    "thin torus",
    "fat torus",
    "spindle torus",
    "capped paraboloid",
    "open paraboloid",
    "infinite paraboloid",
};

// SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
static uint64_t random_bits(Random *random)
{
    uint64_t z = random->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double random_between(Random *random, double low, double high)
{
    return low + (high - low) * (double)(random_bits(random) >> 11) * 0x1p-53;
}

static bool random_coin(Random *random)
{
    return random_bits(random) >> 63;
}

Vector3 random_in_ball(Random *random)
{
    for (;;) {
        Vector3 point = {random_between(random, -1, 1), random_between(random, -1, 1),
                         random_between(random, -1, 1)};
        if (vector_dot(point, point) <= 1) return point;
    }
}

static Vector3 random_unit(Random *random)
{
    return vector_normalize(random_in_ball(random));
}

// Between 10^low and 10^high, evenly in the exponent.
static double random_power(Random *random, double low, double high)
{
    return pow(10, random_between(random, low, high));
}

// On a grid fine for the sizes and coarse for the places that occur here: sums and differences are floats.
static Vector3 on_grid(Vector3 point)
{
    const double cells = 0x1p18;
    return (Vector3){rint(point.x * cells) / cells, rint(point.y * cells) / cells,
                     rint(point.z * cells) / cells};
}

static Specimen make_round(SpecimenKind kind, Random *random, Vector3 center, double size)
{
    double length = size * random_between(random, 0.5, 3);
    double first = size * random_between(random, 0.2, 1), second = size * random_between(random, 0.2, 1);
    Vector3 axis = on_grid(vector_scale(random_unit(random), length));
    Vector3 from = on_grid(vector_subtract(center, vector_scale(axis, 0.5)));
    if (kind == SPECIMEN_CONE_INFINITE) from = on_grid(center);
    Specimen specimen = {.kind = kind, .center = center, .axis = axis};
    specimen.reach = hypot(length / 2, fmax(first, second));
    if (kind == SPECIMEN_CONE_TIP) *(random_coin(random) ? &first : &second) = 0;
    bool caps = kind == SPECIMEN_CYLINDER_CAPPED || kind == SPECIMEN_CONE_CAPPED || kind == SPECIMEN_CONE_TIP;
    if (kind <= SPECIMEN_CYLINDER_INFINITE) {
        bool finite = kind != SPECIMEN_CYLINDER_INFINITE;
        specimen.object =
            (Object){.kind = SHAPE_CYLINDER, .as.cylinder = {from, axis, first, finite, caps, false}};
        specimen.reach = hypot(length / 2, first);
    } else if (kind == SPECIMEN_CONE_INFINITE) {
        double slope = random_between(random, 0.1, 3);
        specimen.object =
            (Object){.kind = SHAPE_CONE, .as.cone = {.from = from, .axis = axis, .slope = slope}};
    } else {
        specimen.object =
            (Object){.kind = SHAPE_CONE, .as.cone = {from, axis, {first, second}, 0, true, caps, false}};
    }
    return specimen;
}

static Specimen make_triangle(SpecimenKind kind, Random *random, Vector3 center, double size)
{
    Specimen specimen = {.kind = kind, .object.kind = SHAPE_TRIANGLE, .center = center, .reach = size};
    Vector3 *vertices = specimen.object.as.triangle.vertices;
    for (int i = 0; i < 3; i++)
        vertices[i] = vector_add(center, vector_scale(random_unit(random), size));
    specimen.axis = vector_subtract(vertices[1], vertices[0]);
    if (kind == SPECIMEN_TRIANGLE_SMOOTH) {
        Vector3 flat =
            vector_normalize(vector_cross(specimen.axis, vector_subtract(vertices[2], vertices[0])));
        specimen.object.as.triangle.smooth = true;
        for (int i = 0; i < 3; i++)
            specimen.object.as.triangle.normals[i] =
                vector_add(flat, vector_scale(random_in_ball(random), 0.5));
    }
    return specimen;
}

static Vector3 world_axis(Random *random)
{
    double parts[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        if (random_coin(random)) parts[i] = -0.0;
    parts[random_bits(random) % 3] = random_coin(random) ? 1 : -1;
    return (Vector3){parts[0], parts[1], parts[2]};
}

// Every other one lies square to a world axis.
static Specimen make_torus(SpecimenKind kind, Random *random, Vector3 center, double major)
{
    double minor = major * random_between(random, 0.1, 0.6);
    if (kind == SPECIMEN_TORUS_THIN) minor = major * 0.01;
    if (kind == SPECIMEN_TORUS_FAT) minor = major * 0.9;
    if (kind == SPECIMEN_TORUS_SPINDLE) minor = major * random_between(random, 1.1, 3);
    Vector3 axis = random_coin(random) ? world_axis(random) : on_grid(random_unit(random));
    return (Specimen){.kind = kind,
                      .object = {.kind = SHAPE_TORUS, .as.torus = {center, axis, major, minor}},
                      .center = center,
                      .reach = major + minor,
                      .axis = axis};
}

// A rim from a fifth to twice as wide as the paraboloid is high.
static Specimen make_paraboloid(SpecimenKind kind, Random *random, Vector3 center, double size)
{
    double height = size * random_between(random, 0.5, 3), rim = height * random_between(random, 0.1, 1);
    Vector3 axis = random_coin(random) ? world_axis(random) : on_grid(random_unit(random));
    Vector3 to_center = vector_scale(vector_normalize(axis), height / 2);
    bool finite = kind != SPECIMEN_PARABOLOID_INFINITE;
    return (Specimen){
        .kind = kind,
        .object = {.kind = SHAPE_PARABOLOID,
                   .as.paraboloid = {vector_subtract(center, to_center), axis, rim * rim / (4 * height),
                                     height, finite, kind == SPECIMEN_PARABOLOID_CAPPED}},
        .center = center,
        .reach = hypot(height / 2, rim),
        .axis = axis};
}

Specimen specimen_make(SpecimenKind kind, Random *random)
{
    double size = random_power(random, -1, 1);
    Vector3 center = vector_scale(random_in_ball(random), 8);
    Vector3 normal = on_grid(vector_scale(random_unit(random), random_power(random, -1, 1)));
    Specimen specimen = {.kind = kind, .center = center, .reach = size, .axis = normal};
    switch (kind) {
    case SPECIMEN_SPHERE:
        specimen.object = (Object){.kind = SHAPE_SPHERE, .as.sphere = {center, size, false}};
        break;
    case SPECIMEN_PLANE:
        specimen.object = (Object){.kind = SHAPE_PLANE, .as.plane = {center, normal}};
        break;
    case SPECIMEN_DISC:
        specimen.object = (Object){.kind = SHAPE_DISC, .as.disc = {center, normal, size}};
        break;
    case SPECIMEN_BOX: {
        Vector3 half = {random_between(random, 0.2, 1), random_between(random, 0.2, 1),
                        random_between(random, 0.2, 1)};
        half = vector_scale(half, size);
        specimen.object =
            (Object){.kind = SHAPE_BOX, .as.box = {vector_subtract(center, half), vector_add(center, half)}};
        specimen.reach = vector_length(half);
        break;
    }
    case SPECIMEN_TRIANGLE:
    case SPECIMEN_TRIANGLE_SMOOTH:
        return make_triangle(kind, random, center, size);
    case SPECIMEN_PARABOLOID_CAPPED:
    case SPECIMEN_PARABOLOID_OPEN:
    case SPECIMEN_PARABOLOID_INFINITE:
        return make_paraboloid(kind, random, center, size);
    case SPECIMEN_TORUS:
    case SPECIMEN_TORUS_THIN:
    case SPECIMEN_TORUS_FAT:
    case SPECIMEN_TORUS_SPINDLE:
        return make_torus(kind, random, center, size);
    default:
        return make_round(kind, random, center, size);
    }
    return specimen;
}

static SpecimenRay ray_between(Vector3 eye, Vector3 target, Random *random)
{
    Vector3 direction = vector_normalize(vector_subtract(target, eye));
    return (SpecimenRay){eye, vector_scale(direction, random_power(random, -1, 1))};
}

static SpecimenRay torus_ray(const Specimen *specimen, Random *random)
{
    double major = specimen->object.as.torus.major, minor = specimen->object.as.torus.minor;
    Vector3 axis = vector_normalize(specimen->axis);
    Vector3 in_plane = vector_normalize(vector_cross(axis, random_unit(random)));
    Vector3 other = vector_normalize(vector_cross(axis, random_unit(random)));
    Vector3 on_circle = vector_add(specimen->center, vector_scale(in_plane, major));
    Vector3 in_tube = vector_add(on_circle, vector_scale(random_in_ball(random), 0.9 * minor));
    Vector3 on_other = vector_add(specimen->center, vector_scale(other, major));
    Vector3 in_hole = vector_add(specimen->center, vector_scale(random_in_ball(random), major - minor));
    double distance = specimen->reach * random_power(random, log10(1.001), 4);
    switch (random_bits(random) % 4) {
    case 0:
        return ray_between(in_tube, vector_add(in_tube, random_in_ball(random)), random);
    case 1:
        return ray_between(in_hole, vector_add(in_hole, random_in_ball(random)), random);
    case 2: {
        // Seen along the plane the outline is the same whatever the height.
        Vector3 beside = vector_scale(other, specimen->reach * random_between(random, -1.1, 1.1));
        return ray_between(vector_add(specimen->center, vector_scale(in_plane, distance)),
                           vector_add(specimen->center, beside), random);
    }
    default:
        return ray_between(vector_add(on_circle, vector_scale(random_unit(random), distance)),
                           vector_add(on_other, vector_scale(random_in_ball(random), 1.5 * minor)), random);
    }
}

SpecimenRay specimen_ray(const Specimen *specimen, Random *random)
{
    Vector3 center = specimen->center;
    double reach = specimen->reach;
    double distance = reach * random_power(random, log10(1.001), 4);
    Vector3 eye = vector_add(center, vector_scale(random_unit(random), distance));
    Vector3 near = vector_add(center, vector_scale(random_in_ball(random), 1.1 * reach));
    Vector3 axis;
    if (specimen->object.kind == SHAPE_TORUS && random_coin(random)) return torus_ray(specimen, random);
    switch (random_bits(random) % 8) {
    case 0:
        return ray_between(vector_add(center, vector_scale(random_in_ball(random), 0.3 * reach)), eye,
                           random);
    case 1:
        axis = world_axis(random);
        return (SpecimenRay){vector_subtract(near, vector_scale(axis, distance)), axis};
    case 2:
        axis = vector_scale(specimen->axis, random_coin(random) ? 1 : -1);
        eye = vector_subtract(near, vector_scale(vector_normalize(axis), distance));
        return (SpecimenRay){eye, axis};
    case 3: {
        // What a sphere of that reach shows as its outline, a little inside or outside.
        Vector3 across = vector_normalize(vector_cross(vector_subtract(eye, center), random_unit(random)));
        double miss = random_power(random, -6, -1) * (random_coin(random) ? 1 : -1);
        return ray_between(eye, vector_add(center, vector_scale(across, reach * (1 + miss))), random);
    }
    default:
        return ray_between(eye, near, random);
    }
}
