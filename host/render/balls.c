#include "host/render/balls.h"

#include "host/render/hierarchy.h"
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

static Ball ball_seen(Enclosure around, Vector3 apex, double roundoff)
{
    Vector3 v = vector_subtract(around.center, apex);
    double squared = vector_dot(v, v),
           power = squared * (1 - BALL_SLACK * roundoff) - around.radius * around.radius;
    if (!(fabs(power) <= BALL_LARGEST && squared <= BALL_LARGEST)) return (Ball){{0, 0, 0, -BALL_LARGEST}};
    return (Ball){{v.x, v.y, v.z, power}};
}

// Where nothing hangs all rays miss.
static Ball hierarchy_ball(const SceneHeader *header, Vector3 apex, double roundoff)
{
    const uint32_t *hanging = (const uint32_t *)header->bounded_counts;
    uint32_t count = 0;
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        count += hanging[kind];
    if (count == 0) return (Ball){{0, 0, 0, BALL_LARGEST}};
    const Bounds bounds = {vector3_of(&header->bounds_low), vector3_of(&header->bounds_high)};
    return ball_seen(box_enclosure(&bounds), apex, roundoff);
}

// How many of a kind have balls, and where they begin.
typedef struct {
    size_t first, count;
} Plain;

static Plain plain_of(const FlatScene *flat, size_t kind)
{
    const SceneHeader *header = flat->arrays[FLAT_HEADER].items;
    size_t first = ((const uint32_t *)header->bounded_counts)[kind];
    return (Plain){first, kind == KIND_PLANES ? 0 : flat->arrays[FLAT_FIRST_SHAPE + kind].count - first};
}

static void row_lay(const FlatScene *flat, Vector3 apex, double roundoff, Ball *row)
{
    *row++ = hierarchy_ball(flat->arrays[FLAT_HEADER].items, apex, roundoff);
    for (size_t kind = 0; kind < KIND_COUNT; kind++) {
        Plain plain = plain_of(flat, kind);
        for (size_t i = 0; i < plain.count; i++) {
            const void *primitive = flat_array_at(&flat->arrays[FLAT_FIRST_SHAPE + kind], plain.first + i);
            *row++ = ball_seen(primitive_enclosure(kind, primitive), apex, roundoff);
        }
    }
}

// 16 MiB of floats; a scene that would need more does without.
enum { BALLS_LARGEST = 1 << 20 };

void balls_lay(FlatScene *flat, bool wide)
{
    double roundoff = wide ? DBL_EPSILON / 2 : FLT_EPSILON / 2;
    SceneHeader *header = flat->arrays[FLAT_HEADER].items;
    const FlatArray *lights = &flat->arrays[FLAT_LIGHTS];
    size_t count = 1;
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        count += plain_of(flat, kind).count;
    if (count > BALLS_LARGEST / (1 + lights->count)) {
        flat->arrays[FLAT_BALLS] = flat_array_make(FLAT_BALLS, 1); // a kernel's argument all the same
        return;
    }
    header->balls.x = (uint32_t)count;
    flat->arrays[FLAT_BALLS] = flat_array_make(FLAT_BALLS, count * (1 + lights->count));
    Ball *row = flat->arrays[FLAT_BALLS].items;
    row_lay(flat, (Vector3){0, 0, 0}, roundoff, row);
    for (size_t i = 0; i < lights->count; i++)
        row_lay(flat, vector3_of(&((const FlatLight *)lights->items)[i].position), roundoff, row += count);
}
