#include "host/compile/culling.h"

#include "host/compile/bvh_flatten.h"
#include "host/scene/vector.h"
#include <float.h>
#include <math.h>

typedef struct {
    Vector3 center;
    double radius; // infinite around what is unbounded
} Enclosure;

// Larger by what the roundings here and of the box itself come to, far from the eye.
static Enclosure box_enclosure(const Bounds *box)
{
    Vector3 half = vector_scale(vector_subtract(box->max, box->min), 0.5);
    double roundings = 4 * DBL_EPSILON * (vector_length(box->min) + vector_length(box->max));
    return (Enclosure){vector_add(box->min, half), vector_length(half) + roundings};
}

static Enclosure primitive_enclosure(size_t kind, const void *primitive)
{
    if (kind == KIND_SPHERES) {
        const Sphere *sphere = primitive;
        return (Enclosure){vector3_of(&sphere->center_radius), sphere->center_radius.w};
    }
    if (kind == KIND_DISCS) {
        const Disc *disc = primitive;
        return (Enclosure){vector3_of(&disc->center_radius), disc->center_radius.w};
    }
    if (kind == KIND_TORI) {
        const Torus *torus = primitive;
        return (Enclosure){vector3_of(&torus->center_major), torus->center_major.w + torus->axis_minor.w};
    }
    Bounds box;
    if (!primitive_box(kind, primitive, &box)) return (Enclosure){.radius = INFINITY};
    return box_enclosure(&box);
}

static CullSphere cull_sphere(Enclosure around, Vector3 common_origin, double roundoff)
{
    Vector3 v = vector_subtract(around.center, common_origin);
    double squared = vector_dot(v, v),
           power = squared * (1 - CULL_SPHERE_SLACK * roundoff) - around.radius * around.radius;
    if (!(fabs(power) <= CULL_SPHERE_LARGEST && squared <= CULL_SPHERE_LARGEST))
        return (CullSphere){{0, 0, 0, -CULL_SPHERE_LARGEST}};
    return (CullSphere){{v.x, v.y, v.z, power}};
}

// Where nothing hangs all rays miss.
static CullSphere bvh_cull_sphere(const SceneHeader *header, Vector3 common_origin, double roundoff)
{
    const uint32_t *hanging = (const uint32_t *)header->bounded_counts;
    uint32_t count = 0;
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        count += hanging[kind];
    if (count == 0) return (CullSphere){{0, 0, 0, CULL_SPHERE_LARGEST}};
    const Bounds bounds = {vector3_of(&header->bounds_low), vector3_of(&header->bounds_high)};
    return cull_sphere(box_enclosure(&bounds), common_origin, roundoff);
}

// How many of a kind have cull_spheres, and where they begin.
typedef struct {
    size_t first, count;
} Plain;

static Plain plain_of(const CompiledScene *flat, size_t kind)
{
    const SceneHeader *header = flat->arrays[FLAT_HEADER].items;
    size_t first = ((const uint32_t *)header->bounded_counts)[kind];
    return (Plain){first, kind == KIND_PLANES ? 0 : flat->arrays[FLAT_FIRST_SHAPE + kind].count - first};
}

static void row_fill(const CompiledScene *flat, Vector3 common_origin, double roundoff, CullSphere *row)
{
    *row++ = bvh_cull_sphere(flat->arrays[FLAT_HEADER].items, common_origin, roundoff);
    for (size_t kind = 0; kind < KIND_COUNT; kind++) {
        Plain plain = plain_of(flat, kind);
        for (size_t i = 0; i < plain.count; i++) {
            const void *primitive = flat_array_at(&flat->arrays[FLAT_FIRST_SHAPE + kind], plain.first + i);
            *row++ = cull_sphere(primitive_enclosure(kind, primitive), common_origin, roundoff);
        }
    }
}

// 16 MiB of floats; a scene that would need more does without.
enum { CULL_SPHERES_LARGEST = 1 << 20 };

void culling_fill(CompiledScene *flat, bool wide)
{
    double roundoff = wide ? DBL_EPSILON / 2 : FLT_EPSILON / 2;
    SceneHeader *header = flat->arrays[FLAT_HEADER].items;
    const FlatArray *lights = &flat->arrays[FLAT_LIGHTS];
    size_t count = 1;
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        count += plain_of(flat, kind).count;
    if (count > CULL_SPHERES_LARGEST / (1 + lights->count)) {
        flat->arrays[FLAT_CULL_SPHERES] =
            flat_array_make(FLAT_CULL_SPHERES, 1); // a kernel's argument all the same
        return;
    }
    header->cull_spheres.x = (uint32_t)count;
    flat->arrays[FLAT_CULL_SPHERES] = flat_array_make(FLAT_CULL_SPHERES, count * (1 + lights->count));
    CullSphere *row = flat->arrays[FLAT_CULL_SPHERES].items;
    row_fill(flat, (Vector3){0, 0, 0}, roundoff, row);
    for (size_t i = 0; i < lights->count; i++)
        row_fill(flat, vector3_of(&((const FlatLight *)lights->items)[i].position), roundoff, row += count);
}
