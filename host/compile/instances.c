// Plans which instances share meshes, and flattens these instances.
#include "host/compile/instances.h"

#include "host/base/memory.h"
#include "host/compile/stages.h"
#include "host/scene/mesh.h"
#include <stdlib.h>
#include <string.h>

// Meshes with up to this many triangles in all instances are copied, because shared ones are slower to hit.
enum { COPIED_TRIANGLES_MAX = 1 << 18 };

// The largest entry of a map, and the largest distance of a light from an instance, in units of the mesh's
// size. Within these no square of a float overflows.
#define ENTRY_MAX          0x1p50
#define LIGHT_DISTANCE_MAX 0x1p59

InstanceMap instance_map(const Affine *transform, double scale, bool is_exact)
{
    InstanceMap map = {0};
    Vector3 rows[3];
    for (int i = 0; i < 3; i++) {
        const double *row = transform->rows[i];
        rows[i] = (Vector3){row[0] / scale, row[1] / scale, row[2] / scale};
        memcpy(map.rows[i], (const double[3]){rows[i].x, rows[i].y, rows[i].z}, sizeof map.rows[i]);
    }
    map.determinant = vector_dot(rows[0], vector_cross(rows[1], rows[2]));
    for (int k = 0; k < 3; k++) {
        const Vector3 one = rows[(k + 1) % 3], other = rows[(k + 2) % 3];
        Vector3 column = vector_scale(vector_cross(one, other), 1 / map.determinant);
        if (is_exact) {
            const Quad3 cross = quad3_cross(quad3(one), quad3(other));
            column = quad3_rounded(quad3_scale(cross, 1 / quad3_dot(quad3(rows[k]), cross)));
        }
        map.inverses[0][k] = column.x;
        map.inverses[1][k] = column.y;
        map.inverses[2][k] = column.z;
    }
    return map;
}

double map_condition(const InstanceMap *map)
{
    double condition = 0;
    for (int i = 0; i < 3; i++) {
        double sum = 0;
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                sum += fabs(map->rows[i][k]) * fabs(map->inverses[k][j]);
        if (!(sum <= condition)) condition = sum;
    }
    return condition;
}

void map_round(const Rounding *rounding, const InstanceMap *map, const double translation[3], scalar4 rows[3],
               scalar4 inverses[3])
{
    for (int i = 0; i < 3; i++) {
        rows[i] = scalar4_of(vector_rounded(rounding, vector_from(map->rows[i])),
                             rounded(rounding, translation[i]));
        inverses[i] = scalar4_of(vector_rounded(rounding, vector_from(map->inverses[i])), 0);
    }
}

static double map_largest(const double rows[3][3])
{
    double largest = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            if (!(fabs(rows[i][k]) <= largest)) largest = fabs(rows[i][k]);
    return largest;
}

// Returns whether rays can be mapped to the instance without loss, and joins its condition.
static bool map_suits(const Scene *scene, const Object *object, const SharedMeshPlan *shared,
                      double *condition)
{
    const InstanceMap map = instance_map(&object->as.mesh.transform, shared->scale, false);
    const double own_condition = map_condition(&map), inverse_largest = map_largest(map.inverses);
    const Vector3 center = affine_point(&object->as.mesh.transform, shared->center);
    bool suits = own_condition <= INSTANCE_CONDITION_MAX && map_largest(map.rows) <= ENTRY_MAX &&
                 inverse_largest <= ENTRY_MAX;
    for (size_t i = 0; i < scene->lights.count && suits; i++) {
        const Light *light = &scene->lights.items[i];
        suits =
            light->type == LIGHT_DIRECTIONAL ||
            vector_largest(vector_subtract(light->position, center)) * inverse_largest <= LIGHT_DISTANCE_MAX;
    }
    if (suits) *condition = fmax(*condition, own_condition * (1 + 1e-9)); // more than its rounding
    return suits;
}

