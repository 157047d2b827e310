// The stages of scene_compile, in order. Each reads what earlier ones left in the CompiledScene.
#pragma once

#include "host/compile/compile.h"
#include "host/compile/rounding.h"
#include "host/compile/scene_bounds.h"

// Returns the point that becomes the origin.
static inline Vector3 eye_of(const Scene *scene, const CompileSettings *settings)
{
    return settings->shift_to_eye ? scene->camera.position : (Vector3){0};
}

// limits.c: Returns false with a message if the scene has more primitives than ids, more unshared ones than
// a BVH counts, or more copies than instances may have.
bool size_fits(const CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
               MessageList *messages);

// limits.c: Warns of a scene whose sizes differ by more than a trillion, if the precision is in float.
void sizes_check(const Scene *scene, const SceneExtent *extent, const CompileSettings *settings,
                 MessageList *messages);

// units.c: Returns the scene units per unit of length on the device, a power of two, 1 for most scenes.
double scene_unit(const Scene *scene, const SceneExtent *extent, const CompileSettings *settings);

// limits.c: Returns false with a message if `certified` has no error bounds for a feature of the scene.
bool features_fit(const Scene *scene, const CompileSettings *settings, MessageList *messages);

// limits.c: Returns false with a message if the square of a light's distance overflows the precision. The
// scene is in the device's unit.
bool lights_fit(const CompiledScene *compiled, const Scene *scene, const SceneExtent *extent,
                const CompileSettings *settings, MessageList *messages);

// textures.c: Makes the scene's images linear (display values are sRGB; a scene of display colors keeps all
// values) and halves them level by level. Fills FLAT_TEXTURE_LEVELS, FLAT_TEXELS and `textures`.
void textures_flatten(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings);

// objects.c, materials.c, lights.c: Fill the arrays of each shape, FLAT_TRIANGLE_NORMALS, FLAT_TRIANGLE_UVS
// and FLAT_OBJECTS; FLAT_MATERIALS; FLAT_LIGHTS and FLAT_SKY_CELLS.
void objects_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
// Updates the arrays of each shape for another eye, in their order, and FEATURE_EYE_POWERS.
void objects_move(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
void materials_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
void lights_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
void sky_cells_flatten(CompiledScene *compiled, const Scene *scene);

// neighbors.c: Fills FLAT_TRIANGLE_NEIGHBORS, which is empty unless compiled for `certified`.
void neighbors_find(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings);

// limits.c: Returns false with a message if a number of the camera, or of an array that has changed,
// overflows the precision.
bool numbers_fit(const CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                 MessageList *messages);

// bvh_flatten.c: Builds the BVH (bvh.c), widens it for the kernel's lanes (bvh_widen.c), fills FLAT_NODES
// and orders each shape's array as the leaves are, with unbounded and huge primitives last. Without a BVH,
// adds one empty node.
void bvh_flatten(CompiledScene *compiled, const CompileSettings *settings);

// Builds the BVH of a shared mesh alone, whatever the settings choose.
void mesh_bvh_flatten(CompiledScene *compiled, const CompileSettings *settings);

// bvh_nodes.c: Adds to the indices of the nodes and of the leaves, which are those of blocks, or of triangles
// if there are no blocks.
void bvh_shift(CompiledScene *compiled, uint32_t node_base, uint32_t leaf_base);

// bvh_nodes.c: Fits the boxes of the same tree to the primitives as they are now.
void bvh_refit(CompiledScene *compiled);

// culling.c: Fills FLAT_CULL_SPHERES for the BVH and each primitive outside it, or for none if there would
// be more than a million.
void culling_fill(CompiledScene *compiled, const CompileSettings *settings);

// contact.c: Returns a box around all places where a transparent primitive may touch an opaque one, or an
// empty box. Only hits in it are tested for an opaque surface in the same place
// (kernels/shading/visible_surface.h).
Bounds contact_find(const CompiledScene *compiled);

// certified_range.c: Returns whether no error bound of `certified` underflows or overflows, by the sizes of
// the primitives and their distances from the eye. Otherwise every pixel is uncertified.
bool bounds_hold(const CompiledScene *compiled, const CompileSettings *settings);

// header.c: Writes FLAT_HEADER.
void header_write(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings);
