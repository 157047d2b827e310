// Places checkers and textures on flat surfaces and on triangles.
#pragma once

#include "host/compile/flatten.h"

// Sets the checker squares or the texture of a plane or disc: u = u.xyz . p + u.w counts squares or textures
// at p relative to the eye. Leaves both unchanged if the material has neither.
void surface_grid(const Flattening *flattening, uint32_t material, Vector3 normal, scalar4 *u, scalar4 *v);

// Returns the texture coordinates of a mesh's triangle.
TriangleUvs triangle_uvs(const Mesh *mesh, const Vector3 vertices[3], const uint32_t *corners,
                         const CompiledTexture *texture);