// Returns the plan of the mesh that the object shares with others. If texture coordinates depend on the
// material that replaces the mesh's, each such material has a separate one.
static SharedMeshPlan shared_mesh_of(const Scene *scene, const Object *object)
{
    const Mesh *mesh = &scene->meshes.items[object->as.mesh.index];
    const bool is_separate = object->as.mesh.has_own_material && mesh->uvs &&
                             material_any_texture(&scene->materials.items[object->material]) > 0;
    SharedMeshPlan shared = {
        .mesh = object->as.mesh.index,
        .material = is_separate ? 1 + object->material : 0,
        .object_material = object->material,
        .center = bounds_center(mesh->bounds),
        .scale = 1,
    };
    shared.extent = vector_max(vector_subtract(mesh->bounds.max, shared.center),
                               vector_subtract(shared.center, mesh->bounds.min));
    int exponent;
    frexp(vector_largest(shared.extent), &exponent);
    if (!vector_is_zero(shared.extent)) shared.scale = ldexp(1, -exponent);
    shared.extent = vector_scale(shared.extent, shared.scale);
    return shared;
}

// Sets whether the mesh, with the materials that instances do not replace, is opaque and transparent.
static void shared_mesh_classify(const Scene *scene, SharedMeshPlan *shared)
{
    const Mesh *mesh = &scene->meshes.items[shared->mesh];
    const uint32_t *materials = shared->material > 0 ? NULL : mesh->materials;
    for (size_t i = 0; i < (materials ? mesh->triangle_count : 1); i++) {
        const uint32_t material = materials ? materials[i] : shared->object_material;
        const bool is_transparent = scene->materials.items[material].transmission.largest > 0;
        shared->is_transparent_somewhere |= is_transparent;
        shared->is_opaque_somewhere |= !is_transparent;
    }
}

// Returns 1 + the index of the shared mesh, after adding it to the plan if it is missing. `first` has, for
// each of the scene's meshes, 1 + the first shared one, or 0.
static uint32_t shared_mesh_index(InstancePlan *plan, uint32_t *first, const SharedMeshPlan *wanted)
{
    uint32_t *link = &first[wanted->mesh];
    for (; *link > 0; link = &plan->meshes[*link - 1].next)
        if (plan->meshes[*link - 1].material == wanted->material) return *link;
    *link = (uint32_t)plan->mesh_count + 1; // before the array moves
    plan->meshes = memory_resize(plan->meshes, plan->mesh_count + 1, sizeof *plan->meshes);
    plan->meshes[plan->mesh_count++] = *wanted;
    return (uint32_t)plan->mesh_count;
}

bool object_is_instance(const Object *object)
{
    return object->type == SHAPE_MESH && object->as.mesh.is_instance;
}

uint32_t *instance_uses(const Scene *scene)
{
    uint32_t *uses = memory_allocate_zeroed(scene->meshes.count, sizeof *uses);
    if (scene->meshes.count == 0) return uses;
    for (size_t i = 0; i < scene->objects.count; i++)
        if (object_is_instance(&scene->objects.items[i])) uses[scene->objects.items[i].as.mesh.index]++;
    return uses;
}

// Returns whether meshes are shared where that suits them.
static bool sharing_is_wanted(const Scene *scene, const CompileSettings *settings)
{
    size_t count = 0;
    if (settings->certifies || settings->instances == INSTANCES_COPIED || scene->meshes.count == 0)
        return false;
    for (size_t i = 0; i < scene->objects.count; i++)
        if (object_is_instance(&scene->objects.items[i]))
            count += object_primitive_count(scene, &scene->objects.items[i]);
    return count > (settings->instances == INSTANCES_SHARED ? 0 : COPIED_TRIANGLES_MAX);
}

