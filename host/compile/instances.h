// Meshes that instances share, and the instances.
#pragma once

#include "host/compile/flatten.h"
#include "host/compile/settings.h"

// A mesh that instances share.
typedef struct {
    uint32_t mesh;     // of the scene
    uint32_t material; // 1 + the material of its texture coordinates, if that replaces the mesh's; else 0
    uint32_t next;     // 1 + the index of another one of the same mesh, or 0
    uint32_t object_material; // of triangles without another one
    bool is_opaque_somewhere, is_transparent_somewhere;
    Vector3 center, extent; // of its box; extent is half its size
    double scale;           // of its space, a power of two
} SharedMeshPlan;

enum { EXTENDED_COUNT = 6 }; // arrays that end with those of shared meshes

typedef struct InstancePlan {
    uint32_t *of_objects; // 1 + each object's shared mesh, or 0 if it shares none
    SharedMeshPlan *meshes;
    size_t mesh_count, instance_count;
    size_t triangle_count;                // of the instances
    double condition;                     // the largest of all instances
    size_t hidden_counts[EXTENDED_COUNT]; // used by shared_meshes_toggle
} InstancePlan;

// A map from a shared mesh's or a unit shape's space to the scene's, without its translation, and its
// inverse.
typedef struct {
    double rows[3][3], inverses[3][3];
    double determinant;
} InstanceMap;

// Returns a transform's map. With `is_exact` the inverse is rounded once from quadruple precision. Otherwise
// its error is some roundings of a double times the condition, which floats do not resolve.
InstanceMap instance_map(const Affine *transform, double scale, bool is_exact);
// Returns the largest sum of a row of |map| |inverse|, which is NAN or infinite if the map has no inverse.
double map_condition(const InstanceMap *map);

// Rounds the map into the rows of a flat struct, with `translation` in their last numbers.
void map_round(const Rounding *rounding, const InstanceMap *map, const double translation[3], scalar4 rows[3],
               scalar4 inverses[3]);

bool object_is_instance(const Object *object);
// Returns the number of instances of each of the scene's meshes. The caller frees it.
uint32_t *instance_uses(const Scene *scene);

// Returns a plan of which objects share meshes, or NULL if none does.
InstancePlan *instances_plan(const Scene *scene, const CompileSettings *settings);
void instance_plan_free(InstancePlan *plan);

// Returns 1 + the shared mesh of the scene's object, or 0.
uint32_t instance_mesh(const CompiledScene *compiled, size_t object);

// Appends an instance that shares a mesh, or replaces the one that is moved (host/compile/flatten.h).
void instance_flatten(Flattening *flattening, const Object *object, uint32_t shared_mesh);

// Returns how far mapping a ray to an instance moves its hits, relative to their distance. Returns 0 if there
// are no instances.
double instance_slack(const CompiledScene *compiled, const CompileSettings *settings);

// Returns the index of an id's ObjectEntry, which is the instance's if the id is in one.
uint32_t entry_of_id(const CompiledScene *compiled, uint32_t id);

// shared_meshes.c

// Appends the shared meshes' triangles, entries and BVHs to the scene's, and sets FLAT_SHARED_MESHES and the
// instances' places.
void shared_meshes_append(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings);
// Hides what shared_meshes_append added to the counts of arrays, or shows it if it is hidden.
void shared_meshes_toggle(CompiledScene *compiled);
