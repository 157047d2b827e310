// The stages of scene_compile, in their order. Each reads what earlier ones left in the CompiledScene.
#pragma once

#include "host/compile/compile.h"
#include "host/compile/rounding.h"

// limits.c: false with a message where the scene has more primitives than ids, more that are not shared than
// a BVH counts, or more copies than may be made for instances.
bool size_fits(const CompiledScene *compiled, const Scene *scene, MessageList *messages);

// limits.c: warns of a scene whose sizes differ by more than a trillion, if the precision is in float.
void sizes_check(const Scene *scene, const CompileSettings *settings, MessageList *messages);

// units.c: scene units per unit of length on the device, a power of two; 1 for most scenes.
double scene_unit(const Scene *scene, const CompileSettings *settings);

// limits.c: false with a message if `certified` has no error bounds for a feature of the scene.
bool features_fit(const Scene *scene, const CompileSettings *settings, MessageList *messages);

// limits.c: false with a message where the square of a light's distance overflows the precision. The scene is
// in the device's unit.
bool lights_fit(const CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                MessageList *messages);

// textures.c: makes the scene's images linear (display values are sRGB; a scene of display colors takes all
// values as they are) and halves them level by level: FLAT_TEXTURE_LEVELS, FLAT_TEXELS and `textures`.
void textures_flatten(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings);

// objects.c, materials.c, lights.c: the arrays of each shape, FLAT_TRIANGLE_NORMALS, FLAT_TRIANGLE_UVS,
// FLAT_OBJECTS; FLAT_MATERIALS; FLAT_LIGHTS; FLAT_SKY_CELLS.
void objects_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
// The arrays of each shape as another eye sees them, in their order; FEATURE_EYE_POWERS.
void objects_move(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
void materials_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
void lights_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding);
void sky_cells_flatten(CompiledScene *compiled, const Scene *scene);

// neighbors.c: FLAT_TRIANGLE_NEIGHBORS, where it is compiled for `certified`; else none.
void neighbors_find(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings);

// limits.c: false with a message where a number of the camera, or of an array that has changed, overflows the
// precision.
bool numbers_fit(const CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                 MessageList *messages);

// bvh_flatten.c: builds the BVH (bvh.c), widens it for the kernel's lanes (bvh_widen.c) and fills FLAT_NODES;
// orders each shape's array as the leaves have it, what is unbounded or huge last. Without a BVH, one empty
// node.
void bvh_flatten(CompiledScene *compiled, const CompileSettings *settings);

// The same of a shared mesh alone, whatever the settings choose. bvh_shift adds to the indices of its nodes
// and to those of its leaves: the blocks', or the triangles' without blocks.
void mesh_bvh_flatten(CompiledScene *compiled, const CompileSettings *settings);
void bvh_shift(CompiledScene *compiled, uint32_t node_base, uint32_t leaf_base);

// The same tree, with boxes around the primitives as they are now.
void bvh_refit(CompiledScene *compiled);

// culling.c: FLAT_CULL_SPHERES, of the BVH and of each primitive outside it; none where they would be more
// than a million.
void culling_fill(CompiledScene *compiled, const CompileSettings *settings);

// contact.c: a box around all places where a transparent primitive may touch an opaque one; an empty one
// where none does. Only hits in it are tested for an opaque surface in the same place
// (kernels/shading/surface.h).
Bounds contact_find(const CompiledScene *compiled);

// certified_range.c: whether no error bound of `certified` underflows or overflows, by the sizes of the
// primitives and their distances from the eye. Otherwise every pixel is uncertified.
bool bounds_hold(const CompiledScene *compiled, const CompileSettings *settings);

// header.c: FLAT_HEADER.
void header_write(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings);