InstancePlan *instances_plan(const Scene *scene, const CompileSettings *settings)
{
    if (!sharing_is_wanted(scene, settings)) return NULL;
    InstancePlan *plan = memory_allocate_zeroed(1, sizeof *plan);
    plan->of_objects = memory_allocate_zeroed(scene->objects.count, sizeof *plan->of_objects);
    OWNED uint32_t *first = memory_allocate_zeroed(scene->meshes.count, sizeof *first),
                   *uses = instance_uses(scene);
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (!object_is_instance(object) || object_primitive_count(scene, object) == 0) continue;
        if (uses[object->as.mesh.index] == 1 && settings->instances != INSTANCES_SHARED) continue;
        const SharedMeshPlan wanted = shared_mesh_of(scene, object);
        if (!map_suits(scene, object, &wanted, &plan->condition)) continue;
        const uint32_t shared = shared_mesh_index(plan, first, &wanted);
        if (!object->as.mesh.has_own_material) plan->meshes[shared - 1].object_material = object->material;
        plan->of_objects[i] = shared;
        plan->instance_count++;
        plan->triangle_count += object_primitive_count(scene, object);
    }
    for (size_t i = 0; i < plan->mesh_count; i++)
        shared_mesh_classify(scene, &plan->meshes[i]);
    if (plan->instance_count > 0) return plan;
    instance_plan_free(plan);
    return NULL;
}

void instance_plan_free(InstancePlan *plan)
{
    if (!plan) return;
    free(plan->of_objects);
    free(plan->meshes);
    free(plan);
}

uint32_t instance_mesh(const CompiledScene *compiled, size_t object)
{
    return compiled->instances ? compiled->instances->of_objects[object] : 0;
}

void instance_flatten(Flattening *flattening, const Object *object, uint32_t shared_mesh)
{
    const SharedMeshPlan *shared = &flattening->compiled->instances->meshes[shared_mesh];
    const Affine *transform = &object->as.mesh.transform;
    const Rounding *rounding = &flattening->rounding;
    const InstanceMap map = instance_map(transform, shared->scale, rounding->is_double);
    const Vector3 seen = vector_subtract(affine_point(transform, shared->center), rounding->eye);
    double translation[3] = {seen.x, seen.y, seen.z};
    const double eye[3] = {rounding->eye.x, rounding->eye.y, rounding->eye.z};
    const double half[3] = {shared->extent.x, shared->extent.y, shared->extent.z};
    double extent[3];
    for (int i = 0; i < 3; i++) {
        const double *row = transform->rows[i];
        extent[i] = 0;
        for (int k = 0; k < 3; k++)
            extent[i] += fabs(map.rows[i][k]) * half[k];
        if (rounding->is_double)
            translation[i] =
                (double)(quad3_dot(quad3(vector_from(row)), quad3(shared->center)) + row[3] - eye[i]);
    }
    const bool replaces = object->as.mesh.has_own_material && shared->material == 0;
    Instance instance = {
        .extent = {extent[0], extent[1], extent[2], map_condition(&map)},
        .id = {0, shared_mesh, replaces ? 1 + object->material : 0, 0},
    };
    map_round(rounding, &map, translation, instance.rows, instance.inverses);
    instance.inverses[0].w = sqrt(fabs(map.determinant));
    const uint32_t first = (uint32_t)flattening->primitive_count,
                   count = (uint32_t)object_primitive_count(flattening->scene, object);
    primitive_add(flattening, TYPE_INSTANCES, &instance, object->material);
    if (flattening->moved) return;
    flattening->primitive_count += count - 1;
    InstanceIds *ids = flattening->compiled->arrays[FLAT_INSTANCE_IDS].items;
    ids[flattening->counts[TYPE_INSTANCES] - 1].ids =
        (uint4){first, first + count, (uint32_t)(flattening->primitive_count - flattening->entry_count), 0};
}

double instance_slack(const CompiledScene *compiled, const CompileSettings *settings)
{
    const double roundoff = (settings->precision == PRECISION_DOUBLE ? DBL_EPSILON : FLT_EPSILON) / 2;
    return compiled->instances ? INSTANCE_RAY_SLACK * roundoff * compiled->instances->condition : 0;
}

uint32_t entry_of_id(const CompiledScene *compiled, uint32_t id)
{
    const FlatArray *array = &compiled->arrays[FLAT_INSTANCE_IDS];
    const InstanceIds *ids = array->items;
    size_t low = 0, high = array->count; // `low` instances begin no later than the id
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (ids[middle].ids.x <= id)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == 0) return id;
    const uint4 before = ids[low - 1].ids;
    return (id < before.y ? before.y - 1 : id) - before.z;
}
