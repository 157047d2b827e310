// Joins the vertices of meshes and makes meshes smooth.
#pragma once

#include "host/scene/scene.h"

void mesh_free(Mesh *mesh); // and zeroes

// Joins vertices that agree in all their numbers, 0 and -0 included, and removes those of no triangle.
void mesh_join_vertices(Mesh *mesh);

// Sets each vertex normal to the mean of the triangles around it, weighted by angle, or to zero where none of
// them has an area.
void mesh_make_normals(Mesh *mesh);

// Returns how many triangles have no area.
size_t mesh_degenerate_count(const Mesh *mesh);
