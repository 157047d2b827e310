#include "host/compile/instances.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <float.h>
#include <math.h>

// The slack of |v|^2 and, for a sphere around instances, of the distance to them.
typedef struct {
    double squared, distance;
} CullSlack;

static CullSphere cull_sphere(BoundingSphere sphere, Vector3 common_origin, CullSlack slack)
{
    Vector3 v = vector_subtract(sphere.center, common_origin);
    if (slack.distance > 0) sphere.radius += slack.distance * 2 * (vector_length(v) + sphere.radius);
    double squared = vector_dot(v, v), power = squared * (1 - slack.squared) - sphere.radius * sphere.radius;
    if (!(fabs(power) <= CULL_SPHERE_MAX && squared <= CULL_SPHERE_MAX))
        return (CullSphere){{0, 0, 0, -CULL_SPHERE_MAX}};
    return (CullSphere){{v.x, v.y, v.z, power}};
}

// Returns the BVH's cull sphere, which all rays miss if the BVH is empty.
static CullSphere bvh_cull_sphere(const CompiledScene *compiled, Vector3 common_origin, CullSlack slack)
{
    if (bvh_primitive_count(compiled) == 0) return (CullSphere){{0, 0, 0, CULL_SPHERE_MAX}};
    return cull_sphere(box_bounding_sphere(&compiled->bvh_bounds), common_origin, slack);
}

// The first primitive of a type outside the BVH, and the end of those that have cull spheres. Planes do not
// have them.
typedef struct {
    size_t first, end;
} Outside;

static Outside outside_bvh(const CompiledScene *compiled, size_t type)
{
    size_t first = compiled->bvh_counts[type];
    return (Outside){first, type == TYPE_PLANES ? first : compiled->arrays[FLAT_FIRST_SHAPE + type].count};
}

static void row_fill(const CompiledScene *compiled, Vector3 common_origin, CullSlack slack, CullSphere *row)
{
    *row++ = bvh_cull_sphere(compiled, common_origin, slack);
    for (size_t type = 0; type < TYPE_COUNT; type++) {
        Outside outside = outside_bvh(compiled, type);
        for (size_t i = outside.first; i < outside.end; i++) {
            const void *primitive = flat_array_at(&compiled->arrays[FLAT_FIRST_SHAPE + type], i);
            const CullSlack slack_of_type = {slack.squared, type == TYPE_INSTANCES ? slack.distance : 0};
            *row++ = cull_sphere(primitive_bounding_sphere(type, primitive), common_origin, slack_of_type);
        }
    }
}

// 16 MiB of floats. A scene that would need more has no cull spheres.
enum { CULL_SPHERES_MAX = 1 << 20 };

void culling_fill(CompiledScene *compiled, const CompileSettings *settings)
{
    const double roundoff = (settings->precision == PRECISION_DOUBLE ? DBL_EPSILON : FLT_EPSILON) / 2;
    const CullSlack slack = {roundoff * CULL_SPHERE_SLACK, instance_slack(compiled, settings)},
                    light_slack = {
                        roundoff * (settings->certifies ? CERTIFIED_CULL_SPHERE_SLACK : CULL_SPHERE_SLACK),
                        slack.distance};
    const FlatArray *lights = &compiled->arrays[FLAT_LIGHTS];
    size_t count = 1;
    for (size_t type = 0; type < TYPE_COUNT; type++) {
        Outside outside = outside_bvh(compiled, type);
        count += outside.end - outside.first;
    }
    if (count > CULL_SPHERES_MAX / (1 + lights->count)) {
        // still a kernel argument
        compiled->cull_sphere_count = 0;
        flat_array_renew(compiled, FLAT_CULL_SPHERES, 1);
        return;
    }
    compiled->cull_sphere_count = (uint32_t)count;
    // unused ones follow, because kernels read as many at once as they have lanes
    flat_array_renew(compiled, FLAT_CULL_SPHERES, count * (1 + lights->count) + BVH_WIDTH_MAX);
    CullSphere *row = compiled->arrays[FLAT_CULL_SPHERES].items;
    row_fill(compiled, compiled->eye_offset, slack, row);
    for (size_t i = 0; i < lights->count; i++)
        row_fill(compiled, vector3_of(&((const FlatLight *)lights->items)[i].position), light_slack,
                 row += count);
}
